#include "panonav/localisation/hierarchical.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/localisation/internal/posed_views.hpp"

namespace panonav {

ReferenceAreas::ReferenceAreas(const VisualMemory& memory) : ReferenceAreas(PosedViews(memory)) {}

ReferenceAreas::ReferenceAreas(PosedViews posed)
    : views_(std::move(posed.views)), plane_(std::move(posed.plane)), cells_(posed.positions) {
  areas_m2_.reserve(cells_.sites().size());
  for (std::size_t site = 0; site < cells_.sites().size(); ++site) {
    areas_m2_.push_back(cells_.area_m2(site));
  }
}

std::optional<std::size_t> ReferenceAreas::find_site(ViewId view) const {
  const auto found = std::ranges::lower_bound(views_, view);
  if (found == views_.end() || *found != view) return std::nullopt;
  return cells_.site_of()[static_cast<std::size_t>(found - views_.begin())];
}

std::vector<Point2> ReferenceAreas::cell(ViewId view) const {
  const auto here = find_site(view);
  auto corners = here ? cells_.cell(*here) : std::vector<Point2>{};
  for (Point2& corner : corners) corner = plane_.to_floor(corner).point;
  return corners;
}

std::optional<std::vector<std::size_t>> ReferenceAreas::find_sites(
    std::span<const Match> views) const {
  std::vector<std::size_t> sites;
  for (const Match& match : views) {
    const auto site = find_site(match.view);
    if (!site) return std::nullopt;
    sites.push_back(*site);
  }
  return sites;
}

std::optional<double> ReferenceAreas::area_m2(std::span<const Match> views) const {
  auto sites = find_sites(views);
  if (!sites) return std::nullopt;
  // Views at one position share their cell.
  std::ranges::sort(*sites);
  sites->erase(std::unique(sites->begin(), sites->end()), sites->end());
  double sum = 0.0;
  for (const std::size_t site : *sites) sum += areas_m2_[site];
  return sum;
}

std::optional<Circle> ReferenceAreas::enclosing_circle(std::span<const Match> views) const {
  const auto sites = find_sites(views);
  if (!sites || sites->empty()) return std::nullopt;
  std::vector<Point2> positions;
  const std::string_view floor = plane_.to_floor(cells_.sites()[sites->front()]).floor;
  for (const std::size_t site : *sites) {
    const FloorPosition position = plane_.to_floor(cells_.sites()[site]);
    if (position.floor != floor) return std::nullopt;
    positions.push_back(position.point);
  }
  Circle circle = smallest_enclosing_circle(positions);
  circle.radius_m += cells_.spacing_m() / std::sqrt(2.0);
  return circle;
}

void visit_options(LocalisationAccuracy& accuracy, OptionVisitor& visitor) {
  using T = LocalisationAccuracy;
  constexpr OptionTable table{
      option<&T::components>("largest number of Fourier components to compare; 0: all", 0),
      option<&T::radius_m>("stop when the position is known within this radius; 0: never", 0),
      option<&T::tolerance>("keep candidates whose dissimilarity is at most (1 + tolerance) times "
                            "the smallest dissimilarity",
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
