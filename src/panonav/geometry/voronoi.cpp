#include "panonav/geometry/voronoi.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Clips a convex polygon to the half-plane normal . p <= offset.
std::vector<Point2> clip_to_half_plane(const std::vector<Point2>& polygon, Point2 normal,
                                       double offset) {
  std::vector<Point2> kept;
  kept.reserve(polygon.size() + 1);
  const auto excess = [&](Point2 p) { return normal.x_m * p.x_m + normal.y_m * p.y_m - offset; };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2 a = polygon[i];
    const Point2 b = polygon[(i + 1) % polygon.size()];
    const double ea = excess(a);
    const double eb = excess(b);
    if (ea <= 0.0) kept.push_back(a);
    if ((ea < 0.0 && eb > 0.0) || (ea > 0.0 && eb < 0.0)) {
      const double t = ea / (ea - eb);
      kept.push_back({a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m)});
    }
  }
  return kept;
}

bool is_inside(const Circle& circle, Point2 p) {
  return distance(circle.centre, p) <= circle.radius_m * (1.0 + 1e-12) + 1e-15;
}

Circle make_circle_through(Point2 a, Point2 b) {
  const Point2 centre{0.5 * (a.x_m + b.x_m), 0.5 * (a.y_m + b.y_m)};
  return {centre, std::max(distance(centre, a), distance(centre, b))};
}

Circle make_circle_through(Point2 a, Point2 b, Point2 c) {
  const double bx = b.x_m - a.x_m;
  const double by = b.y_m - a.y_m;
  const double cx = c.x_m - a.x_m;
  const double cy = c.y_m - a.y_m;
  const double d = 2.0 * (bx * cy - by * cx);
  Circle best{{}, infinity};
  if (d != 0.0) {
    const double b2 = bx * bx + by * by;
    const double c2 = cx * cx + cy * cy;
    const Point2 centre{a.x_m + (cy * b2 - by * c2) / d, a.y_m + (bx * c2 - cx * b2) / d};
    best = {centre, std::max({distance(centre, a), distance(centre, b), distance(centre, c)})};
  }
  if (std::isfinite(best.radius_m)) return best;
  // If the three points are collinear, two of them span the smallest circle.
  for (const Circle& pair :
       {make_circle_through(a, b), make_circle_through(a, c), make_circle_through(b, c)}) {
    if (is_inside(pair, a) && is_inside(pair, b) && is_inside(pair, c)) return pair;
  }
  return make_circle_through(a, b);
}

}  // namespace

double polygon_area_m2(std::span<const Point2> corners) {
  if (corners.size() < 3) return 0.0;
  double twice = 0.0;
  // Uses coordinates relative to the first corner, so that polygons far from the origin lose no
  // precision.
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    twice += (corners[i].x_m - corners[0].x_m) * (corners[i + 1].y_m - corners[0].y_m) -
             (corners[i + 1].x_m - corners[0].x_m) * (corners[i].y_m - corners[0].y_m);
  }
  return 0.5 * twice;
}

Circle smallest_enclosing_circle(std::span<const Point2> points) {
  if (points.empty()) return {};
  std::vector<Point2> order(points.begin(), points.end());
  Random random(
      0);  // any fixed order gives the same circle; a shuffled one gives it in linear time
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.index(i)]);
  Circle circle{order[0], 0.0};
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (is_inside(circle, order[i])) continue;
    circle = {order[i], 0.0};
    for (std::size_t j = 0; j < i; ++j) {
      if (is_inside(circle, order[j])) continue;
      circle = make_circle_through(order[i], order[j]);
      for (std::size_t k = 0; k < j; ++k) {
        if (!is_inside(circle, order[k]))
          circle = make_circle_through(order[i], order[j], order[k]);
      }
    }
  }
  return circle;
}

VoronoiCells::VoronoiCells(std::span<const Point2> positions, std::optional<double> spacing_m) {
  if (spacing_m) require(*spacing_m > 0.0 && *spacing_m < infinity, "spacing_m", *spacing_m, "> 0");
  for (const Point2 p : positions) {
    require(std::isfinite(p.x_m), "x_m of a position", p.x_m, "any finite number");
    require(std::isfinite(p.y_m), "y_m of a position", p.y_m, "any finite number");
  }
  merge_positions(positions);
  sort_sites();
  spacing_m_ = spacing_m ? *spacing_m : median_spacing_m();
}

void VoronoiCells::merge_positions(std::span<const Point2> positions) {
  // Sorts equal positions next to each other; the first of them in the input order defines the
  // site.
  std::vector<std::size_t> order(positions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Point2 p = positions[a];
    const Point2 q = positions[b];
    if (p.x_m != q.x_m) return p.x_m < q.x_m;
    if (p.y_m != q.y_m) return p.y_m < q.y_m;
    return a < b;
  });
  std::vector<std::size_t> first_equal(positions.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && positions[order[i]] == positions[order[i - 1]];
    first_equal[order[i]] = same ? first_equal[order[i - 1]] : order[i];
  }
  site_of_.resize(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (first_equal[i] == i) {
      site_of_[i] = sites_.size();
      sites_.push_back(positions[i]);
    } else {
      site_of_[i] = site_of_[first_equal[i]];
    }
  }
}

void VoronoiCells::sort_sites() {
  if (!sites_.empty()) {
    Point2 low = sites_[0];
    Point2 high = sites_[0];
    for (const Point2 p : sites_) {
      low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
      high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
    }
    sweeps_along_x_ = high.x_m - low.x_m >= high.y_m - low.y_m;
  }
  sites_by_sweep_.resize(sites_.size());
  std::iota(sites_by_sweep_.begin(), sites_by_sweep_.end(), std::size_t{0});
  std::sort(sites_by_sweep_.begin(), sites_by_sweep_.end(), [this](std::size_t a, std::size_t b) {
    return std::pair(sweep_coordinate(sites_[a]), a) < std::pair(sweep_coordinate(sites_[b]), b);
  });
  sweep_rank_.resize(sites_.size());
  for (std::size_t i = 0; i < sites_by_sweep_.size(); ++i) sweep_rank_[sites_by_sweep_[i]] = i;
}

double VoronoiCells::median_spacing_m() const {
  if (sites_.size() < 2) return 0.0;
  std::vector<double> second(sites_.size());
  for (std::size_t site = 0; site < sites_.size(); ++site) {
    std::array<double, 2> nearest = {infinity, infinity};
    const auto consider = [&](std::size_t other) {
      const double d = distance(sites_[site], sites_[other]);
      if (d < nearest[0]) {
        nearest = {d, nearest[0]};
      } else if (d < nearest[1]) {
        nearest[1] = d;
      }
    };
    const double here = sweep_coordinate(sites_[site]);
    std::size_t below = sweep_rank_[site];
    std::size_t above = sweep_rank_[site] + 1;
    // Searches outwards on both sides until no further site can be nearer than the
    // second-nearest so far.
    while (below > 0 && here - sweep_coordinate(sites_[sites_by_sweep_[below - 1]]) < nearest[1]) {
      consider(sites_by_sweep_[--below]);
      if (above < sites_.size()) consider(sites_by_sweep_[above++]);
    }
    while (above < sites_.size() &&
           sweep_coordinate(sites_[sites_by_sweep_[above]]) - here < nearest[1]) {
      consider(sites_by_sweep_[above++]);
    }
    second[site] = std::isfinite(nearest[1]) ? nearest[1] : nearest[0];
  }
  return order_statistic(std::move(second), 0.5);
}

template <class Visit>
void VoronoiCells::visit_sites_within(std::size_t site, double radius_m, const Visit& visit) const {
  const double here = sweep_coordinate(sites_[site]);
  for (std::size_t i = sweep_rank_[site]; i-- > 0;) {
    if (here - sweep_coordinate(sites_[sites_by_sweep_[i]]) > radius_m) break;
    visit(sites_by_sweep_[i]);
  }
  for (std::size_t i = sweep_rank_[site] + 1; i < sites_by_sweep_.size(); ++i) {
    if (sweep_coordinate(sites_[sites_by_sweep_[i]]) - here > radius_m) break;
    visit(sites_by_sweep_[i]);
  }
}

std::vector<Point2> VoronoiCells::cell(std::size_t site) const {
  require(site < sites_.size(), "site", static_cast<double>(site),
          "0 .. " + to_text(static_cast<double>(sites_.size()) - 1.0));
  if (spacing_m_ == 0.0) return {};
  // Only sites within the diagonal of the clipping square can cut it.
  const double reach_m = spacing_m_ * std::sqrt(2.0);
  const Point2 here = sites_[site];
  std::vector<std::pair<double, Point2>> near;  // distance and offset of the other sites
  visit_sites_within(site, reach_m, [&](std::size_t other) {
    const double d = distance(here, sites_[other]);
    if (d <= reach_m) {
      near.emplace_back(d, Point2{sites_[other].x_m - here.x_m, sites_[other].y_m - here.y_m});
    }
  });
  std::sort(near.begin(), near.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first, a.second.x_m, a.second.y_m) <
           std::tie(b.first, b.second.x_m, b.second.y_m);
  });
  const Point2 axis =
      near.empty() ? Point2{1.0, 0.0}
                   : Point2{near[0].second.x_m / near[0].first, near[0].second.y_m / near[0].first};
  const double h = 0.5 * spacing_m_;
  std::vector<Point2> polygon;
  for (const auto& [u, v] :
       {std::pair(-h, -h), std::pair(h, -h), std::pair(h, h), std::pair(-h, h)}) {
    polygon.push_back({u * axis.x_m - v * axis.y_m, u * axis.y_m + v * axis.x_m});
  }
  for (const auto& [d, offset] : near) polygon = clip_to_half_plane(polygon, offset, 0.5 * d * d);
  for (Point2& corner : polygon) corner = {corner.x_m + here.x_m, corner.y_m + here.y_m};
  return polygon;
}

double VoronoiCells::area_m2(std::size_t site) const {
  return polygon_area_m2(cell(site));
}

}  // namespace panonav
