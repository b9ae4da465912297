#include "runs/shown_references.hpp"

#include <algorithm>
#include <utility>

#include "panonav/geometry/voronoi.hpp"

namespace panonav::command {

ShownReferences::ShownReferences(const VisualMemory& memory, LengthUnit unit) : unit_(unit) {
  for (const ViewId view : memory.views()) {
    const ReferenceInfo& info = memory.info(view);
    if (!info.pose) continue;
    position_index_.emplace(view, positions_.size());
    positions_.push_back(info.pose->position());
    views_.push_back({info.name, info.pose->heading_rad});
  }
}

void ShownReferences::add_to(recordings::RunMoment& moment) const {
  moment.references = positions_;
  if (unit_ != LengthUnit::metres) moment.length_unit = to_string(unit_);
  moment.reference_views = views_;
  moment.regions = voronoi_regions(positions_);
}

void ShownReferences::compare(recordings::RunMoment& moment, const VisualMemory& memory,
                              const PackedSignature& view) const {
  constexpr std::size_t max_compared = 1000;
  const auto top = static_cast<int>(std::min(memory.size(), max_compared));
  if (top == 0) return;
  for (const Match& match : memory.search(view, {.top = top}).matches) {
    const auto found = position_index_.find(match.view);
    if (found == position_index_.end()) continue;
    moment.comparisons.push_back({found->second, match.dissimilarity});
  }
}

std::vector<recordings::RunRegion> voronoi_regions(const std::vector<Point2>& positions,
                                                   const std::vector<std::size_t>& areas) {
  constexpr std::size_t max_cells = 5000;
  if (positions.size() > max_cells) return {};
  const VoronoiCells cells(positions);
  std::vector<recordings::RunRegion> regions;
  std::vector<bool> done(cells.sites().size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const std::size_t site = cells.site_of()[i];
    if (done[site]) continue;
    done[site] = true;
    std::vector<Point2> outline = cells.cell(site);
    if (outline.size() < 3) continue;
    regions.push_back({std::move(outline), areas.empty() ? 0 : areas[i]});
  }
  return regions;
}

}  // namespace panonav::command
