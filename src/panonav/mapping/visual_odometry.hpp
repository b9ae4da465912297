#pragma once

#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/mapping/ground_lengths.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Options of the estimate of a step from two views.
struct VisualOdometryOptions {
  /// Rule by which the motion between two views is estimated.
  enum class Rule {
    /// The published rule: takes the length from the distance of the signatures [F11 eq. 2] and the
    /// turn from the compass [F11 section 3.2]. The direction of travel is the heading at the
    /// middle of the step.
    published,
    /// Our rule: takes direction, turn and length from the home vector [S06] between the views. It
    /// follows sideways motion, too, and corrects the turn for the effect of displacement on the
    /// phases.
    home_vector,
  };

  Rule rule = Rule::home_vector;  ///< published, or our own
  /// Metres per unit of visual length. For `home_vector` this is R, the distance of the things
  /// around; for `published` it is the distance of places whose signatures differ by 1. See
  /// `length_scale_m`.
  double scale_m = 1.5;
  /// Height of the camera above level ground; with it `VisualOdometry` and maps measure lengths in
  /// metres from the ground (`GroundLengths`). 0: not known.
  double camera_height_m = 0.0;
  /// Numbers of components that `published` compares for the distance (k1) and for the rotation
  /// (k2); 0: all.
  int distance_components = 0;
  int turn_components = 0;  ///< for the turn
  /// Refinements of the solution of `home_vector`.
  int iterations = 1;
  /// Refine turn and direction of `home_vector` by the flow over azimuth (`refine_flow`). Otherwise
  /// things that are nearer on one side of the path, such as a wall, look like a turn and cause
  /// most of the drift.
  bool nearer_side = true;
  /// Largest share of the energy of the views that turn and displacement may leave unexplained.
  double max_residual = 0.5;
};
void visit_options(VisualOdometryOptions& options, OptionVisitor& visitor);

/// A view as visual odometry compares it: its signature and its Fourier coefficients.
struct OdometryView {
  FourierSignature signature;  ///< of the view, for the distance and the compass
  HomingView coefficients;     ///< of the same view, for the home vector

  /// Throws ContractError unless there are three components or more.
  explicit OdometryView(FourierSignature view);
};

/// The motion between two views.
struct VisualStep {
  Pose2 before_from_after;       ///< pose of the second view in the frame of the first, metres
  double length_in_views = 0.0;  ///< length of the step without the factor `scale_m`
  double correlation = 0.0;      ///< of the views at the turn found, -1 .. 1
  double residual = 1.0;         ///< share of the energy of the views left unexplained, 0 .. 1
};

/// Estimates the motion between two views. nullopt if the views have no structure or too little in
/// common. Throws ContractError on views of different shapes; OptionError. Cost: that of
/// `home_vector` without displacement search, plus one iteration of `refine_flow`.
[[nodiscard]] std::optional<VisualStep> visual_step(const OdometryView& before,
                                                    const OdometryView& after,
                                                    const VisualOdometryOptions& options = {});

/// A step whose length is known from elsewhere, such as wheels.
struct KnownLength {
  double length_in_views = 0.0;  ///< of the `VisualStep`, > 0
  double length_m = 0.0;         ///< of the same step, by the other source
};

/// Estimates the metres per unit of visual length: the median ratio of the steps, which is robust
/// against single wrong steps. Steps of length 0 are left out; nullopt if none remains. Throws
/// ContractError on a negative length or one that is not finite.
[[nodiscard]] std::optional<double> length_scale_m(std::span<const KnownLength> steps);

/// Integrates steps from one view after the other [F11 section 4, eq. 3-5].
class VisualOdometry {
 public:
  /// Throws OptionError.
  explicit VisualOdometry(const VisualOdometryOptions& options = {});

  /// Returns the step from the previous view; nullopt for the first view, and if no step is found:
  /// the pose is then unchanged, and `breaks()` grows by 1. Throws as `visual_step`.
  std::optional<VisualStep> add(OdometryView view);

  /// The view added last; nullopt before the first.
  [[nodiscard]] const std::optional<OdometryView>& last() const noexcept { return last_; }
  /// Metric scale of visual displacements: from the ground, or that of the options.
  [[nodiscard]] double scale_m() const;
  /// start_from_robot.
  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Number of views without a step from the previous view, not counting the first view.
  [[nodiscard]] int breaks() const noexcept { return breaks_; }

 private:
  VisualOdometryOptions options_;
  std::optional<GroundLengths> ground_;
  std::optional<OdometryView> last_;
  Pose2 pose_;
  int breaks_ = 0;
};

}  // namespace panonav
