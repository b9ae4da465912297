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

/// Parts of the sphere, 24 around and 4 from floor to ceiling: errors within one, such as those of
/// near things, may have a cause in common.
inline constexpr int sectors = 24;
inline constexpr int regions = 4 * sectors;

/// A point of a picture.
struct ImagePoint {
  int picture = 0, lens = 0;
  Eigen::Vector2d pixel;
  /// Returns the index of the lens in this picture among `make_posed_lenses`.
  [[nodiscard]] int view() const { return 2 * picture + lens; }
};

/// A point of the world seen by two lenses, or by one in two images.
struct Match {
  std::array<ImagePoint, 2> points;
  Eigen::Vector3d east, north;  ///< across the direction
  Eigen::Matrix2d whitener;     ///< 1 across the patch's edges, less along them
  double off_steps = 0.0;       ///< from where the state before expected it
  double log_gain = 0.0;        ///< of the second against the first
  int region = 0;
};

struct Matching {
  std::vector<Match> matches;
  int textured = 0;  ///< patches with contrast, matched or not
  /// Counts the matches within one step of where they were expected.
  [[nodiscard]] int count_near_expected() const;
};

/// Finds points that two lenses, or one in two images, both see, by normalised correlation of
/// patches.
class PatchMatcher {
 public:
  /// Takes grey pictures of one size, which outlive the matcher. `mirror_sign`: see `PosedLens`.
  PatchMatcher(std::span<const Image> grey, double mirror_sign, Executor& executor)
      : grey_(grey), mirror_sign_(mirror_sign), executor_(executor) {}

  /// Sets each picture's yaw to the turn by which its panorama, of values about `step_rad` apart,
  /// is most like the first one's.
  void estimate_yaws(State& state, double step_rad, double left_azimuth_rad);
  /// Searches around each of `directions` for patches within `search` steps of the position that
  /// the state predicts.
  [[nodiscard]] Matching match(const State& state, double step_rad, int search, int directions);

 private:
  class View;
  class Search;
  /// Returns pictures reduced so much that values are about `step_rad` apart, with the reduction;
  /// computes each reduction once.
  [[nodiscard]] const std::pair<int, std::vector<SmoothPlanes>>& planes(const State& state,
                                                                        double step_rad);

  std::span<const Image> grey_;
  double mirror_sign_;
  Executor& executor_;
  std::vector<std::pair<int, std::vector<SmoothPlanes>>> planes_;
};

}  // namespace panonav::dual_fisheye
