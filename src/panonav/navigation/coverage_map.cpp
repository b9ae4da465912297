#include "panonav/navigation/coverage_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

// Cost of a metre through cells of which nothing is known, relative to known floor.
constexpr double unknown_cost_factor = 2.0;
// Weight of a frontier cell at the border of the frontier, relative to one within it: remnants that
// are left behind cost a second visit.
constexpr double border_weight = 6.0;
// Length added to that of a path, in catchment radii, so that a near position with little gain is
// not preferred to a far one with much.
constexpr double added_radii = 0.5;
// Smallest area of a connected frontier for each metre of the path to it (m2/m): a far remnant is
// not worth a visit, another room of which ranges show a part is.
constexpr double min_area_per_path_m = 0.08;
// Radius around a position from which no view was recognised, in catchment radii: half the distance
// between successive observations.
constexpr double unrecognised_radii = 0.3;

}  // namespace

/// Shortest paths from one cell.
struct CoverageMap::Paths {
  std::vector<double> length_m;
  std::vector<std::size_t> before;
};

CoverageMap::CoverageMap(const FloorObservations& floor, const CoverageOptions& options)
    : options_(options) {
  require(options.radius_m > 0.0, "radius_m", options.radius_m, "> 0");
  require(options.robot_radius_m >= 0.0, "robot_radius_m", options.robot_radius_m, ">= 0");
  require(options.cell_m > 0.0, "cell_m", options.cell_m, "> 0");
  require(options.min_area_m2 > 0.0, "min_area_m2", options.min_area_m2, "> 0");
  set_bounds(floor);
  for (const Point2& obstacle : floor.obstacles) {
    visit_disc(obstacle, options.robot_radius_m,
               [this](std::size_t cell) { flags_[cell] |= blocked_bit; });
  }
  mark_floor(floor);
  for (const Point2& position : floor.impassable) {
    visit_disc(position, 0.6 * options.cell_m,
               [this](std::size_t cell) { flags_[cell] |= blocked_bit; });
  }
  mark_covered(floor);
  for (const Point2& position : floor.given_up) {
    visit_disc(position, 0.5 * options.radius_m,
               [this](std::size_t cell) { flags_[cell] |= given_up_bit; });
  }
}

void CoverageMap::set_bounds(const FloorObservations& floor) {
  Point2 high{0.0, 0.0};
  const auto extend = [&](Point2 position) {
    low_ = {std::min(low_.x_m, position.x_m), std::min(low_.y_m, position.y_m)};
    high = {std::max(high.x_m, position.x_m), std::max(high.y_m, position.y_m)};
  };
  for (const auto* lines : {&floor.driven, &floor.open}) {
    for (const auto& line : *lines) {
      extend(line.from);
      extend(line.to);
    }
  }
  for (const auto& view : floor.views) extend(view.position);
  const double margin_m = options_.radius_m + options_.robot_radius_m + options_.assumed_open_m;
  // Whole cells keep the grid in place when it grows.
  const auto align = [&](double value) {
    return options_.cell_m * std::floor((value - margin_m) / options_.cell_m);
  };
  low_ = {align(low_.x_m), align(low_.y_m)};
  columns_ =
      static_cast<std::size_t>(std::ceil((high.x_m + margin_m - low_.x_m) / options_.cell_m)) + 1;
  rows_ =
      static_cast<std::size_t>(std::ceil((high.y_m + margin_m - low_.y_m) / options_.cell_m)) + 1;
  flags_.assign(columns_ * rows_, 0);
}

void CoverageMap::mark_floor(const FloorObservations& floor) {
  const auto mark = [this](std::size_t cell) { flags_[cell] |= floor_bit; };
  for (const auto& line : floor.driven) {
    visit_line(line, [&](Point2 position) {
      visit_disc(position, 0.75 * options_.cell_m, [this](std::size_t cell) {
        flags_[cell] = static_cast<std::uint8_t>((flags_[cell] & ~blocked_bit) | floor_bit);
      });
    });
  }
  // Beside an open line the robot has room unless an obstacle is known.
  for (const auto& line : floor.open) {
    visit_line(line, [&](Point2 position) { visit_disc(position, 1.5 * options_.cell_m, mark); });
  }
  if (options_.assumed_open_m <= 0.0) return;
  for (const auto& line : floor.driven) {
    visit_disc(line.to, options_.assumed_open_m, [&](std::size_t cell) {
      if ((flags_[cell] & floor_bit) == 0 && is_open_between(line.to, centre(cell))) mark(cell);
    });
  }
}

void CoverageMap::mark_covered(const FloorObservations& floor) {
  auto unrecognised = floor.unrecognised.begin();
  for (std::size_t i = 0; i <= floor.views.size(); ++i) {
    for (; unrecognised != floor.unrecognised.end() && unrecognised->view_count == i;
         ++unrecognised) {
      visit_disc(
          unrecognised->position, unrecognised_radii * options_.radius_m,
          [this](std::size_t cell) { flags_[cell] &= static_cast<std::uint8_t>(~covered_bit); });
    }
    if (i == floor.views.size()) break;
    const FloorObservations::View& view = floor.views[i];
    visit_disc(view.position, view.radius_m, [&](std::size_t cell) {
      if (is_open_between(view.position, centre(cell))) flags_[cell] |= covered_bit;
    });
  }
}

std::optional<std::size_t> CoverageMap::cell_at(Point2 position) const noexcept {
  const double i = std::floor((position.x_m - low_.x_m) / options_.cell_m);
  const double j = std::floor((position.y_m - low_.y_m) / options_.cell_m);
  if (!(i >= 0.0 && j >= 0.0 && i < static_cast<double>(columns_) &&
        j < static_cast<double>(rows_))) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(j) * columns_ + static_cast<std::size_t>(i);
}

Point2 CoverageMap::centre(std::size_t cell) const noexcept {
  return {low_.x_m + (static_cast<double>(cell % columns_) + 0.5) * options_.cell_m,
          low_.y_m + (static_cast<double>(cell / columns_) + 0.5) * options_.cell_m};
}

template <class Visit>
void CoverageMap::visit_disc(Point2 middle, double radius_m, const Visit& visit) const {
  const auto first = [&](double value, double low) {
    return static_cast<std::size_t>(
        std::max(0.0, std::floor((value - radius_m - low) / options_.cell_m)));
  };
  for (std::size_t j = first(middle.y_m, low_.y_m); j < rows_; ++j) {
    for (std::size_t i = first(middle.x_m, low_.x_m); i < columns_; ++i) {
      const std::size_t cell = j * columns_ + i;
      const Point2 there = centre(cell);
      if (there.x_m > middle.x_m + radius_m) break;
      if (distance(there, middle) <= radius_m) visit(cell);
    }
    if (low_.y_m + static_cast<double>(j) * options_.cell_m > middle.y_m + radius_m) break;
  }
}

template <class Visit>
void CoverageMap::visit_line(const FloorObservations::Line& line, const Visit& visit) const {
  const double length_m = distance(line.from, line.to);
  const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * length_m / options_.cell_m)));
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    visit(Point2{line.from.x_m + share * (line.to.x_m - line.from.x_m),
                 line.from.y_m + share * (line.to.y_m - line.from.y_m)});
  }
}

template <class Visit>
void CoverageMap::visit_frontiers_beside(std::size_t cell, const Visit& visit) const {
  for (const std::size_t beside : {cell - 1, cell + 1, cell - columns_, cell + columns_}) {
    if (beside < flags_.size() && is_frontier(beside)) visit(beside);
  }
}

bool CoverageMap::is_blocked(Point2 position) const noexcept {
  const auto cell = cell_at(position);
  return cell && (flags_[*cell] & blocked_bit) != 0;
}

bool CoverageMap::is_covered(Point2 position) const noexcept {
  const auto cell = cell_at(position);
  return cell && (flags_[*cell] & covered_bit) != 0;
}

bool CoverageMap::is_frontier(std::size_t cell) const noexcept {
  return (flags_[cell] & (blocked_bit | floor_bit | covered_bit | given_up_bit)) == floor_bit;
}

bool CoverageMap::is_frontier(Point2 position) const noexcept {
  const auto cell = cell_at(position);
  return cell && is_frontier(*cell);
}

bool CoverageMap::is_open_between(Point2 from, Point2 to) const noexcept {
  const double length_m = distance(from, to);
  const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * length_m / options_.cell_m)));
  for (int i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    if (is_blocked(
            {from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)})) {
      return false;
    }
  }
  return true;
}

CoverageMap::Areas CoverageMap::measure_areas() const noexcept {
  std::size_t floor = 0;
  std::size_t covered = 0;
  for (const std::uint8_t flags : flags_) {
    if ((flags & (blocked_bit | floor_bit)) != floor_bit) continue;
    ++floor;
    covered += (flags & covered_bit) != 0 ? 1 : 0;
  }
  const double cell_m2 = options_.cell_m * options_.cell_m;
  return {static_cast<double>(floor) * cell_m2, static_cast<double>(covered) * cell_m2};
}

double CoverageMap::compute_gain_m2(Point2 position) const {
  std::size_t cells = 0;
  visit_disc(position, options_.radius_m, [&](std::size_t cell) {
    if (is_frontier(cell) && is_open_between(position, centre(cell))) ++cells;
  });
  return static_cast<double>(cells) * options_.cell_m * options_.cell_m;
}

std::vector<double> CoverageMap::weigh_cells() const {
  std::vector<double> weights(flags_.size(), 0.0);
  for (std::size_t cell = 0; cell < flags_.size(); ++cell) {
    if (!is_frontier(cell)) continue;
    int others = 4;
    visit_frontiers_beside(cell, [&](std::size_t) { --others; });
    weights[cell] = 1.0 + border_weight * others / 4.0;
  }
  return weights;
}

std::vector<double> CoverageMap::measure_connected_frontiers() const {
  std::vector<double> areas_m2(flags_.size(), 0.0);
  const double cell_m2 = options_.cell_m * options_.cell_m;
  std::vector<std::size_t> connected;
  for (std::size_t first = 0; first < flags_.size(); ++first) {
    if (!is_frontier(first) || areas_m2[first] > 0.0) continue;
    connected.assign(1, first);
    areas_m2[first] = cell_m2;
    for (std::size_t i = 0; i < connected.size(); ++i) {
      visit_frontiers_beside(connected[i], [&](std::size_t beside) {
        if (areas_m2[beside] > 0.0) return;
        areas_m2[beside] = cell_m2;
        connected.push_back(beside);
      });
    }
    for (const std::size_t cell : connected) {
      areas_m2[cell] = static_cast<double>(connected.size()) * cell_m2;
    }
  }
  return areas_m2;
}

std::vector<double> CoverageMap::sum_in_squares(const std::vector<double>& weights) const {
  const std::size_t width = columns_ + 1;
  std::vector<double> sums(width * (rows_ + 1), 0.0);  // over the cells to the lower left
  for (std::size_t j = 0; j < rows_; ++j) {
    for (std::size_t i = 0; i < columns_; ++i) {
      sums[(j + 1) * width + i + 1] = weights[j * columns_ + i] + sums[j * width + i + 1] +
                                      sums[(j + 1) * width + i] - sums[j * width + i];
    }
  }
  const auto reach = static_cast<std::size_t>(std::ceil(options_.radius_m / options_.cell_m));
  std::vector<double> squares(weights.size());
  for (std::size_t j = 0; j < rows_; ++j) {
    const std::size_t low = (j < reach ? 0 : j - reach) * width;
    const std::size_t high = std::min(rows_, j + reach + 1) * width;
    for (std::size_t i = 0; i < columns_; ++i) {
      const std::size_t left = i < reach ? 0 : i - reach;
      const std::size_t right = std::min(columns_, i + reach + 1);
      squares[j * columns_ + i] =
          sums[high + right] - sums[low + right] - sums[high + left] + sums[low + left];
    }
  }
  return squares;
}

std::optional<std::size_t> CoverageMap::find_passable_cell_near(Point2 position) const {
  std::optional<std::size_t> nearest;
  double nearest_m = std::numeric_limits<double>::infinity();
  visit_disc(position, options_.robot_radius_m + options_.cell_m, [&](std::size_t cell) {
    const double away_m = distance(centre(cell), position);
    if ((flags_[cell] & blocked_bit) != 0 || away_m >= nearest_m) return;
    nearest = cell;
    nearest_m = away_m;
  });
  return nearest;
}

CoverageMap::Paths CoverageMap::find_paths(Point2 from) const {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Paths paths{std::vector<double>(flags_.size(), infinite),
              std::vector<std::size_t>(flags_.size(), flags_.size())};
  const auto start = find_passable_cell_near(from);
  if (!start) return paths;
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  paths.length_m[*start] = distance(from, centre(*start));
  open.emplace(paths.length_m[*start], *start);
  while (!open.empty()) {
    const auto [length_m, cell] = open.top();
    open.pop();
    if (length_m > paths.length_m[cell]) continue;
    const auto i = static_cast<int>(cell % columns_);
    const auto j = static_cast<int>(cell / columns_);
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        if (i + di < 0 || j + dj < 0 || i + di >= static_cast<int>(columns_) ||
            j + dj >= static_cast<int>(rows_)) {
          continue;
        }
        const std::size_t next =
            static_cast<std::size_t>(j + dj) * columns_ + static_cast<std::size_t>(i + di);
        if ((flags_[next] & blocked_bit) != 0) continue;
        const double factor = (flags_[next] & floor_bit) != 0 ? 1.0 : unknown_cost_factor;
        const double there_m = length_m + factor * options_.cell_m * std::hypot(di, dj);
        if (there_m >= paths.length_m[next]) continue;
        paths.length_m[next] = there_m;
        paths.before[next] = cell;
        open.emplace(there_m, next);
      }
    }
  }
  return paths;
}

std::vector<Point2> CoverageMap::trace_path(const Paths& paths, std::size_t end) const {
  std::vector<Point2> path;
  for (std::size_t cell = end; cell < flags_.size(); cell = paths.before[cell]) {
    path.push_back(centre(cell));
  }
  std::ranges::reverse(path);
  return path;
}

std::optional<CoverageMap::ViewPoint> CoverageMap::find_view_point(Point2 robot,
                                                                   double covered_share) const {
  const Paths paths = find_paths(robot);
  const std::vector<double> weights = weigh_cells();
  const std::vector<double> squares = sum_in_squares(weights);
  const double added_m = added_radii * options_.radius_m;
  const std::vector<double> connected_m2 = measure_connected_frontiers();
  // Bounds of the scores: the highest first, so that few need the lines of sight.
  std::vector<std::pair<double, std::size_t>> candidates;
  for (std::size_t cell = 0; cell < flags_.size(); ++cell) {
    const bool is_candidate = (flags_[cell] & (floor_bit | given_up_bit)) == floor_bit &&
                              std::isfinite(paths.length_m[cell]) && squares[cell] > 0.0;
    if (is_candidate) {
      candidates.emplace_back(-squares[cell] / (paths.length_m[cell] + added_m), cell);
    }
  }
  std::ranges::sort(candidates);
  double best_score = 0.0;
  std::optional<ViewPoint> best;
  for (const auto& [negative_bound, cell] : candidates) {
    if (-negative_bound <= best_score) break;
    const Point2 position = centre(cell);
    double weight = 0.0;
    double frontier_m2 = 0.0;
    std::size_t cells = 0;
    visit_disc(position, options_.radius_m, [&](std::size_t there) {
      if (weights[there] == 0.0 || !is_open_between(position, centre(there))) return;
      weight += weights[there];
      frontier_m2 = std::max(frontier_m2, connected_m2[there]);
      ++cells;
    });
    const double area_m2 = static_cast<double>(cells) * options_.cell_m * options_.cell_m;
    const double score = weight / (paths.length_m[cell] + added_m);
    if (area_m2 < options_.min_area_m2 || score <= best_score) continue;
    if (covered_share * frontier_m2 < min_area_per_path_m * paths.length_m[cell]) continue;
    best_score = score;
    best = ViewPoint{position, area_m2, paths.length_m[cell], trace_path(paths, cell)};
  }
  return best;
}

std::optional<std::vector<Point2>> CoverageMap::find_path(Point2 from, Point2 to) const {
  const Paths paths = find_paths(from);
  const auto end = find_passable_cell_near(to);
  if (!end || !std::isfinite(paths.length_m[*end])) return std::nullopt;
  return trace_path(paths, *end);
}

}  // namespace panonav
