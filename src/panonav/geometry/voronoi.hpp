#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Computes the signed area of a simple polygon, positive if its corners run counter-clockwise; 0
/// with fewer than three corners.
[[nodiscard]] double polygon_area_m2(std::span<const Point2> corners);

/// A circle in the plane; for an empty set of points, radius 0 at the origin.
struct Circle {
  Point2 centre;          ///< in the frame of the points
  double radius_m = 0.0;  ///< 0 for one point
};

/// Computes the smallest circle that contains all points (Welzl 1991, in a fixed pseudo-random
/// order). Expected cost: O(n).
[[nodiscard]] Circle smallest_enclosing_circle(std::span<const Point2> points);

/// Voronoi cells of positions, clipped at half the spacing [M04 figures 9 and 10].
///
/// Positions that coincide share one site. A cell is the part of the plane that is nearer to its
/// site than to any other, clipped to a square of side `spacing_m` around the site that is
/// aligned with the direction to the nearest other site. In a square grid of that spacing every
/// cell therefore has the area spacing^2, also at the border and for any rotation of the grid;
/// along a path, cells form a strip as wide as the spacing. Cells do not overlap, so the area of a
/// set of sites is the sum of their cells' areas.
class VoronoiCells {
 public:
  /// Default of `spacing_m`: the (lower) median over all sites of the distance to the
  /// second-nearest other site (to the other one if there are only two), which is the step of a
  /// square grid, or the distance between images along a path. A single site has no spacing, and
  /// then an empty cell. Throws ContractError on a position that is not finite or a spacing that is
  /// not > 0. Cost O(n log n) and, for n positions in a square, O(n sqrt(n)) small steps.
  explicit VoronoiCells(std::span<const Point2> positions,
                        std::optional<double> spacing_m = std::nullopt);

  /// Side of the clipping squares; 0 if there are fewer than two sites and no `spacing_m` was
  /// given.
  [[nodiscard]] double spacing_m() const noexcept { return spacing_m_; }
  /// Distinct positions, in the order of their first appearance.
  [[nodiscard]] std::span<const Point2> sites() const& noexcept { return sites_; }
  std::span<const Point2> sites() const&& = delete;  // would dangle
  /// Index of the site of each position.
  [[nodiscard]] std::span<const std::size_t> site_of() const& noexcept { return site_of_; }
  std::span<const std::size_t> site_of() const&& = delete;  // would dangle
  /// Corners of a cell, counter-clockwise. Throws ContractError when there is no such site.
  [[nodiscard]] std::vector<Point2> cell(std::size_t site) const;
  /// Area of that cell, 0 where it is empty. Throws as `cell`.
  [[nodiscard]] double area_m2(std::size_t site) const;

 private:
  // Sets sites_ and site_of_.
  void merge_positions(std::span<const Point2> positions);
  // Sets sweeps_along_x_, sites_by_sweep_ and sweep_rank_.
  void sort_sites();
  // Returns the median distance to the second-nearest other site; 0 with fewer than two sites.
  [[nodiscard]] double median_spacing_m() const;
  template <class Visit>
  void visit_sites_within(std::size_t site, double radius_m, const Visit& visit) const;
  [[nodiscard]] double sweep_coordinate(Point2 p) const noexcept {
    return sweeps_along_x_ ? p.x_m : p.y_m;
  }

  std::vector<Point2> sites_;
  std::vector<std::size_t> site_of_;
  bool sweeps_along_x_ = true;               // sites are sorted along the longer side of their box
  std::vector<std::size_t> sites_by_sweep_;  // sites sorted along that axis
  std::vector<std::size_t> sweep_rank_;      // index of each site in `sites_by_sweep_`
  double spacing_m_ = 0.0;
};

}  // namespace panonav
