#include "panonav/kernels/turn_products.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

std::size_t turn_products_stride(std::size_t columns) noexcept {
  constexpr std::size_t lanes = turn_products_lanes;
  return (columns + lanes - 1) / lanes * lanes;
}

void turn_products(std::span<const float> rows, std::size_t columns,
                   std::span<const float> periodic, std::span<float> products,
                   std::span<float> largest, Instructions instructions) {
  const auto check = [](std::size_t size, std::size_t expected, const char* what) {
    require(size == expected, what, static_cast<double>(size),
            to_text(static_cast<double>(expected)));
  };
  const std::size_t count = largest.size();
  const std::size_t stride = turn_products_stride(columns);
  require(columns >= 1 && columns <= 65536, "columns", static_cast<double>(columns), "1 .. 65536");
  check(rows.size(), count * columns, "values of the rows");
  check(periodic.size(), columns + stride, "values of the periodic row");
  check(products.size(), count * stride, "products");
  with_body<TurnProductsBody>(instructions, [&](auto body) {
    body.turn_products(rows.data(), static_cast<int>(count), static_cast<int>(columns),
                       periodic.data(), products.data(), largest.data());
  });
}

}  // namespace panonav::kernels
