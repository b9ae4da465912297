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
  /// Assume that the speed over 15 views stays that over the first ones, and correct lengths for
  /// the distance of things around, which changes from room to room. Views without motion do not
  /// count. Not used with `camera_height_m`.
  bool steady_speed = true;
  /// Largest share of the energy of the views that turn and displacement may leave unexplained.
  double max_residual = 0.5;
  /// Smallest probability that the direction of a step by `home_vector` is right within 45 degrees
  /// (`PairFeatures::direction_probability`). Checked only if more than 15 % of the energy is
  /// unexplained, because the check takes 9 ms. A step that passes over views needs 0.9 or more.
  /// 0: not checked.
  double min_probability = 0.5;
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
  double probability = 1.0;      ///< that the direction is right within 45 degrees, with the prior
  /// Number of views from the first view to the second; more than 1 if `VisualOdometry` passed over
  /// views between them.
  int views = 1;
};

/// Motions that are expected between the images of a drive.
struct MotionPrior {
  /// Mean absolute turn between consecutive views; nullopt: every turn is as probable. One step in
  /// ten may turn by any angle, as robots do in front of walls.
  std::optional<double> mean_turn_rad;
  /// Share, between 0 and 1, of pairs of such views from which the motion can be computed. 0.5 for
  /// any two views, as in the training data of the probability.
  double share_right = 0.5;

  /// Logarithm of the probability density of a turn.
  [[nodiscard]] double log_density(double turn_rad) const;
  /// Probability that a turn is one of those along the path, not a free one.
  [[nodiscard]] double share_along(double turn_rad) const;
  /// Probability with this share, of a probability for any two views.
  [[nodiscard]] double posterior(double probability) const;
};

/// Estimates the motion between two views. Of two solutions whose turns differ by more than 45
/// degrees, the more probable one with the prior is returned. nullopt if the views have no
/// structure or too little in common, or match no better than by chance. Throws ContractError on
/// views of different shapes; OptionError. Cost: that of `home_vector` without displacement search,
/// plus one iteration of `refine_flow`; see also `VisualOdometryOptions::min_probability`.
[[nodiscard]] std::optional<VisualStep> visual_step(const OdometryView& before,
                                                    const OdometryView& after,
                                                    const VisualOdometryOptions& options = {},
                                                    const MotionPrior& prior = {});

/// A step whose length is known from elsewhere, such as wheels.
struct KnownLength {
  double length_in_views = 0.0;  ///< of the `VisualStep`, > 0
  double length_m = 0.0;         ///< of the same step, by the other source
};

/// Estimates the metres per unit of visual length: the median ratio of the steps, which is robust
/// against single wrong steps. Steps of length 0 are left out; nullopt if none remains. Throws
/// ContractError on a negative length or one that is not finite.
[[nodiscard]] std::optional<double> length_scale_m(std::span<const KnownLength> steps);

/// Integrates steps from one view after the other [F11 section 4, eq. 3-5]. The turns and the share
/// of known steps of the drive so far are the prior of the next step (`MotionPrior`), so that a
/// step in a symmetric room does not turn by half a circle.
class VisualOdometry {
 public:
  /// Throws OptionError.
  explicit VisualOdometry(const VisualOdometryOptions& options = {});

  /// Number of previous views from which a step is tried, the latest first, because a single view
  /// may be blurred or covered (chosen).
  static constexpr std::size_t max_tried_views = 3;

  /// Returns the step from the latest of the previous views (`max_tried_views`) that gives one.
  /// nullopt for the first view, and if no step is found: the pose is then unchanged, and
  /// `breaks()` grows by 1. Throws as `visual_step`.
  std::optional<VisualStep> add(OdometryView view);
  /// Sets the metres per unit of visual length of further steps. Throws OptionError unless > 0.
  void set_scale_m(double scale_m);
  /// Begins a new drive: the next view does not follow the last one. Previous views, turns and the
  /// speed are forgotten; the pose and the scale that the ground has shown are kept.
  void begin_path();
  /// Forgets the previous views, because the motion since then is known from elsewhere. `view`: the
  /// latest view, from which the next step begins; nullopt: unknown. The pose is kept.
  void restart(std::optional<OdometryView> view);

  /// The view added last; null before the first.
  [[nodiscard]] const OdometryView* last() const noexcept {
    return latest_.empty() ? nullptr : &latest_.back().view;
  }
  /// Metric scale of visual displacements at the latest view: from the ground, or that of the
  /// options, corrected for `steady_speed`.
  [[nodiscard]] double scale_m() const;
  /// True if `scale_m` was measured from the ground.
  [[nodiscard]] bool is_metric() const { return ground_ && ground_->scale_m(); }
  /// start_from_robot.
  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  /// Number of views without a step from the previous view, not counting the first view.
  [[nodiscard]] int breaks() const noexcept { return breaks_; }
  /// Number of views that had a previous view, so that a step was tried.
  [[nodiscard]] int tried_steps() const noexcept { return tried_steps_; }

 private:
  [[nodiscard]] MotionPrior prior(std::size_t views) const;
  void learn_turn(const VisualStep& step);
  void learn_speed(double length_in_views);

  VisualOdometryOptions options_;
  std::optional<GroundLengths> ground_;
  /// Statistics of the steps of a drive so far, for the next one.
  struct Drive {
    std::vector<double> first_lengths;   // in views, of steps with motion
    std::vector<double> latest_lengths;  // likewise
    double known_weight = 0.0;  // sum of the probabilities of tried steps, older ones count less
    double tried_weight = 0.0;  // number of them, likewise
    double turn_weight = 0.0;   // number of known steps, likewise
    double turn_sum_rad = 0.0;  // of their absolute turns
  };
  Drive drive_;
  struct PosedView {
    OdometryView view;
    Pose2 pose;
  };
  std::vector<PosedView> latest_;  // the latest views, oldest first
  Pose2 pose_;
  int breaks_ = 0;
  int tried_steps_ = 0;
};

}  // namespace panonav
