#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/camera/internal/edge_field.hpp"

namespace panonav {

/// A circle on the plane of an EdgeField or of SmoothPlanes, in their pixels (centres at + 0.5).
struct FieldCircle {
  double u = 0.0;
  double v = 0.0;
  double radius = 0.0;
};

/// Rule by which the edge around a circle is summed.
enum class Evenness {
  mean,  ///< the plain mean: long gaps are expected
  even,  ///< square of the mean root over 12 sectors: an edge all around counts more than the same
         ///< amount of edge on one strong arc
};

struct CircleScore {
  /// Over the visible circumference, of w cos(2 d), w the weight of the edge there and d the angle
  /// between its gradient and the radius: about 0 for any circle in an image without circles,
  /// towards 1 for a sharp edge all around.
  double quality = 0.0;
  double visible = 0.0;  ///< part of the circumference inside the frame
};

/// Scores a circle on about one sample for each 3 px of circumference, 48 to 720.
[[nodiscard]] CircleScore score_circle(const EdgeField& field, const FieldCircle& circle,
                                       Evenness evenness);

struct CircleRange {
  double lowest_radius = 0.0;
  double highest_radius = 0.0;
  double visible_fraction = 0.5;
  Evenness evenness = Evenness::even;
};

/// Scores all centres (a grid of the field's pixels) and radii. Returns the local maxima, best
/// first, at most `count`. Meant for small fields: the cost is pixels * radii * 96.
[[nodiscard]] std::vector<FieldCircle> circle_candidates(const EdgeField& field,
                                                         const CircleRange& range, int count);

/// Finds circles about nearly one centre: for each radius of the range in steps of `step`, the best
/// centre within `centre_reach` * radius of (u, v); of those the local maxima over the radius, by
/// ascending radius.
[[nodiscard]] std::vector<FieldCircle> concentric_candidates(const EdgeField& field, double u,
                                                             double v, double centre_reach,
                                                             const CircleRange& range, double step);

/// Climbs from a circle to the nearest maximum of quality * sqrt(visible), steps 2 px down to 1/4
/// px.
[[nodiscard]] FieldCircle climb_to_maximum(const EdgeField& field, const FieldCircle& start,
                                           const CircleRange& range);

/// Distance within which an edge belongs to a fitted circle: the allowance for blur and a rim that
/// is not quite round.
[[nodiscard]] double fit_tolerance(double radius);

struct CircleFit {
  FieldCircle circle;
  double residual = 0.0;  ///< root mean square over the points used
  /// Part of the visible circumference that has its edge within `fit_tolerance` of the circle.
  double support = 0.0;
};

/// Fits a circle to the edge points near `start`, to a fraction of a pixel: along each radius the
/// strongest edge (mean over the images), then least squares of the distances with Tukey's weights,
/// in a window that narrows. Empty when fewer than a quarter of the visible circumference has an
/// edge, or the fit leaves the window.
[[nodiscard]] std::optional<CircleFit> fit_circle(std::span<const SmoothPlanes> images,
                                                  const FieldCircle& start);

}  // namespace panonav
