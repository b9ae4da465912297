#include "panonav/kernels/column_match.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

void match_columns(std::span<const std::uint8_t> query, std::span<const std::uint8_t> reference,
                   std::span<std::uint16_t> costs, Instructions instructions) {
  constexpr auto query_size = static_cast<std::size_t>(matched_query_columns * matched_bands);
  constexpr auto reference_size =
      static_cast<std::size_t>(matched_reference_columns * matched_bands);
  require(query.size() == query_size, "bytes of the query's columns",
          static_cast<double>(query.size()), "512");
  require(reference.size() == reference_size, "bytes of the reference's columns",
          static_cast<double>(reference.size()), "2048");
  require(costs.size() == static_cast<std::size_t>(matched_reference_columns), "turns",
          static_cast<double>(costs.size()), "128");
  with_body<ColumnMatchBody>(instructions, [&](auto body) {
    body.match_columns(query.data(), reference.data(), costs.data());
  });
}

}  // namespace panonav::kernels
