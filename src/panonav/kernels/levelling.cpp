#include "panonav/kernels/levelling.hpp"

#include <initializer_list>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

namespace {

void require_one_size(std::size_t size, std::initializer_list<std::size_t> others) {
  for (const std::size_t other : others) {
    require(other == size, "number of values", static_cast<double>(other),
            std::to_string(size) + " (as of the first ones)");
  }
}

}  // namespace

void tilted_positions(const TiltedDirections& directions, std::span<const double> cosines,
                      std::span<const double> sines, std::span<float> rows,
                      std::span<float> columns, Instructions instructions) {
  require_one_size(cosines.size(), {sines.size(), rows.size(), columns.size()});
  with_body<LevellingBody>(instructions, [&](auto body) {
    body.tilted_positions(directions, cosines.data(), sines.data(), rows.data(), columns.data(),
                          static_cast<int>(cosines.size()));
  });
}

void sample_tilted_row(std::span<const float> seen, std::span<const float> rows,
                       std::span<const float> shifts, std::span<float> values,
                       Instructions instructions) {
  require_one_size(rows.size(), {shifts.size(), values.size()});
  require(!rows.empty() && !seen.empty() && seen.size() % rows.size() == 0, "values of a panorama",
          static_cast<double>(seen.size()), "a multiple of " + std::to_string(rows.size()));
  with_body<LevellingBody>(instructions, [&](auto body) {
    body.sample_tilted_row(seen.data(), static_cast<int>(seen.size() / rows.size()), rows.data(),
                           shifts.data(), values.data(), static_cast<int>(rows.size()));
  });
}

}  // namespace panonav::kernels
