#include "panonav/homing/homing_pursuit.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/relative_tilt.hpp"

namespace panonav {

namespace {

constexpr int stages_of_coarse_to_fine = 3;
constexpr int stages_of_recovering = 4;

}  // namespace

void visit_options(HomingPursuitOptions& options, OptionVisitor& visitor) {
  using T = HomingPursuitOptions;
  constexpr OptionTable table{
      choice<&T::strategy>("method that chooses the frequencies for each stage of homing", "steady",
                           "coarse_to_fine", "recovering"),
      option<&T::coarse>("highest frequency of the first stage", 1, 62),
      option<&T::middle>("highest frequency of the second stage", 1, 62),
      option<&T::fine>("highest frequency of the third stage", 1, 62),
      option<&T::typical_distance_m>("typical distance of the objects around the robot", 0.001,
                                     1000),
      option<&T::max_step_m>("longest step between two views", 0.001, 100),
      option<&T::stop_length>("homing stops if the home vector is shorter than this, in units of R "
                              "(the typical distance of objects)",
                              0, 1),
      option<&T::min_step_m>("homing stops if a step is shorter than this", above(0), 100),
      option<&T::patience>(
          "homing stops if the views do not become more similar for this number of steps", 1, 1e6),
      option<&T::max_steps>("largest number of steps of one homing run", 1, 1e6),
      option<&T::arrived_difference>("largest difference between the current view and the goal "
                                     "view at which the robot has arrived",
                                     0, 2),
  };
  table.visit(options, visitor);
}

HomingPursuit::HomingPursuit(HomingView home, const HomingPursuitOptions& options,
                             const FourierHomingOptions& vector)
    : home_(std::move(home)), options_(options), vector_options_(vector) {
  validate(options_);
  validate(vector_options_);
}

bool HomingPursuit::has_next_stage(double difference) const noexcept {
  switch (options_.strategy) {
    case HomingPursuitOptions::Strategy::steady:
      return false;
    case HomingPursuitOptions::Strategy::coarse_to_fine:
      return stage_ + 1 < stages_of_coarse_to_fine;
    case HomingPursuitOptions::Strategy::recovering:
      return difference > options_.arrived_difference && stage_ + 1 < stages_of_recovering;
  }
  return false;
}

FourierHomingOptions HomingPursuit::vector_options_of_stage(const HomingView& current) const {
  FourierHomingOptions vector = vector_options_;
  int highest = 0;
  if (options_.strategy == HomingPursuitOptions::Strategy::coarse_to_fine) {
    highest = std::array{options_.coarse, options_.middle,
                         options_.fine}[static_cast<std::size_t>(stage_)];
  } else if (options_.strategy == HomingPursuitOptions::Strategy::recovering) {
    highest = std::array{0, options_.coarse, options_.middle, 0}[static_cast<std::size_t>(stage_)];
  }
  if (highest > 0) {
    vector.highest = std::min(highest, std::min(home_.components(), current.components()) - 2);
  }
  return vector;
}

// Returns the view as a robot with the same tilt as at home would take it. The second pass has a
// better heading, from the levelled view, and so a better tilt.
HomingView HomingPursuit::align_tilt_to_home(const HomingView& view) const {
  constexpr int passes = 2;
  HomingView level = view;
  for (int i = 0; i < passes; ++i) {
    const HomeVector vector = home_vector(home_, level, vector_options_);
    const Tilt tilt = relative_tilt(home_, view, vector.heading_rad);
    if (tilt == Tilt{}) return view;
    level = level_view(view, tilt);
  }
  return level;
}

HomingPursuit::Decision HomingPursuit::decide(const HomingView& view) {
  const HomingView current =
      vector_options_.tilt && home_.elevations() ? align_tilt_to_home(view) : view;
  Decision decision;
  decision.difference = image_difference(home_, current);
  approach_.add_difference(decision.difference);
  for (;;) {
    const FourierHomingOptions options = vector_options_of_stage(current);
    const HomeVector vector = home_vector(home_, current, options);
    decision.vector = vector;
    decision.stage = stage_;
    decision.turn_rad = vector.direction_rad();
    decision.advance_m = approach_.next_m(vector, options_.typical_distance_m, options_.max_step_m);
    const bool stops = vector.length() < options_.stop_length ||
                       decision.advance_m < options_.min_step_m ||
                       approach_.steps_since_min() >= options_.patience;
    if (state_ == State::moving && !stops && steps_ >= options_.max_steps) {
      state_ = State::exhausted;
    }
    if (state_ == State::moving && !stops) {
      ++steps_;
      return decision;
    }
    if (state_ == State::moving && has_next_stage(decision.difference)) {
      ++stage_;
      approach_.restart(decision.difference);
      continue;
    }
    if (state_ == State::moving) {
      state_ =
          decision.difference <= options_.arrived_difference ? State::arrived : State::wrong_place;
    }
    decision.state = state_;
    decision.advance_m = 0.0;
    return decision;
  }
}

}  // namespace panonav
