#include "panonav/homing/chain_recorder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {

void visit_options(ChainRecorderOptions& options, OptionVisitor& visitor) {
  using T = ChainRecorderOptions;
  constexpr OptionTable table{
      option<&T::direction_tolerance_rad>("vectors between snapshots may be off by this much",
                                          above(0), std::numbers::pi / 2),
      option<&T::margin>("a snapshot is taken at this share of the way on which homing works",
                         above(0), 1),
      option<&T::shortest_spacing_m>("least way between two snapshots", above(0), 1000),
      option<&T::longest_spacing_m>("longest way between two snapshots", above(0), 1000),
      option<&T::near_m>("nearer views are not asked for the direction", 0, 1000),
      option<&T::view_spacing_m>("way between the views that are compared", 0.001, 1000),
  };
  table.visit(options, visitor);
}

ChainRecorder::ChainRecorder(const ChainRecorderOptions& options,
                             const FourierHomingOptions& vector)
    : options_(options), vector_(vector) {
  validate(options_);
  validate(vector_);
}

bool ChainRecorder::points_from_to(const Passed& from, const Passed& to) const {
  const Pose2 from_to = inverse(from.snapshot_from_this) * to.snapshot_from_this;
  if (std::hypot(from_to.x_m, from_to.y_m) < options_.near_m) return true;
  const HomeVector vector = home_vector_unchecked(to.view, from.view, vector_);
  if (vector.length() == 0.0) return false;
  const double error_rad = vector.direction_rad() - std::atan2(from_to.y_m, from_to.x_m);
  return std::abs(wrap_angle(error_rad)) <= options_.direction_tolerance_rad;
}

// `candidate` is the last of the views passed. Between two views that follow each other the last
// candidate has asked already for the direction back.
bool ChainRecorder::is_reachable(const Passed& candidate) const {
  if (!points_from_to(candidate, passed_.front())) return false;
  return std::all_of(passed_.begin(), passed_.end(), [&](const Passed& view) {
    return &view == &candidate || points_from_to(view, candidate);
  });
}

std::size_t ChainRecorder::add(const HomingView& view, const Pose2& moved) {
  if (chain_.snapshots.empty()) {
    chain_.snapshots.push_back({view, 0.0, {}});
    passed_.push_back({view, {}, 0.0});
    return 1;
  }
  for (const double value : {moved.x_m, moved.y_m, moved.heading_rad}) {
    require(std::isfinite(value), "step of the odometry", value, "a finite number");
  }
  const HomingView& first = chain_.snapshots.front().view;
  require(view.rows() == first.rows(), "rows of the view", view.rows(), to_text(first.rows()));
  require(view.components() == first.components(), "components of the view", view.components(),
          to_text(first.components()));
  if (view.elevations() != first.elevations()) {
    throw ContractError("elevations of the view", "another band", "that of the first view");
  }
  snapshot_from_robot_ = snapshot_from_robot_ * moved;
  way_m_ += std::hypot(moved.x_m, moved.y_m);
  if (way_m_ - passed_.back().way_m < options_.view_spacing_m) return chain_.snapshots.size();

  passed_.push_back({view, snapshot_from_robot_, way_m_});
  const bool too_far = way_m_ > options_.longest_spacing_m;
  if (!too_far && is_reachable(passed_.back())) return chain_.snapshots.size();
  // The last view that is not too far: a share of the way that worked, and at least the shortest.
  const double worked_m = passed_[passed_.size() - 2].way_m;
  const double wanted_m =
      std::max(too_far ? worked_m : options_.margin * worked_m, options_.shortest_spacing_m);
  std::size_t chosen = 0;
  for (std::size_t i = 1; i < passed_.size() && passed_[i].way_m <= wanted_m; ++i) chosen = i;
  if (chosen == 0 && way_m_ >= options_.shortest_spacing_m) chosen = 1;
  if (chosen > 0) take_snapshot(chosen);
  return chain_.snapshots.size();
}

void ChainRecorder::take_snapshot(std::size_t index) {
  const Pose2 old_from_new = passed_[index].snapshot_from_this;
  const double way_m = passed_[index].way_m;
  chain_.snapshots.push_back(
      {passed_[index].view, chain_.snapshots.back().travelled_m + way_m, old_from_new});
  passed_.erase(passed_.begin(), passed_.begin() + static_cast<std::ptrdiff_t>(index));
  const Pose2 new_from_old = inverse(old_from_new);
  for (Passed& view : passed_) {
    view.snapshot_from_this = new_from_old * view.snapshot_from_this;
    view.way_m -= way_m;
  }
  snapshot_from_robot_ = new_from_old * snapshot_from_robot_;
  way_m_ -= way_m;
}

SnapshotChain ChainRecorder::finish() const {
  SnapshotChain chain = chain_;
  if (passed_.size() > 1) {
    const Passed& last = passed_.back();
    chain.snapshots.push_back(
        {last.view, chain.snapshots.back().travelled_m + last.way_m, last.snapshot_from_this});
  }
  return chain;
}

}  // namespace panonav
