#include "panonav/navigation/internal/explorer_pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

// Standard deviation of a position in a map of 0.1 m, in addition to that of a direction.
constexpr double position_deviation_m = 0.05;
// Views to which an observation is compared: the nearest ones.
constexpr std::size_t max_compared_views = 4;
// Distance of compared views, in catchment radii: home vectors are reliable in it.
constexpr double compared_radii = 1.6;
// Below this distance, a home vector shows no direction that can be compared.
constexpr double min_direction_m = 0.12;
// Standard deviations of the turn and the direction of a home vector within a catchment area.
constexpr double turn_deviation_rad = 0.05;
constexpr double direction_deviation_rad = 0.2;
// Largest error of the turn of a recognised view, in addition to that of the odometry.
constexpr double max_turn_error_rad = 0.35;
// Largest error of the direction of a recognised view: that of a right home vector.
constexpr double max_direction_error_rad = std::numbers::pi / 4.0;
// Number of views elsewhere that may show the place of an observation: the most similar ones.
constexpr std::size_t closure_candidates = 4;
// Probability from which a view is recognised anywhere.
constexpr double min_probability = 0.9;

}  // namespace

void ExplorerPose::move(const Pose2& moved) {
  pose_ = pose_ * moved;
  const double length_m = std::hypot(moved.x_m, moved.y_m);
  const double turn_rad = std::abs(moved.heading_rad);
  travelled_m_ += length_m;
  unrecognised_m_ += length_m;
  since_view_ = since_view_ * moved;
  since_view_m_ += length_m;
  since_view_rad_ += turn_rad;
  const auto square = [](double value) { return value * value; };
  position_variance_m2_ += square(odometry_.translation_from_translation) * length_m +
                           square(odometry_.translation_scale_error * length_m) +
                           heading_variance_rad2_ * square(length_m);
  heading_variance_rad2_ += square(odometry_.rotation_from_translation) * length_m +
                            square(odometry_.rotation_from_rotation) * turn_rad;
}

// Returns the nearest views by the estimated pose.
std::vector<std::size_t> ExplorerPose::find_near_views() const {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const double away_m = distance(poses_[i].position(), pose_.position());
    if (away_m <= compared_radii * radius_m_) near.emplace_back(away_m, i);
  }
  std::ranges::sort(near);
  near.resize(std::min(near.size(), max_compared_views));
  std::vector<std::size_t> views;
  for (const auto& [away_m, view] : near) views.push_back(view);
  return views;
}

std::vector<ExplorerPose::Recognition> ExplorerPose::correct(const OdometryView& current) {
  // Turns are refined by the flow: things nearer on one side would look like a turn.
  const VisualOdometryOptions options{.max_residual = 1.0, .min_probability = 0.0};
  std::vector<Recognition> recognised;
  for (const std::size_t i : find_near_views()) {
    const auto step = visual_step(views_[i], current, options);
    if (!step) continue;
    const Pose2 measured = inverse(step->before_from_after);
    const double measured_rad = std::atan2(measured.y_m, measured.x_m);
    const Pose2 expected = inverse(pose_) * poses_[i];
    const double away_m = std::hypot(expected.x_m, expected.y_m);
    const double turn_error_rad = wrap_angle(measured.heading_rad - expected.heading_rad);
    if (std::abs(turn_error_rad) > max_turn_error_rad + 2.0 * std::sqrt(heading_variance_rad2_)) {
      continue;
    }
    if (away_m < min_direction_m) {
      correct_heading(turn_error_rad);
      recognised.push_back({i, {expected.x_m, expected.y_m, measured.heading_rad}});
      continue;
    }
    const double direction_rad = std::atan2(expected.y_m, expected.x_m);
    const double error_rad = wrap_angle(measured_rad - direction_rad);
    if (std::abs(error_rad) > max_direction_error_rad) continue;
    correct_heading(turn_error_rad);
    correct_position(poses_[i].position(), pose_.heading_rad + measured_rad);
    recognised.push_back(
        {i,
         {away_m * std::cos(measured_rad), away_m * std::sin(measured_rad), measured.heading_rad}});
  }
  if (!recognised.empty()) {
    anchor_ = recognised.front().view;
    unrecognised_m_ = 0.0;
  }
  return recognised;
}

void ExplorerPose::correct_heading(double turn_error_rad) {
  const double gain =
      heading_variance_rad2_ / (heading_variance_rad2_ + turn_deviation_rad * turn_deviation_rad);
  pose_.heading_rad = wrap_angle(pose_.heading_rad - gain * turn_error_rad);
  heading_variance_rad2_ *= 1.0 - gain;
}

// Moves the position towards the line through a view in the direction of its home vector.
void ExplorerPose::correct_position(Point2 view, double world_direction_rad) {
  const Point2 normal{-std::sin(world_direction_rad), std::cos(world_direction_rad)};
  const Point2 away{view.x_m - pose_.x_m, view.y_m - pose_.y_m};
  const double lateral_m = away.x_m * normal.x_m + away.y_m * normal.y_m;
  const double deviation_m =
      position_deviation_m + direction_deviation_rad * std::hypot(away.x_m, away.y_m);
  const double gain = position_variance_m2_ / (position_variance_m2_ + deviation_m * deviation_m);
  pose_.x_m += gain * lateral_m * normal.x_m;
  pose_.y_m += gain * lateral_m * normal.y_m;
  position_variance_m2_ *= 1.0 - 0.5 * gain;  // one of two directions
}

// Finds views that show the place of an observation, although the pose expects them elsewhere. They
// count only in pairs that agree on the pose, as other places may look similar to a single view.
std::vector<ExplorerPose::Recognition> ExplorerPose::find_closures(
    const OdometryView& current) const {
  std::vector<std::pair<double, std::size_t>> similar;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    if (distance(poses_[i].position(), pose_.position()) <= compared_radii * radius_m_) continue;
    similar.emplace_back(dissimilarity_l1(views_[i].signature, current.signature), i);
  }
  const std::size_t count = std::min(similar.size(), closure_candidates);
  std::ranges::partial_sort(similar, similar.begin() + static_cast<std::ptrdiff_t>(count));
  struct Closure {
    Recognition recognition;
    Pose2 robot;
  };
  std::vector<Closure> possible;
  for (const auto& [dissimilarity, i] : std::span(similar).first(count)) {
    const auto evidence = compute_pair_evidence(views_[i].coefficients, current.coefficients);
    if (!evidence || evidence->probability < min_probability) continue;
    const Pose2 robot_from_view = estimate_robot_from_view(evidence->vector);
    possible.push_back({{i, robot_from_view}, poses_[i] * inverse(robot_from_view)});
  }
  std::vector<Recognition> closures;
  for (const Closure& a : possible) {
    const bool is_confirmed = std::ranges::any_of(possible, [&](const Closure& b) {
      return a.recognition.view != b.recognition.view &&
             distance(a.robot.position(), b.robot.position()) <= radius_m_ &&
             std::abs(angle_difference(a.robot.heading_rad, b.robot.heading_rad)) <=
                 max_turn_error_rad;
    });
    const bool is_elsewhere =
        distance(a.robot.position(), pose_.position()) > compared_radii * radius_m_;
    if (is_confirmed && is_elsewhere) closures.push_back(a.recognition);
  }
  return closures;
}

void ExplorerPose::add_view(OdometryView current, const std::vector<Recognition>& recognised) {
  const std::vector<Recognition> closures = find_closures(current);
  const std::size_t number = views_.size();
  views_.push_back(std::move(current));
  poses_.push_back(pose_);
  if (number > 0) {
    add_driven_edge(number);
    for (const Recognition& seen : recognised) {
      const double away_m = std::hypot(seen.robot_from_view.x_m, seen.robot_from_view.y_m);
      add_seen_edge(number, seen, position_deviation_m + direction_deviation_rad * away_m);
    }
    for (const Recognition& seen : closures) add_seen_edge(number, seen, radius_m_);
    edge_weights_ = optimise_pose_graph(poses_, edges_).edge_weights;
  }
  pose_ = poses_.back();
  anchor_ = number;
  since_view_ = {};
  since_view_m_ = 0.0;
  since_view_rad_ = 0.0;
  position_variance_m2_ = 0.0;
  heading_variance_rad2_ = 0.0;
  unrecognised_m_ = 0.0;
}

void ExplorerPose::add_driven_edge(std::size_t number) {
  const auto square = [](double value) { return value * value; };
  const double turn_variance_rad2 = square(odometry_.rotation_from_translation) * since_view_m_ +
                                    square(odometry_.rotation_from_rotation) * since_view_rad_;
  const double variance_m2 = square(odometry_.translation_from_translation) * since_view_m_ +
                             square(odometry_.translation_scale_error * since_view_m_) +
                             turn_variance_rad2 * square(since_view_m_) / 3.0;
  constexpr double min_deviation = 0.01;  // keeps the weights of the equations within range
  edges_.push_back({.a = number - 1,
                    .b = number,
                    .a_from_b = since_view_,
                    .position_deviation_m = min_deviation + std::sqrt(variance_m2),
                    .heading_deviation_rad = min_deviation + std::sqrt(turn_variance_rad2)});
}

void ExplorerPose::add_seen_edge(std::size_t number, const Recognition& seen,
                                 double position_deviation) {
  edges_.push_back({.a = number,
                    .b = seen.view,
                    .a_from_b = seen.robot_from_view,
                    .position_deviation_m = position_deviation,
                    .heading_deviation_rad = turn_deviation_rad,
                    .doubtful = true});
}

// Returns the pose of a view in the frame of the robot by the home vector to it, which is at most
// a catchment radius long.
Pose2 ExplorerPose::estimate_robot_from_view(const HomeVector& vector) const {
  const double away_m = std::min(vector.length(), 1.0) * radius_m_;
  if (away_m == 0.0) return {0.0, 0.0, vector.heading_rad};
  return {away_m * std::cos(vector.direction_rad()), away_m * std::sin(vector.direction_rad()),
          vector.heading_rad};
}

bool ExplorerPose::relocalise(const OdometryView& current) {
  double max_probability = min_probability;
  std::optional<std::size_t> best;
  HomeVector vector;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const auto evidence = compute_pair_evidence(views_[i].coefficients, current.coefficients);
    if (!evidence || evidence->probability < max_probability) continue;
    max_probability = evidence->probability;
    best = i;
    vector = evidence->vector;
  }
  if (!best) return false;
  pose_ = poses_[*best] * inverse(estimate_robot_from_view(vector));
  anchor_ = *best;
  unrecognised_m_ = 0.0;
  position_variance_m2_ = radius_m_ * radius_m_;
  heading_variance_rad2_ = turn_deviation_rad * turn_deviation_rad;
  return true;
}

bool ExplorerPose::is_near_a_view() const {
  return std::ranges::any_of(poses_, [this](const Pose2& view) {
    return distance(view.position(), pose_.position()) <= radius_m_;
  });
}

TopologicalMap ExplorerPose::map(std::span<const ViewId> ids) const {
  require(ids.size() == views_.size(), "ids", static_cast<double>(ids.size()), "one for each view");
  TopologicalMap map;
  for (std::size_t i = 0; i < views_.size(); ++i) map.nodes.push_back({ids[i], poses_[i], 0});
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    const PoseEdge& edge = edges_[i];
    const bool is_driven = !edge.doubtful;
    map.edges.push_back({ids[edge.a], ids[edge.b], edge.a_from_b,
                         is_driven ? Link::Kind::sequence : Link::Kind::closure, edge_weights_[i]});
  }
  validate(map);
  return map;
}

}  // namespace panonav
