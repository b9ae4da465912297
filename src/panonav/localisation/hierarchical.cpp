#include "panonav/localisation/hierarchical.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace panonav {

namespace {

std::vector<ViewId> posed_views(const VisualMemory& memory) {
  std::vector<ViewId> posed;
  for (const ViewId view : memory.views()) {
    if (memory.info(view).pose) posed.push_back(view);
  }
  return posed;
}

VoronoiCells cells_of(const VisualMemory& memory, std::span<const ViewId> posed) {
  std::vector<Point2> positions;
  positions.reserve(posed.size());
  for (const ViewId view : posed) positions.push_back(memory.info(view).pose->position());
  return VoronoiCells(positions);
}

}  // namespace

ReferenceAreas::ReferenceAreas(const VisualMemory& memory)
    : views_(posed_views(memory)), cells_(cells_of(memory, views_)) {
  areas_m2_.reserve(cells_.sites().size());
  for (std::size_t site = 0; site < cells_.sites().size(); ++site) {
    areas_m2_.push_back(cells_.area_m2(site));
  }
}

std::optional<std::size_t> ReferenceAreas::site(ViewId view) const {
  const auto found = std::ranges::lower_bound(views_, view);
  if (found == views_.end() || *found != view) return std::nullopt;
  return cells_.site_of()[static_cast<std::size_t>(found - views_.begin())];
}

std::vector<Point2> ReferenceAreas::cell(ViewId view) const {
  const auto here = site(view);
  return here ? cells_.cell(*here) : std::vector<Point2>{};
}

std::optional<double> ReferenceAreas::area_m2(std::span<const Match> views) const {
  std::vector<std::size_t> sites;
  for (const Match& match : views) {
    const auto here = site(match.view);
    if (!here) return std::nullopt;
    sites.push_back(*here);
  }
  // Views at one position share their cell.
  std::ranges::sort(sites);
  sites.erase(std::unique(sites.begin(), sites.end()), sites.end());
  double sum = 0.0;
  for (const std::size_t here : sites) sum += areas_m2_[here];
  return sum;
}

std::optional<Circle> ReferenceAreas::enclosing_circle(std::span<const Match> views) const {
  std::vector<Point2> positions;
  for (const Match& match : views) {
    const auto here = site(match.view);
    if (!here) return std::nullopt;
    positions.push_back(cells_.sites()[*here]);
  }
  if (positions.empty()) return std::nullopt;
  Circle circle = smallest_enclosing_circle(positions);
  circle.radius_m += cells_.spacing_m() / std::sqrt(2.0);
  return circle;
}

void visit_options(LocalisationAccuracy& accuracy, OptionVisitor& visitor) {
  using T = LocalisationAccuracy;
  constexpr OptionTable table{
      option<&T::components>("Fourier components compared at most, 0 for all", 0),
      option<&T::radius_m>("stop as soon as the place is known to this radius, 0 for never", 0),
      option<&T::tolerance>("candidates are kept up to 1 + tolerance times the best dissimilarity",
                            0),
  };
  table.visit(accuracy, visitor);
}

std::vector<LocalisationLevel> localise_hierarchically(const VisualMemory& memory,
                                                       const ReferenceAreas& areas,
                                                       const PackedSignature& query,
                                                       const LocalisationAccuracy& accuracy,
                                                       const SearchMask& mask) {
  validate(accuracy);
  std::vector<LocalisationLevel> levels;
  const auto add = [&](const VisualMemory::HierarchyLevel& level) {
    levels.push_back({level.components, level.candidates, areas.area_m2(level.candidates),
                      areas.enclosing_circle(level.candidates), level.bytes_read});
    const auto& region = levels.back().region;
    return accuracy.radius_m > 0.0 && region && region->radius_m <= accuracy.radius_m;
  };
  (void)memory.hierarchy(query, accuracy.tolerance, accuracy.components, add, mask);
  return levels;
}

}  // namespace panonav
