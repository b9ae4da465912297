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
    /// The published rule: the distance is that of the signatures [F11 eq. 2], the turn that of the
    /// compass [F11 section 3.2], and the robot goes the way it faces at the middle of the step.
    published,
    /// Ours: the home vector [S06] from the one view to the other gives direction, turn and length.
    /// A
    /// robot that drives sideways is therefore followed, too, and the turn is corrected for the
    /// effect of displacement on the phases.
    home_vector,
  };

  Rule rule = Rule::home_vector;  ///< published, or our own
  /// Metres for each unit of visual length: the distance R of things around for `home_vector`, the
  /// distance of signatures 1 apart for `published`. See `length_scale_m`.
  double scale_m = 1.5;
  /// Height of the camera above level ground; with it `VisualOdometry` and maps read lengths from
  /// the ground, in metres (`GroundLengths`). 0: not known.
  double camera_height_m = 0.0;
  /// Numbers of components that `published` compares for the distance (k1) and for the rotation
  /// (k2); 0: all.
  int distance_components = 0;
  int turn_components = 0;  ///< for the turn
  /// Refinements of the solution of `home_vector`.
  int iterations = 1;
  /// Turn and direction of `home_vector` are refined by the flow over azimuth (`refine_flow`),
  /// which separates a turn from things that are nearer on one side of the path. Along a wall this
  /// is most of the drift.
  bool nearer_side = true;
  /// Largest share of the energy of the views that turn and displacement may leave unexplained.
  double max_residual = 0.5;
};
void visit_options(VisualOdometryOptions& options, OptionVisitor& visitor);

/// A view in the forms in which visual odometry compares it.
struct OdometryView {
  FourierSignature signature;  ///< of the view, for the distance and the compass
  HomingView coefficients;     ///< of the same view, for the home vector

  /// Throws ContractError unless there are three components or more.
  explicit OdometryView(FourierSignature view);
};

/// The motion between two views.
struct VisualStep {
  Pose2 before_from_after;       ///< pose of the second view in the frame of the first, metres
  double length_in_views = 0.0;  ///< without the scale
  double correlation = 0.0;      ///< of the views at the turn found, -1 .. 1
  double residual = 1.0;         ///< share of the energy of the views left unexplained, 0 .. 1
};

/// Estimates the motion between two views. nullopt where they have no structure or too little in
/// common. Throws ContractError on views of different shapes; OptionError. Cost: `home_vector`
/// without the search of displacements and one iteration of `refine_flow`.
[[nodiscard]] std::optional<VisualStep> visual_step(const OdometryView& before,
                                                    const OdometryView& after,
                                                    const VisualOdometryOptions& options = {});

/// A step whose length is known from elsewhere, such as wheels.
struct KnownLength {
  double length_in_views = 0.0;  ///< of the `VisualStep`, > 0
  double length_m = 0.0;         ///< of the same step, by the other source
};

/// Estimates the scale from known steps: the median of their ratios, which is robust against single
/// wrong ones. Steps of no length are left out; nullopt when none remains. Throws ContractError on
/// a negative length or one that is not finite.
[[nodiscard]] std::optional<double> length_scale_m(std::span<const KnownLength> steps);

/// Integrates steps from one view after the other [F11 section 4, eq. 3-5].
class VisualOdometry {
 public:
  /// Throws OptionError.
  explicit VisualOdometry(const VisualOdometryOptions& options = {});

  /// Returns the step from the view before; nullopt for the first view and where no step is found:
  /// the pose then stays, and `breaks()` counts. Throws as `visual_step`.
  std::optional<VisualStep> add(OdometryView view);

  /// The view added last; nullopt before the first.
  [[nodiscard]] const std::optional<OdometryView>& last() const noexcept { return last_; }
  /// Metric scale of visual displacements: from the ground, or that of the options.
  [[nodiscard]] double scale_m() const;
  /// start_from_robot.
  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Number of views without a step, without the first one.
  [[nodiscard]] int breaks() const noexcept { return breaks_; }

 private:
  VisualOdometryOptions options_;
  std::optional<GroundLengths> ground_;
  std::optional<OdometryView> last_;
  Pose2 pose_;
  int breaks_ = 0;
};

}  // namespace panonav
