#pragma once

#include <span>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// A map of one point set onto another: to ~ scale * R(rotation) * from + translation, with
/// a mirror image first (y -> -y) when `reflected`.
struct Alignment {
  /// Freedoms of the fit beyond rotation and translation.
  struct Options {
    bool allow_scale = false;       ///< the unit of length of `from` is free
    bool allow_reflection = false;  ///< a mirror image is taken where it fits better
  };
  /// Metres of `to` for each unit of `from`; 1 unless the scale was free.
  double scale = 1.0;
  double rotation_rad = 0.0;  ///< counter-clockwise, in [-pi, pi]
  Point2 translation;         ///< added after rotation and scale, in the frame of `to`
  bool reflected = false;     ///< whether y changes its sign first
  double rms_m = 0.0;         ///< root mean square distance that remains

  /// Maps a point of the frame of `from` into that of `to`.
  [[nodiscard]] Point2 apply(Point2 p_in_from) const;
};

/// Least-squares alignment (Procrustes, Umeyama 1991). Throws ContractError unless both sets have
/// the same size >= 1. Coincident points align by translation alone.
[[nodiscard]] Alignment align(std::span<const Point2> from, std::span<const Point2> to,
                              const Alignment::Options& options = {});

/// Procrustes disparity of two shapes, the "shape difference" mu that [F11 section 4] names but
/// does not print: how much they differ after the best translation, rotation and scale. mu = 1 -
/// (s_1 + d s_2)^2 with s the singular values of the product of the two centred, unit-norm sets,
/// and d = +-1 such that the rotation is proper.
struct ShapeDifference {
  double value = 0.0;            ///< 0 (same shape) .. 1
  double with_reflection = 0.0;  ///< the same when a mirror image is allowed
};

/// Computes the disparity. Throws ContractError unless both sets have the same size >= 2 and
/// neither is a single point.
[[nodiscard]] ShapeDifference shape_difference(std::span<const Point2> a,
                                               std::span<const Point2> b);

}  // namespace panonav
