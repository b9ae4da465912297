#include "panonav/localisation/neighbour_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/memory/floors.hpp"

namespace panonav {

namespace {

/// Largest number of neighbours of a reference: those on a grid.
constexpr std::size_t max_neighbours = 8;
/// Number of views that jointly explain a query: a grid square has four corners.
constexpr std::size_t supporting_view_count = 4;
/// Radius of the neighbourhood in spacings: more than the diagonal of a grid's square.
constexpr double radius_spacings = 1.5;
/// Largest ratio of an examined match's score to the best score; places that look similar differ by
/// less (tests/localisation/neighbour_support_test.cpp).
constexpr double max_score_ratio = 1.25;
/// Largest difference between the robot's headings by the chosen match and by a neighbour moved
/// with it: larger than the compass's error between neighbours, far below the quarter rotation of
/// places that look similar.
constexpr double heading_tolerance_rad = radians(20.0);

}  // namespace

double NeighbourSupport::radius_m(double spacing_m) noexcept {
  return radius_spacings * spacing_m;
}

NeighbourSupport::NeighbourSupport(const ColumnRanking& ranking, std::optional<double> spacing_m)
    : ranking_(&ranking) {
  const VisualMemory& memory = ranking.memory();
  FloorPlane plane;
  std::vector<Point2> positions;
  std::vector<ViewId> views;
  for (const ViewId view : memory.views()) {
    if (find_pose(view) == nullptr) continue;
    positions.push_back(plane.to_plane(*find_position(memory.info(view))));
    views.push_back(view);
  }
  if (positions.size() < 2) return;
  spacing_m_ = spacing_m ? *spacing_m : VoronoiCells(positions).spacing_m();
  radius_m_ = radius_m(spacing_m_);
  if (!(radius_m_ > 0.0)) return;
  for (const ViewId view : views) {
    const auto found = find_position(memory.info(view));
    grids_.try_emplace(std::string(found->floor), radius_m_)
        .first->second.add(view.value, found->point);
  }
}

const ReferencePose* NeighbourSupport::find_pose(ViewId view) const {
  const auto& pose = ranking_->memory().info(view).pose;
  return pose && pose->heading_rad ? &*pose : nullptr;
}

std::vector<ViewId> NeighbourSupport::neighbours(ViewId view) const {
  const ReferencePose* const pose = find_pose(view);
  if (pose == nullptr) return {};
  const auto grid = grids_.find(floor_of(ranking_->memory().info(view).name));
  if (grid == grids_.end()) return {};
  std::vector<std::pair<double, ViewId>> found;
  grid->second.visit_near(pose->position(), [&](std::uint32_t other, Point2 position) {
    const double distance_m = distance(position, pose->position());
    if (other != view.value && distance_m <= radius_m_)
      found.emplace_back(distance_m, ViewId{other});
  });
  std::ranges::sort(found);
  std::vector<ViewId> views;
  for (const auto& [distance_m, neighbour] : found) {
    if (views.size() == max_neighbours) break;
    views.push_back(neighbour);
  }
  return views;
}

std::optional<double> NeighbourSupport::supported_difference(
    const ColumnProfiles& query, const RankedMatch& match, std::span<const ViewId> excluded) const {
  const ReferencePose* const pose = find_pose(match.match.view);
  if (pose == nullptr) return std::nullopt;
  const double heading_rad = *pose->heading_rad + match.columns.heading_rad;

  struct Fit {
    double difference;
    std::array<double, ColumnProfiles::compared_columns> columns;
  };
  std::vector<Fit> fits;
  std::vector<ViewId> views = neighbours(match.match.view);
  std::erase_if(views,
                [&](ViewId view) { return std::ranges::find(excluded, view) != excluded.end(); });
  views.insert(views.begin(), match.match.view);
  for (const ViewId view : views) {
    Fit fit{};
    fit.columns = column_distances_at_heading(query, *ranking_->profiles(view),
                                              heading_rad - *find_pose(view)->heading_rad);
    for (const double column : fit.columns) fit.difference += std::sqrt(column);
    fits.push_back(fit);
  }
  std::ranges::stable_sort(fits, {}, &Fit::difference);
  if (fits.size() > supporting_view_count) fits.resize(supporting_view_count);
  double sum = 0.0;
  for (std::size_t c = 0; c < ColumnProfiles::compared_columns; ++c) {
    double best = fits.front().columns[c];
    double second = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < fits.size(); ++i) {
      const double value = fits[i].columns[c];
      second = std::min(second, std::max(best, value));
      best = std::min(best, value);
    }
    sum += std::sqrt(fits.size() == 1 ? best : 0.5 * (best + second));
  }
  return sum / ColumnProfiles::compared_columns;
}

void NeighbourSupport::rank_by_support(const ColumnProfiles& query,
                                       std::vector<RankedMatch>& ranked,
                                       std::span<const ViewId> excluded) const {
  if (ranked.empty() || grids_.empty()) return;
  const double limit = max_score_ratio * ranked.front().score();
  const RankedMatch* chosen = nullptr;
  double min_score = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(max_examined, ranked.size()); ++i) {
    if (ranked[i].score() > limit) break;
    const auto difference = supported_difference(query, ranked[i], excluded);
    if (difference && ranked[i].score_with(*difference) < min_score) {
      min_score = ranked[i].score_with(*difference);
      chosen = &ranked[i];
    }
  }
  if (chosen == nullptr) return;
  std::vector<ViewId> group = neighbours(chosen->match.view);
  group.push_back(chosen->match.view);
  const double heading_rad =
      *find_pose(chosen->match.view)->heading_rad + chosen->columns.heading_rad;
  std::stable_partition(ranked.begin(), ranked.end(), [&](const RankedMatch& r) {
    if (std::ranges::find(group, r.match.view) == group.end()) return false;
    return std::abs(angle_difference(*find_pose(r.match.view)->heading_rad + r.columns.heading_rad,
                                     heading_rad)) <= heading_tolerance_rad;
  });
}

}  // namespace panonav
