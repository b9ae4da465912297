#pragma once

#include "panonav/core/options.hpp"
#include "panonav/relative_pose/approach_steps.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

/// Options of a run home.
struct HomingPursuitOptions {
  /// Which frequencies count at which stage.
  enum class Strategy {
    steady,          ///< the frequencies of the home vector's options throughout
    coarse_to_fine,  ///< few frequencies first; when homing stops, more [S06 section 5]
    /// Our rule: steady first. If homing stops where the views differ too much to be at home,
    /// coarse to fine from there, then steady again: most such wrong ends are too far from home for
    /// all but the lowest frequencies.
    recovering,
  };

  /// Which frequencies count at which stage.
  Strategy strategy = Strategy::recovering;
  /// Highest frequency of the first stage of coarse_to_fine, followed by those of the other stages
  /// [S06 figure 13]; limited to the frequencies of the views. `recovering` uses the first two.
  int coarse = 2;
  int middle = 4;                   ///< of the second stage, >= 1
  int fine = 10;                    ///< of the third stage, >= 1
  double typical_distance_m = 3.0;  ///< R_typ, distance of the things around [S06 section 3]
  double max_step_m = 0.3;          ///< l_max [S06 section 3]
  /// Homing stops when the home vector is shorter than this, in units of R: the square root of
  /// S06's epsilon.
  double stop_length = 0.01;
  /// Homing also stops when steps become shorter than this, because successive vectors oppose each
  /// other.
  double min_step_m = 0.01;
  /// Homing also stops when the views have not become more similar for this many steps: the robot
  /// moves in circles or along an obstacle.
  int patience = 10;
  int max_steps = 60;  ///< of a run, >= 1
  /// Largest difference of the views at home where homing stops, by `image_difference` [S06 section
  /// 4.3].
  double arrived_difference = 0.08;
};
void visit_options(HomingPursuitOptions& options, OptionVisitor& visitor);

/// Homing step by step [S06 section 3]: each step has the direction of the home vector and the
/// length min(l_max, R_typ length) [S06 section 3, step 3]. With a wrong R or with noise this alone
/// would oscillate around the goal. So the step is halved when a vector opposes the previous one,
/// both in the frame of the home view, and grows by a quarter when they agree.
///
/// Holds the state of one run. Does not depend on how the robot moves: a differential robot turns
/// and drives, a holonomic one drives sideways, and the heading does not matter.
class HomingPursuit {
 public:
  /// The state of a run.
  enum class State {
    moving,       ///< another step is made
    arrived,      ///< homing stopped, and the place looks like home
    wrong_place,  ///< homing stopped, and the place does not look like home
    exhausted,    ///< `max_steps` were made
  };
  /// The next motion of the robot after a view.
  struct Decision {
    State state = State::moving;  ///< of the run
    double turn_rad = 0.0;        ///< direction of the motion, in the current robot frame
    double advance_m = 0.0;       ///< length of the step; 0 unless moving
    HomeVector vector;            ///< of the decision
    int stage = 0;                ///< index of the stage, which determines the frequencies
    double difference = 1.0;      ///< of the views, by `image_difference`
  };

  /// Throws OptionError.
  explicit HomingPursuit(HomingView home, const HomingPursuitOptions& options = {},
                         const FourierHomingOptions& vector = {});

  /// Decides the next motion after a view. With the option `tilt` of the home vector and known
  /// elevations, the view is levelled first (`relative_tilt`). Throws ContractError as
  /// `home_vector`. After a decision that stops, further ones do too.
  [[nodiscard]] Decision decide(const HomingView& view);

  /// The view at home.
  [[nodiscard]] const HomingView& home() const noexcept { return home_; }
  [[nodiscard]] int steps() const noexcept {
    return steps_;
  }  ///< Number of decisions to move so far.

 private:
  [[nodiscard]] HomingView align_tilt_to_home(const HomingView& view) const;
  [[nodiscard]] FourierHomingOptions vector_options_of_stage(const HomingView& current) const;
  [[nodiscard]] bool has_next_stage(double difference) const noexcept;

  HomingView home_;
  HomingPursuitOptions options_;
  FourierHomingOptions vector_options_;
  int stage_ = 0;
  int steps_ = 0;
  ApproachSteps approach_;  // of the stage
  State state_ = State::moving;
};

}  // namespace panonav
