#include "panonav/localisation/neighbour_support.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/voronoi.hpp"

namespace panonav {

namespace {

// Neighbours of a reference, and views that explain a query together: those of a grid, and the
// corners of its square.
constexpr std::size_t max_neighbours = 8;
constexpr std::size_t counted_views = 4;
// Spacings within which neighbours lie: more than the diagonal of a grid's square.
constexpr double radius_spacings = 1.5;
// Matches are examined up to this ratio of their score to that of the best. Chosen.
constexpr double max_score_ratio = 1.25;
// Neighbours that tell another heading than the chosen match by more are not of its group. Chosen.
constexpr double heading_tolerance_rad = radians(20.0);

}  // namespace

double NeighbourSupport::radius_m(double spacing_m) noexcept {
  return radius_spacings * spacing_m;
}

NeighbourSupport::NeighbourSupport(const ColumnRanking& ranking, std::optional<double> spacing_m)
    : ranking_(&ranking) {
  std::vector<Point2> positions;
  std::vector<ViewId> views;
  for (const ViewId view : ranking.memory().views()) {
    if (const ReferencePose* const pose = placed(view)) {
      positions.push_back(pose->position());
      views.push_back(view);
    }
  }
  if (positions.size() < 2) return;
  spacing_m_ = spacing_m ? *spacing_m : VoronoiCells(positions).spacing_m();
  radius_m_ = radius_m(spacing_m_);
  if (!(radius_m_ > 0.0)) return;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto [x, y] = cell_of(positions[i]);
    sites_.push_back({x, y, views[i]});
  }
  std::ranges::sort(sites_, {},
                    [](const Site& s) { return std::tuple(s.cell_x, s.cell_y, s.view); });
}

const ReferencePose* NeighbourSupport::placed(ViewId view) const {
  const auto& pose = ranking_->memory().info(view).pose;
  return pose && pose->heading_rad ? &*pose : nullptr;
}

std::pair<std::int64_t, std::int64_t> NeighbourSupport::cell_of(Point2 position) const {
  return {std::llround(std::floor(position.x_m / radius_m_)),
          std::llround(std::floor(position.y_m / radius_m_))};
}

std::vector<ViewId> NeighbourSupport::neighbours(ViewId view) const {
  const ReferencePose* const pose = placed(view);
  if (pose == nullptr || sites_.empty()) return {};
  std::vector<std::pair<double, ViewId>> found;
  const auto [x, y] = cell_of(pose->position());
  for (std::int64_t cell_x = x - 1; cell_x <= x + 1; ++cell_x) {
    const auto in_column = [](const Site& s) { return std::pair(s.cell_x, s.cell_y); };
    const auto first = std::ranges::lower_bound(sites_, std::pair(cell_x, y - 1), {}, in_column);
    const auto end = std::ranges::upper_bound(sites_, std::pair(cell_x, y + 1), {}, in_column);
    for (auto site = first; site != end; ++site) {
      if (site->view == view) continue;
      const double distance_m = distance(placed(site->view)->position(), pose->position());
      if (distance_m <= radius_m_) found.emplace_back(distance_m, site->view);
    }
  }
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
  const ReferencePose* const pose = placed(match.match.view);
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
    fit.columns = column_distances_near(query, ranking_->profiles(view),
                                        heading_rad - *placed(view)->heading_rad);
    for (const double column : fit.columns) fit.difference += std::sqrt(column);
    fits.push_back(fit);
  }
  std::ranges::stable_sort(fits, {}, &Fit::difference);
  if (fits.size() > counted_views) fits.resize(counted_views);
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
  if (ranked.empty() || sites_.empty()) return;
  const double limit = max_score_ratio * ranked.front().score();
  const RankedMatch* chosen = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(max_examined, ranked.size()); ++i) {
    if (ranked[i].score() > limit) break;
    const auto difference = supported_difference(query, ranked[i], excluded);
    if (difference && ranked[i].score_of(*difference) < least) {
      least = ranked[i].score_of(*difference);
      chosen = &ranked[i];
    }
  }
  if (chosen == nullptr) return;
  std::vector<ViewId> group = neighbours(chosen->match.view);
  group.push_back(chosen->match.view);
  const double heading_rad = *placed(chosen->match.view)->heading_rad + chosen->columns.heading_rad;
  std::stable_partition(ranked.begin(), ranked.end(), [&](const RankedMatch& r) {
    if (std::ranges::find(group, r.match.view) == group.end()) return false;
    return std::abs(angle_difference(*placed(r.match.view)->heading_rad + r.columns.heading_rad,
                                     heading_rad)) <= heading_tolerance_rad;
  });
}

}  // namespace panonav
