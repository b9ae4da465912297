#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav_fleet/internal/sketch_segment.hpp"
#include "panonav_fleet/internal/view_sketches.hpp"

namespace panonav::fleet {

/// A segment, and which of its views still exist.
struct LiveSegment {
  std::shared_ptr<const SketchSegment> sketches;
  std::vector<std::uint64_t> live;  // one bit for each row of its blocks
  std::size_t count = 0;
  [[nodiscard]] bool has(std::size_t row) const { return (live[row / 64] >> (row % 64) & 1U) != 0; }
};

/// Searches segments for the `top` views nearest to a query as `ViewSketches::search`;
/// `components` of them are compared. The caller must have checked query, mask and components.
[[nodiscard]] SearchResult search_segments(const SegmentLayout& layout,
                                           std::span<const LiveSegment> segments,
                                           const PackedSignature& query, int components,
                                           const SearchMask& mask, std::size_t top,
                                           const ViewSketches::ReadViews& read, Executor& executor);

}  // namespace panonav::fleet
