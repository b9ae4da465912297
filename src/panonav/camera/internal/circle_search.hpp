#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/camera/internal/edge_field.hpp"

namespace panonav {

/// A circle in the pixel coordinates of an EdgeField or of SmoothPlanes; the centre of pixel (u, v)
/// is (u + 0.5, v + 0.5).
struct FieldCircle {
  double u = 0.0;
  double v = 0.0;
  double radius = 0.0;
};

/// Rule by which edge strength is averaged around a circle.
enum class EdgeAveraging {
  mean,  ///< the plain mean, for circles with long gaps
  even,  ///< square of the mean root over 12 sectors: an edge all around counts more than the same
         ///< amount of edge on one strong arc
};

struct CircleScore {
  /// Average over the visible circumference of w cos(2 d), where w is the weight of the edge and d
  /// the angle between its gradient and the radius: about 0 for circles without edges along them,
  /// near 1 for a sharp edge all around.
  double quality = 0.0;
  double visible = 0.0;  ///< part of the circumference inside the frame
};

/// Scores a circle from one sample per 3 px of circumference, 48 to 720 in all.
[[nodiscard]] CircleScore score_circle(const EdgeField& field, const FieldCircle& circle,
                                       EdgeAveraging averaging);

struct CircleRange {
  double min_radius = 0.0;
  double max_radius = 0.0;
  double visible_fraction = 0.5;
  EdgeAveraging averaging = EdgeAveraging::even;
};

/// Scores all centres (a grid of the field's pixels) and radii. Returns the local maxima, best
/// first, at most `count`. Meant for small fields: the cost is pixels * radii * 96.
[[nodiscard]] std::vector<FieldCircle> circle_candidates(const EdgeField& field,
                                                         const CircleRange& range, int count);

/// Finds circles with nearly the same centre: for each radius of the range, in steps of `step`,
/// tries the centres within +- `centre_reach` px of (u, v) and keeps the best. Returns the local
/// maxima over the radius, in ascending order.
[[nodiscard]] std::vector<FieldCircle> concentric_candidates(const EdgeField& field, double u,
                                                             double v, double centre_reach,
                                                             const CircleRange& range, double step);

/// Improves a circle by hill climbing to a local maximum of quality * sqrt(visible), in steps from
/// 2 px down to 1/4 px.
[[nodiscard]] FieldCircle climb_to_maximum(const EdgeField& field, const FieldCircle& start,
                                           const CircleRange& range);

/// Returns the largest distance, in px, of an edge from the circle to which it belongs; allows for
/// blur and a rim that is not perfectly round.
[[nodiscard]] double fit_tolerance_px(double radius);

struct CircleFit {
  FieldCircle circle;
  double residual = 0.0;  ///< root mean square over the points used
  /// Share of the visible circumference that has an edge within `fit_tolerance_px` of the circle.
  double support = 0.0;
};

/// Fits a circle to the edge points near `start`, to a fraction of a pixel: finds the strongest
/// edge along each radius (averaged over the images), fits them by least squares with Tukey
/// weights, and repeats in a narrower window. nullopt if less than a quarter of the visible
/// circumference has an edge, or the circle moves too far from `start`.
[[nodiscard]] std::optional<CircleFit> fit_circle(std::span<const SmoothPlanes> images,
                                                  const FieldCircle& start);

}  // namespace panonav
