#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "panonav/camera/internal/edge_field.hpp"
#include "panonav/camera/internal/lens_pair.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/image.hpp"

namespace panonav::dual_fisheye {

/// Number of parts of the sphere, 24 in azimuth and 4 in height: errors of matches within one
/// region may be correlated, for example by the parallax of a near object.
inline constexpr int sectors = 24;
inline constexpr int regions = 4 * sectors;

/// A point of a picture.
struct ImagePoint {
  int picture = 0, lens = 0;
  Eigen::Vector2d pixel;
  /// Returns the index of the lens in this picture among `make_posed_lenses`.
  [[nodiscard]] int view() const { return 2 * picture + lens; }
};

/// A point of the world found in two views: in both lenses of a picture, or in two pictures.
struct Match {
  std::array<ImagePoint, 2> points;
  Eigen::Vector3d east, north;  ///< unit vectors orthogonal to the direction
  Eigen::Matrix2d whitener;     ///< 1 across the patch's edges, less along them
  double offset_steps = 0.0;    ///< distance from the predicted position, in steps
  double log_gain = 0.0;        ///< logarithm of the second patch's brightness over the first's
  int region = 0;
};

struct Matching {
  std::vector<Match> matches;
  int textured_count = 0;  ///< patches with contrast, matched or not
  /// Counts the matches within one step of their predicted positions.
  [[nodiscard]] int count_near_expected() const;
};

/// Finds points that are visible in two views (lenses or pictures) by normalised correlation of
/// patches.
class PatchMatcher {
 public:
  /// `grey`: grey pictures of one size, which must outlive the matcher. `mirror_sign`: see
  /// `PosedLens`.
  PatchMatcher(std::span<const Image> grey, double mirror_sign, Executor& executor)
      : grey_(grey), mirror_sign_(mirror_sign), executor_(executor) {}

  /// Sets each picture's yaw to the rotation at which its panorama correlates best with that of the
  /// first picture. `step_rad`: angle between the samples used.
  void estimate_yaws(State& state, double step_rad, double left_azimuth_rad);
  /// Matches patches in `directions` directions, within `search_steps` steps of `step_rad` of the
  /// positions that the state predicts.
  [[nodiscard]] Matching match(const State& state, double step_rad, int search_steps,
                               int directions);

 private:
  class View;
  class Search;
  /// Returns the pictures reduced to samples about `step_rad` apart, with the reduction; computes
  /// each reduction only once.
  [[nodiscard]] const std::pair<int, std::vector<SmoothPlanes>>& get_or_create_planes(
      const State& state, double step_rad);

  std::span<const Image> grey_;
  double mirror_sign_;
  Executor& executor_;
  std::vector<std::pair<int, std::vector<SmoothPlanes>>> planes_;
};

}  // namespace panonav::dual_fisheye
