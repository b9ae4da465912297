#pragma once

#include <span>

#include "panonav/geometry/pose3.hpp"

namespace panonav {

/// A similarity transform that maps one point set onto another: to ~ scale * R(rotation) * from +
/// translation; if `reflected`, y of `from` changes its sign first.
struct Alignment {
  /// Freedoms of the fit beyond rotation and translation.
  struct Options {
    bool allow_scale = false;       ///< also fit the scale
    bool allow_reflection = false;  ///< mirror `from` if this fits better
  };
  /// Metres in `to` per unit of length in `from`; 1 unless `allow_scale`.
  double scale = 1.0;
  double rotation_rad = 0.0;  ///< counter-clockwise, in [-pi, pi]
  Point2 translation;         ///< added after rotation and scale, in the frame of `to`
  bool reflected = false;     ///< whether y changes its sign first
  double rms_m = 0.0;         ///< root mean square distance that remains

  /// Maps a point of the frame of `from` into that of `to`.
  [[nodiscard]] Point2 apply(Point2 p_in_from) const;
};

/// Computes the least-squares alignment (Procrustes, Umeyama 1991). Throws ContractError unless
/// both sets have the same size >= 1. Coincident points align by translation alone.
[[nodiscard]] Alignment align(std::span<const Point2> from, std::span<const Point2> to,
                              const Alignment::Options& options = {});

/// A similarity transform in space: to ~ scale * rotation * from + translation; if `reflected`, y
/// of `from` changes its sign first.
struct Alignment3 {
  double scale = 1.0;      ///< metres in `to` per unit of length in `from`
  Rotation3 rotation;      ///< to_from_from
  Point3 translation;      ///< added after rotation and scale, in the frame of `to`
  bool reflected = false;  ///< whether y changes its sign first
  /// False if the points lie on a straight line or in one place: then other rotations align them
  /// equally well, and `rotation` is the smallest.
  bool is_unique = true;

  /// Maps a point of the frame of `from` into that of `to`.
  [[nodiscard]] Point3 apply(Point3 p_in_from) const;
  /// Maps a pose; a reflection mirrors its orientation.
  [[nodiscard]] Pose3 apply(const Pose3& pose_in_from) const;
};

/// Computes the least-squares alignment in space (Umeyama 1991, eq. 34-43). Throws ContractError
/// unless both sets have the same size >= 1.
[[nodiscard]] Alignment3 align_in_space(std::span<const Point3> from, std::span<const Point3> to,
                                        const Alignment::Options& options = {});
/// Computes the least-squares alignment that rotates only about z, for robots that cannot turn
/// over. Throws ContractError as `align_in_space`.
[[nodiscard]] Alignment3 align_in_plane(std::span<const Point3> from, std::span<const Point3> to,
                                        const Alignment::Options& options = {});

/// Procrustes disparity of two shapes, that is, their remaining difference after the best
/// translation, rotation and scale. [F11 section 4] uses it as "shape difference" mu without giving
/// the formula. mu = 1 - (s_1 + d s_2)^2 with s the singular values of the product of the two
/// centred, unit-norm sets, and d = +-1 such that the rotation is proper.
struct ShapeDifference {
  double value = 0.0;            ///< 0 (same shape) .. 1
  double with_reflection = 0.0;  ///< the same when a mirror image is allowed
};

/// Computes the disparity. Throws ContractError unless both sets have the same size >= 2 and
/// neither is a single point.
[[nodiscard]] ShapeDifference shape_difference(std::span<const Point2> a,
                                               std::span<const Point2> b);

}  // namespace panonav
