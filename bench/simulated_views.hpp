#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav::bench {

/// Views to memorise and views to ask for, 80 x 15 magnitudes each, packed with one full scale.
struct ViewSet {
  static constexpr SignatureShape shape{80, 15};
  std::vector<std::uint8_t> views;    ///< one signature after the other
  std::vector<std::uint8_t> queries;  ///< at other places and headings than the views, other noise

  [[nodiscard]] std::size_t size() const { return views.size() / shape.size(); }
  [[nodiscard]] std::size_t query_count() const { return queries.size() / shape.size(); }
  [[nodiscard]] std::span<const std::uint8_t> view(std::size_t i) const {
    return std::span(views).subspan(i * shape.size(), shape.size());
  }
  [[nodiscard]] std::span<const std::uint8_t> query(std::size_t i) const {
    return std::span(queries).subspan(i * shape.size(), shape.size());
  }
};

/// Arrangement of the views of a set.
enum class Places {
  rooms,   ///< 10 cm grids in 50 and more rooms
  paths,   ///< paths of hundreds of metres through rooms, one view every 10 cm
  numbers  ///< no places: random bytes
};

/// Rendered with the project's own ray tracing: 80 rows x 64 columns, one ray a pixel, random
/// headings, the grey-level noise of a 512-column camera with a standard deviation of 2 %.
/// Rendering takes milliseconds a view, so the set is kept in `cache` and read from there the next
/// time. Rooms are those of `first_room` and the following seeds.
[[nodiscard]] ViewSet simulated_views(Places places, std::size_t views, std::size_t queries,
                                      const std::filesystem::path& cache,
                                      std::uint64_t first_room = 1);

}  // namespace panonav::bench
