#include "panonav/navigation/explorer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/mapping/pose_graph.hpp"
#include "panonav/navigation/coverage_map.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"

namespace panonav {

namespace {

// Ranges are used up to this length: farther ends are too uncertain for a map of 0.1 m.
constexpr double max_used_range_m = 2.0;
// Distance from a target at which the robot is there: half a cell.
constexpr double near_m = 0.05;
// Contacts on the way to a target after which it is given up.
constexpr int max_contacts = 8;
// Observations after which the map is made again: a metre of ranges.
constexpr int max_map_age = 4;
// Views to which an observation is compared: the nearest ones.
constexpr std::size_t max_compared_views = 4;
// Distance of compared views, in catchment radii: home vectors are reliable in it.
constexpr double compared_radii = 1.6;
// Below this distance, a home vector shows no direction that can be compared.
constexpr double min_direction_m = 0.12;
// Standard deviations of the turn and the direction of a home vector within a catchment area.
constexpr double turn_deviation_rad = 0.2;
constexpr double direction_deviation_rad = 0.2;
// Largest error of the turn of a recognised view, in addition to that of the odometry.
constexpr double max_turn_error_rad = 0.35;
// Largest error of the direction of a recognised view: that of a right home vector.
constexpr double max_direction_error_rad = std::numbers::pi / 4.0;
// Probability from which a view is recognised anywhere.
constexpr double min_probability = 0.9;

}  // namespace

void visit_options(ExplorationOptions& options, OptionVisitor& visitor) {
  using T = ExplorationOptions;
  constexpr OptionTable table{
      option<&T::radius_m>("largest radius of the area from which the robot homes to a view", 0.2,
                           5),
      option<&T::step_m>("longest motion between two images", 0.05, 2),
      option<&T::min_area_m2>("smallest uncovered area for which a view is memorised", 0.01, 10),
      option<&T::max_unrecognised_m>("path without a recognised view after which the robot drives "
                                     "back to the last one",
                                     0.5, 100),
      option<&T::max_metres>("path length after which the exploration ends", 1, 100000),
  };
  table.visit(options, visitor);
}

std::string_view to_string(ExplorationDecision::State state) {
  using enum ExplorationDecision::State;
  switch (state) {
    case exploring:
      return "exploring";
    case recovering:
      return "recovering";
    case returning:
      return "returning";
    case done:
      return "done";
    case lost:
      break;
  }
  return "lost";
}

class Explorer::Implementation {
 public:
  using State = ExplorationDecision::State;

  Implementation(const ExplorationOptions& options, double robot_radius_m, bool has_ranges,
                 const OdometryNoise& odometry)
      : options_(options), odometry_(odometry) {
    validate(options);
    validate(odometry);
    require(robot_radius_m >= 0.0 && std::isfinite(robot_radius_m), "robot_radius_m",
            robot_radius_m, ">= 0");
    coverage_.radius_m = options.radius_m;
    coverage_.robot_radius_m = robot_radius_m;
    coverage_.min_area_m2 = options.min_area_m2;
    if (!has_ranges) coverage_.assumed_open_m = 1.5 * options.radius_m;
  }

  ExplorationDecision observe(const FourierSignature& view, const ExplorationReport& report) {
    require(is_finite(report.moved), "moved", std::hypot(report.moved.x_m, report.moved.y_m),
            "finite numbers");
    const HomingView current = homing_view(view);
    if (state_ == State::done || state_ == State::lost) return {.state = state_};
    move(report.moved);
    if (views_.empty()) memorise(current, {});
    const auto recognised = correct_pose(current);
    if (is_near_a_view() && std::ranges::none_of(recognised, [this](const Recognition& seen) {
          return std::hypot(seen.robot_from_view.x_m, seen.robot_from_view.y_m) <=
                 options_.radius_m;
        })) {
      unrecognised_.emplace_back(anchor(pose_.position()), views_.size());
    }
    store_sensed(report);
    update_map(report.contact_rad.has_value());
    ExplorationDecision decision;
    if (state_ == State::exploring || state_ == State::recovering) {
      check_place(current, !recognised.empty());
    }
    if (state_ == State::exploring) {
      if (is_new_ || has_reached_view_point()) {
        decision.memorise = true;
        if (!is_new_) memorise(current, recognised);
        is_new_ = false;
        target_.reset();
        map_ = make_map();
      }
      if (!choose_target() || travelled_m_ >= options_.max_metres) state_ = State::returning;
    }
    decide_motion(current, decision);
    decision.state = state_;
    return decision;
  }

  [[nodiscard]] const Pose2& pose() const noexcept { return pose_; }
  [[nodiscard]] std::span<const Pose2> poses() const noexcept { return poses_; }
  [[nodiscard]] double travelled_m() const noexcept { return travelled_m_; }

  [[nodiscard]] TopologicalMap map(std::span<const ViewId> ids) const {
    require(ids.size() == views_.size(), "ids", static_cast<double>(ids.size()),
            "one for each view");
    TopologicalMap map;
    for (std::size_t i = 0; i < views_.size(); ++i) map.nodes.push_back({ids[i], poses_[i], 0});
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const PoseEdge& edge = edges_[i];
      const bool is_driven = !edge.doubtful;
      map.edges.push_back({ids[edge.a], ids[edge.b], edge.a_from_b,
                           is_driven ? Link::Kind::sequence : Link::Kind::closure,
                           edge_weights_[i]});
    }
    validate(map);
    return map;
  }

 private:
  // A view that the current observation shows.
  struct Recognition {
    std::size_t view;
    Pose2 robot_from_view;  // direction and turn from the images, length as expected
  };
  // A position that moves with the pose of a view when the map is corrected.
  struct AnchoredPoint {
    std::size_t view;
    Point2 position;
  };
  struct AnchoredLine {
    AnchoredPoint from;
    AnchoredPoint to;
  };

  void move(const Pose2& moved) {
    before_ = pose_;
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
  [[nodiscard]] std::vector<std::size_t> find_near_views() const {
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      const double away_m = distance(poses_[i].position(), pose_.position());
      if (away_m <= compared_radii * options_.radius_m) near.emplace_back(away_m, i);
    }
    std::ranges::sort(near);
    near.resize(std::min(near.size(), max_compared_views));
    std::vector<std::size_t> views;
    for (const auto& [away_m, view] : near) views.push_back(view);
    return views;
  }

  // Corrects the pose by the home vectors to the views around. Returns those that it recognises:
  // turn and direction are where the pose expects them.
  std::vector<Recognition> correct_pose(const HomingView& current) {
    std::vector<Recognition> recognised;
    for (const std::size_t i : find_near_views()) {
      const HomeVector vector = home_vector(views_[i], current);
      const Pose2 expected = inverse(pose_) * poses_[i];
      const double away_m = std::hypot(expected.x_m, expected.y_m);
      const double turn_error_rad = wrap_angle(vector.heading_rad - expected.heading_rad);
      if (std::abs(turn_error_rad) > max_turn_error_rad + 2.0 * std::sqrt(heading_variance_rad2_)) {
        continue;
      }
      if (away_m < min_direction_m) {
        correct_heading(turn_error_rad);
        recognised.push_back({i, {expected.x_m, expected.y_m, vector.heading_rad}});
        continue;
      }
      const double direction_rad = std::atan2(expected.y_m, expected.x_m);
      const double error_rad = wrap_angle(vector.direction_rad() - direction_rad);
      if (std::abs(error_rad) > max_direction_error_rad) continue;
      correct_heading(turn_error_rad);
      correct_position(poses_[i].position(), pose_.heading_rad + vector.direction_rad());
      recognised.push_back({i,
                            {away_m * std::cos(vector.direction_rad()),
                             away_m * std::sin(vector.direction_rad()), vector.heading_rad}});
    }
    if (!recognised.empty()) {
      anchor_ = recognised.front().view;
      unrecognised_m_ = 0.0;
    }
    return recognised;
  }

  void correct_heading(double turn_error_rad) {
    const double gain =
        heading_variance_rad2_ / (heading_variance_rad2_ + turn_deviation_rad * turn_deviation_rad);
    pose_.heading_rad = wrap_angle(pose_.heading_rad - gain * turn_error_rad);
    heading_variance_rad2_ *= 1.0 - gain;
  }

  // Moves the position towards the line through a view in the direction of its home vector.
  void correct_position(Point2 view, double world_direction_rad) {
    const Point2 normal{-std::sin(world_direction_rad), std::cos(world_direction_rad)};
    const Point2 away{view.x_m - pose_.x_m, view.y_m - pose_.y_m};
    const double lateral_m = away.x_m * normal.x_m + away.y_m * normal.y_m;
    const double deviation_m = near_m + direction_deviation_rad * std::hypot(away.x_m, away.y_m);
    const double gain = position_variance_m2_ / (position_variance_m2_ + deviation_m * deviation_m);
    pose_.x_m += gain * lateral_m * normal.x_m;
    pose_.y_m += gain * lateral_m * normal.y_m;
    position_variance_m2_ *= 1.0 - 0.5 * gain;  // one of two directions
  }

  void memorise(HomingView current, const std::vector<Recognition>& recognised) {
    const std::size_t number = views_.size();
    views_.push_back(std::move(current));
    poses_.push_back(pose_);
    if (number == 0) {
      is_new_ = true;
    } else {
      add_edges(number, recognised);
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

  void add_edges(std::size_t number, const std::vector<Recognition>& recognised) {
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
    for (const Recognition& seen : recognised) {
      const double away_m = std::hypot(seen.robot_from_view.x_m, seen.robot_from_view.y_m);
      edges_.push_back({.a = number,
                        .b = seen.view,
                        .a_from_b = seen.robot_from_view,
                        .position_deviation_m = near_m + direction_deviation_rad * away_m,
                        .heading_deviation_rad = turn_deviation_rad,
                        .doubtful = true});
    }
  }

  [[nodiscard]] AnchoredPoint anchor(Point2 position) const {
    return {anchor_, inverse(poses_[anchor_]) * position};
  }
  [[nodiscard]] Point2 resolve(const AnchoredPoint& point) const {
    return poses_[point.view] * point.position;
  }

  // Stores what the robot sensed of the floor.
  void store_sensed(const ExplorationReport& report) {
    driven_.push_back({anchor(before_.position()), anchor(pose_.position())});
    const auto point_at = [this](double direction_rad, double length_m) {
      return anchor(pose_ *
                    Point2{length_m * std::cos(direction_rad), length_m * std::sin(direction_rad)});
    };
    if (report.contact_rad) {
      obstacles_.push_back(point_at(*report.contact_rad, coverage_.robot_radius_m));
      impassable_.push_back(point_at(report.course_rad, coverage_.cell_m));
      ++contacts_;
    }
    for (const auto& range : report.ranges) {
      const double used_m = std::min(range.length_m, max_used_range_m);
      if (range.is_obstacle && range.length_m <= max_used_range_m) {
        // Only what the noise leaves certain is an obstacle; contact shows the rest.
        obstacles_.push_back(
            point_at(range.direction_rad, range.length_m + 2.0 * range.deviation_m));
      }
      const double open_m = used_m - 0.5 * coverage_.robot_radius_m;
      if (open_m > 0.0) {
        open_.push_back({anchor(pose_.position()), point_at(range.direction_rad, open_m)});
      }
    }
  }

  [[nodiscard]] bool is_near_a_view() const {
    return std::ranges::any_of(poses_, [this](const Pose2& view) {
      return distance(view.position(), pose_.position()) <= options_.radius_m;
    });
  }

  [[nodiscard]] CoverageMap make_map() const {
    FloorObservations floor;
    for (const auto& line : driven_) floor.driven.push_back({resolve(line.from), resolve(line.to)});
    for (const auto& line : open_) floor.open.push_back({resolve(line.from), resolve(line.to)});
    for (const auto& point : obstacles_) floor.obstacles.push_back(resolve(point));
    for (const auto& point : impassable_) floor.impassable.push_back(resolve(point));
    for (const auto& point : given_up_) floor.given_up.push_back(resolve(point));
    for (const auto& [point, view_count] : unrecognised_) {
      floor.unrecognised.push_back({resolve(point), view_count});
    }
    for (const Pose2& pose : poses_) {
      floor.views.push_back({pose.position(), options_.radius_m});
    }
    return {floor, coverage_};
  }

  // Makes the map again if an obstacle was felt, a target is reached or needed, or it is old.
  void update_map(bool has_contact) {
    const bool is_target_near =
        target_ && distance(pose_.position(), resolve(*target_)) <= options_.step_m;
    if (map_ && !has_contact && target_ && !is_target_near && ++map_age_ < max_map_age) return;
    map_ = make_map();
    map_age_ = 0;
  }

  // Drives back if the robot recognised no view for too long.
  void check_place(const HomingView& current, bool is_recognised) {
    if (is_recognised) {
      state_ = State::exploring;
      return;
    }
    if (unrecognised_m_ <= options_.max_unrecognised_m) return;
    if (state_ == State::exploring) {
      state_ = State::recovering;
      target_.reset();
    }
    const bool is_back = distance(pose_.position(), poses_[anchor_].position()) <= near_m;
    if (!is_back && unrecognised_m_ <= 4.0 * options_.max_unrecognised_m) return;
    if (!relocalise(current)) state_ = State::lost;
  }

  // Searches all views; true if one is recognised, whose pose the robot then takes over.
  bool relocalise(const HomingView& current) {
    double max_probability = min_probability;
    std::optional<std::size_t> best;
    HomeVector vector;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const auto evidence = compute_pair_evidence(views_[i], current);
      if (!evidence || evidence->probability < max_probability) continue;
      max_probability = evidence->probability;
      best = i;
      vector = evidence->vector;
    }
    if (!best) return false;
    const double away_m = std::min(vector.length(), 1.0) * options_.radius_m;
    pose_ = poses_[*best] *
            inverse(Pose2{away_m * std::cos(vector.direction_rad()),
                          away_m * std::sin(vector.direction_rad()), vector.heading_rad});
    anchor_ = *best;
    unrecognised_m_ = 0.0;
    position_variance_m2_ = options_.radius_m * options_.radius_m;
    heading_variance_rad2_ = turn_deviation_rad * turn_deviation_rad;
    state_ = State::exploring;
    return true;
  }

  // True if the robot is at its target and a view there covers new floor. Gives up a target where
  // it does not.
  bool has_reached_view_point() {
    if (!target_) return false;
    const Point2 target = resolve(*target_);
    if (distance(pose_.position(), target) > near_m) return false;
    if (map_->compute_gain_m2(pose_.position()) >= options_.min_area_m2) return true;
    give_up_target();
    return false;
  }

  void give_up_target() {
    given_up_.push_back(*target_);
    target_.reset();
  }

  // Keeps the target while it is worth it, or chooses another one. False if the floor is covered.
  bool choose_target() {
    if (target_ && contacts_ > max_contacts) {
      give_up_target();
      map_ = make_map();
    }
    if (target_) {
      const double area_m2 = map_->compute_gain_m2(resolve(*target_));
      if (area_m2 < std::max(options_.min_area_m2, 0.5 * target_area_m2_) ||
          map_->is_blocked(resolve(*target_))) {
        target_.reset();
      }
    }
    if (target_) return true;
    auto next = map_->find_view_point(pose_.position());
    if (!next && forget_contradictions()) next = map_->find_view_point(pose_.position());
    if (!next) return false;
    target_ = anchor(next->position);
    target_area_m2_ = next->area_m2;
    contacts_ = 0;
    return true;
  }

  // Drives the last part of the way back by the images alone.
  void home_to_start(const HomingView& current, ExplorationDecision& decision) {
    if (!homing_) homing_.emplace(views_.front());
    const HomingPursuit::Decision step = homing_->decide(current);
    decision.direction_rad = step.turn_rad;
    decision.advance_m = step.advance_m;
    if (step.state != HomingPursuit::State::moving) state_ = State::done;
  }

  // The robot drove from each view to the next, so that a map in which it reaches one of them no
  // more is wrong: forgets the obstacles then, and returns true.
  bool forget_contradictions() {
    const bool is_consistent = std::ranges::all_of(poses_, [this](const Pose2& view) {
      return map_->find_path(pose_.position(), view.position()).has_value();
    });
    if (is_consistent) return false;
    forget_obstacles();
    return true;
  }

  void forget_obstacles() {
    obstacles_.clear();
    impassable_.clear();
    map_ = make_map();
  }

  // Computes the motion to the target: along the path as far as it is straight.
  void decide_motion(const HomingView& current, ExplorationDecision& decision) {
    if (state_ == State::lost) return;
    Point2 goal = poses_.front().position();
    if (state_ == State::exploring) goal = resolve(*target_);
    if (state_ == State::recovering) goal = poses_[anchor_].position();
    const bool is_near_start = distance(pose_.position(), goal) <= 0.5 * options_.radius_m;
    if (homing_ || (state_ == State::returning && is_near_start)) {
      home_to_start(current, decision);
      return;
    }
    auto path = map_->find_path(pose_.position(), goal);
    if (!path && forget_contradictions()) path = map_->find_path(pose_.position(), goal);
    if (!path) {
      if (state_ == State::exploring) {
        give_up_target();
      } else {
        forget_obstacles();
      }
      return;  // the next observation is made here
    }
    Point2 next = path->empty() ? goal : path->front();
    for (const Point2& point : *path) {
      if (!map_->is_open_between(pose_.position(), point)) break;
      next = point;
      if (distance(pose_.position(), point) >= options_.step_m) break;
    }
    if (distance(next, goal) < coverage_.cell_m && map_->is_open_between(pose_.position(), goal)) {
      next = goal;
    }
    const Point2 there = inverse(pose_) * next;
    decision.direction_rad = std::atan2(there.y_m, there.x_m);
    decision.advance_m = std::min(options_.step_m, std::hypot(there.x_m, there.y_m));
  }

  ExplorationOptions options_;
  OdometryNoise odometry_;
  CoverageOptions coverage_;
  State state_ = State::exploring;
  std::vector<HomingView> views_;
  std::vector<Pose2> poses_;
  std::vector<PoseEdge> edges_;
  std::vector<double> edge_weights_;
  std::vector<AnchoredLine> driven_;
  std::vector<AnchoredLine> open_;
  std::vector<AnchoredPoint> obstacles_;
  std::vector<AnchoredPoint> impassable_;
  std::vector<AnchoredPoint> given_up_;
  std::vector<std::pair<AnchoredPoint, std::size_t>> unrecognised_;  // with the number of views
  std::optional<CoverageMap> map_;
  int map_age_ = 0;  // observations since it was made
  std::optional<AnchoredPoint> target_;
  double target_area_m2_ = 0.0;
  std::optional<HomingPursuit> homing_;  // to the start
  int contacts_ = 0;                     // on the way to the target
  bool is_new_ = false;                  // the first view was just memorised
  std::size_t anchor_ = 0;               // the last view that was recognised
  Pose2 before_;                         // pose at the last observation
  Pose2 pose_;
  double position_variance_m2_ = 0.0;
  double heading_variance_rad2_ = 0.0;
  double unrecognised_m_ = 0.0;  // path since a view was recognised
  double travelled_m_ = 0.0;
  Pose2 since_view_;  // motion by odometry since the last memorised view
  double since_view_m_ = 0.0;
  double since_view_rad_ = 0.0;
};

Explorer::Explorer(const ExplorationOptions& options, double robot_radius_m, bool has_ranges,
                   const OdometryNoise& odometry)
    : implementation_(
          std::make_unique<Implementation>(options, robot_radius_m, has_ranges, odometry)) {}
Explorer::~Explorer() = default;
Explorer::Explorer(Explorer&& other) noexcept = default;
Explorer& Explorer::operator=(Explorer&& other) noexcept = default;

ExplorationDecision Explorer::observe(const FourierSignature& view,
                                      const ExplorationReport& report) {
  return implementation_->observe(view, report);
}
const Pose2& Explorer::pose() const noexcept {
  return implementation_->pose();
}
std::span<const Pose2> Explorer::view_poses() const noexcept {
  return implementation_->poses();
}
TopologicalMap Explorer::map(std::span<const ViewId> ids) const {
  return implementation_->map(ids);
}
double Explorer::travelled_m() const noexcept {
  return implementation_->travelled_m();
}

}  // namespace panonav
