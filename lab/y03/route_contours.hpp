#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/least_squares.hpp"
#include "panonav/route/route_crossing.hpp"
#include "panonav/route/route_panorama.hpp"

namespace panonav::lab {

/// Distance of both initial contours from the prediction: Delta_ACM [Y03 eq. 6].
inline constexpr double default_contour_margin_m = 0.14;

/// A control point of an active contour in the route panorama.
struct ContourPoint {
  double azimuth = 0.0;  ///< column in the world's frame
  double along = 0.0;    ///< line number, with fraction
};

/// The converged contours, and the pose that fits them.
struct RouteContourFix {
  Pose2 pose;  ///< in the route's frame, by least squares over both contours
  std::array<double, 9> covariance{};  ///< of x, y and heading; row-major
  double residual_m = 0.0;             ///< robust rms between contours and eq. 5, along the path
  bool converged = false;              ///< contours met at 4 of 5 control points
  int iterations = 0;                  ///< moves of the contours until both stopped
  std::vector<int> columns;            ///< of the line, one per control point
  std::vector<ContourPoint> first;     ///< the contour that started farther along the route
  std::vector<ContourPoint> second;    ///< the contour that started nearer to the route's start
};

/// A route panorama prepared for localisation by active contours.
class RouteContours {
 public:
  /// Throws ContractError on a route of fewer than two lines, and unless margin_m > 0.
  explicit RouteContours(const RoutePanorama& route, double margin_m = default_contour_margin_m);

  /// Localises a line. Two contours start `margin_m` ahead of and behind the curve that eq. 5
  /// predicts. Dynamic programming moves each control point to one of its eight neighbours or
  /// leaves it, and the contours attract each other until they meet; the least squares fit of eq. 5
  /// to the control points gives the pose [Y03 section 4]. Control points are at edges of the line,
  /// except within 10 degrees of the path's direction, where eq. 5 has poles. Returns nullopt with
  /// fewer than eight control points, or if the path is out of reach. Throws ContractError on a
  /// wrong length of the line.
  [[nodiscard]] std::optional<RouteContourFix> fit(std::span<const float> line,
                                                   const Pose2& predicted) const;

 private:
  struct Term;
  [[nodiscard]] float edge(double along, double azimuth) const noexcept;
  void move(std::vector<ContourPoint>& contour, const std::vector<ContourPoint>& other,
            const std::vector<int>& columns, std::span<const float> edges,
            const std::vector<bool>& joined, double step) const;
  [[nodiscard]] std::vector<RouteCrossing> predict_curve(Point2 viewpoint) const;
  [[nodiscard]] double pair_energy(const ContourPoint& before, const ContourPoint& at,
                                   double interval, bool joined, double next_slope) const;
  [[nodiscard]] RouteContourFix initialise_contours(std::span<const float> edges,
                                                    const Pose2& predicted,
                                                    std::vector<bool>& joined) const;
  void converge(RouteContourFix& fix, std::span<const float> edges,
                const std::vector<bool>& joined) const;
  [[nodiscard]] std::vector<Term> make_path_terms(const RouteContourFix& fix) const;
  void add_heading_terms(const RouteContourFix& fix, std::vector<Term>& terms) const;
  [[nodiscard]] bool fill_weighted_equations(const std::vector<Term>& terms,
                                             std::size_t along_terms, RouteContourFix& fix,
                                             DenseEquations<3>& equations) const;
  bool fit_pose(RouteContourFix& fix) const;

  int columns_;
  double margin_m_;
  std::vector<Pose2> poses_;
  std::vector<Direction2> directions_;
  double spacing_m_;
  std::vector<float> edges_;  // slope of brightness over azimuth, line by line
};

}  // namespace panonav::lab
