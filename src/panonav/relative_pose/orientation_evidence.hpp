#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// A wrong statement about the columns of images. The true azimuth of a column is the stated one,
/// negated if `is_mirrored`, plus `turn_rad`.
struct OrientationFault {
  bool is_mirrored = false;  ///< the columns run in the other direction
  double turn_rad = 0.0;     ///< in [-pi, pi); 0 if the stated forward direction may be right
  friend bool operator==(const OrientationFault&, const OrientationFault&) = default;
};

/// Finds out from pairs of views with known poses whether the columns of the images run in the
/// stated direction and whether forward is where it was stated: turns of the visual compass are
/// compared with turns of the poses, and directions of home vectors with directions of motion.
class OrientationEvidence {
 public:
  /// Adds a pair of views, less than about half the distance of the things around apart.
  /// `home_from_current`: pose of the robot at `current` in its frame at `home`. Pairs whose images
  /// have too little in common are ignored. Throws as `home_vector`. Cost: that of `home_vector`.
  void add(const HomingView& home, const HomingView& current, const Pose2& home_from_current);

  /// Number of pairs that turn by 10 to 150 degrees, as the images or their mirror images show.
  [[nodiscard]] std::size_t turns() const noexcept { return turns_; }
  /// Number of them whose images turn in the opposite direction.
  [[nodiscard]] std::size_t opposite_turns() const noexcept { return opposite_turns_; }
  /// Number of pairs with a direction of motion.
  [[nodiscard]] std::size_t moves() const noexcept { return moves_.size(); }
  /// Number of them that agree on where forward is.
  [[nodiscard]] std::size_t agreeing_moves() const;

  /// True if the columns run in the stated direction, false if in the other. nullopt: the pairs do
  /// not show it. Chance explains the turns with a probability of at most 0.001, or the motions fit
  /// one direction only.
  [[nodiscard]] std::optional<bool> runs_as_stated() const;
  /// Returns the azimuth of the stated forward direction, by most motions; 0 if it is less than 20
  /// degrees off. nullopt: the motions are few or do not agree.
  [[nodiscard]] std::optional<double> find_turn_rad() const;
  /// Returns what the two functions above find to be stated wrongly; nullopt: nothing.
  [[nodiscard]] std::optional<OrientationFault> find_fault() const;

 private:
  struct Move {
    double stated_rad;  // direction to home in the image, with the stated orientation
    double true_rad;    // the same, by the poses
    [[nodiscard]] double turn_rad(bool is_mirrored) const;  // from stated to true
  };
  /// The offset from stated to true directions on which most moves agree.
  struct CommonTurn {
    double turn_rad = 0.0;
    std::size_t agreeing = 0;    // number of moves
    double deviation_rad = 0.0;  // standard deviation of turn_rad
  };
  [[nodiscard]] CommonTurn find_common_turn(bool is_mirrored) const;
  [[nodiscard]] bool is_common(const CommonTurn& turn) const;

  std::size_t turns_ = 0;
  std::size_t opposite_turns_ = 0;
  std::vector<Move> moves_;
};

}  // namespace panonav
