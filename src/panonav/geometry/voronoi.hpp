#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Area of a simple polygon, positive when its corners run counter-clockwise; 0 below three
/// corners.
[[nodiscard]] double polygon_area_m2(std::span<const Point2> corners);

/// A circle in the plane; of all points of a set, or of none (radius 0 at the origin).
struct Circle {
  Point2 centre;          ///< in the frame of the points
  double radius_m = 0.0;  ///< 0 for one point
};

/// The smallest circle that covers all points. It never grows when points are taken away. Cost O(n)
/// expected (Welzl 1991, with a fixed order of visiting).
[[nodiscard]] Circle smallest_enclosing_circle(std::span<const Point2> points);

/// Voronoi cells of positions, clipped at half the spacing [M04 figures 9 and 10].
///
/// Positions that coincide share one site. A cell is the part of the plane that is nearer to its
/// site than to any other, cut by a square of side `spacing_m` around the site, aligned with the
/// direction to the nearest other site. So every cell of a square grid of that spacing has the area
/// spacing^2, also on the border and however the grid is rotated; a cell along a path is a strip as
/// wide as the spacing; a lone site gets the square. Cells do not overlap: the area of a set of
/// sites is the sum of their areas.
class VoronoiCells {
 public:
  /// `spacing_m` left out: the (lower) median over sites of the distance to the second-nearest
  /// other site (of the only other one when there are two), which is the grid's step for a square
  /// grid and the distance between images along a path. One site alone has no spacing: its cell is
  /// empty. Throws ContractError on a position that is not finite or a spacing that is not > 0.
  /// Cost O(n log n) and, for n positions in a square, O(n sqrt(n)) small steps.
  explicit VoronoiCells(std::span<const Point2> positions,
                        std::optional<double> spacing_m = std::nullopt);

  /// Side of the clipping squares; 0 when there are fewer than two sites and none was stated.
  [[nodiscard]] double spacing_m() const noexcept { return spacing_m_; }
  /// Distinct positions, in the order of their first appearance.
  [[nodiscard]] std::span<const Point2> sites() const& noexcept { return sites_; }
  std::span<const Point2> sites() const&& = delete;  // would dangle
  /// The site of every position.
  [[nodiscard]] std::span<const std::size_t> site_of() const& noexcept { return site_of_; }
  std::span<const std::size_t> site_of() const&& = delete;  // would dangle
  /// Corners of a cell, counter-clockwise. Throws ContractError when there is no such site.
  [[nodiscard]] std::vector<Point2> cell(std::size_t site) const;
  /// Area of that cell, 0 where it is empty. Throws as `cell`.
  [[nodiscard]] double area_m2(std::size_t site) const;

 private:
  // Sets sites_ and site_of_.
  void merge_positions(std::span<const Point2> positions);
  // Sets sweep_x_, by_sweep_ and rank_.
  void sort_sites();
  // The median distance to the second-nearest other site; 0 below two sites.
  [[nodiscard]] double median_spacing_m() const;
  template <class Visit>
  void visit_sites_within(std::size_t site, double radius_m, const Visit& visit) const;
  [[nodiscard]] double sweep_coordinate(Point2 p) const noexcept {
    return sweep_x_ ? p.x_m : p.y_m;
  }

  std::vector<Point2> sites_;
  std::vector<std::size_t> site_of_;
  bool sweep_x_ = true;                // sites are sorted along the longer side of their box
  std::vector<std::size_t> by_sweep_;  // sites in that order
  std::vector<std::size_t> rank_;      // the place of each site in `by_sweep_`
  double spacing_m_ = 0.0;
};

}  // namespace panonav
