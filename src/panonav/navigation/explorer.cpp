#include "panonav/navigation/explorer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/homing/homing_pursuit.hpp"
#include "panonav/navigation/coverage_map.hpp"
#include "panonav/navigation/internal/explorer_pose.hpp"
#include "panonav/relative_pose/homing_view.hpp"

namespace panonav {

namespace {

// Ranges are used up to this length: farther ends are too uncertain for a map of 0.1 m.
constexpr double max_used_range_m = 2.0;
// Distance from a target at which the robot is there: half a cell.
constexpr double arrival_m = 0.05;
// Largest number of contacts on the path to a target, which is abandoned then.
constexpr int max_contacts = 8;
// Without ranges, floor is assumed around driven positions up to this distance, in catchment radii,
// and an obstacle to be this much wider than the point of contact: most obstacles are walls, and a
// door leaves room enough. Chosen in the office (seeds 9101 and 9102), where the path becomes half
// as long.
constexpr double assumed_open_radii = 1.3;
constexpr double felt_width_m = 0.15;
// Weight of the last target in the share of promised areas that views covered: some five targets
// count. In a map that drift distorted, walls stand twice, and what lies between is no floor.
// Chosen in `lab` (seeds 9101 to 9108), with paths of at most 1.9 sweeps instead of 5.
constexpr double covered_share_gain = 0.2;
// Observations on a way back after which the robot is lost: 50 m in steps of 0.25 m.
constexpr int max_driving_back = 200;
// Observations after which the map is made again: a metre of ranges.
constexpr int max_map_age = 4;

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
      : options_(options), robot_radius_m_(robot_radius_m), robot_(options.radius_m, odometry) {
    validate(options);
    validate(odometry);
    require(robot_radius_m >= 0.0 && std::isfinite(robot_radius_m), "robot_radius_m",
            robot_radius_m, ">= 0");
    // The robot stops this far from a target.
    coverage_.radius_m = options.radius_m - arrival_m;
    coverage_.robot_radius_m = robot_radius_m;
    coverage_.min_area_m2 = options.min_area_m2;
    if (!has_ranges) {
      coverage_.assumed_open_m = assumed_open_radii * options.radius_m;
      coverage_.robot_radius_m += felt_width_m;
    }
    assumed_radius_m_ = coverage_.robot_radius_m;
  }

  ExplorationDecision observe(const FourierSignature& view, const ExplorationReport& report) {
    require(is_finite(report.moved), "moved", std::hypot(report.moved.x_m, report.moved.y_m),
            "finite numbers");
    const OdometryView current(view);
    if (state_ == State::done || state_ == State::lost) return {.state = state_};
    before_ = robot_.pose();
    robot_.move(report.moved);
    if (robot_.views().empty()) {
      robot_.add_view(current, {});
      is_new_ = true;
    }
    const auto recognised = robot_.correct(current);
    if (robot_.is_near_a_view() &&
        std::ranges::none_of(recognised, [this](const ExplorerPose::Recognition& seen) {
          return std::hypot(seen.robot_from_view.x_m, seen.robot_from_view.y_m) <=
                 options_.radius_m;
        })) {
      unrecognised_.emplace_back(anchor(robot_.pose().position()), robot_.views().size());
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
        if (!is_new_) robot_.add_view(current, recognised);
        is_new_ = false;
        target_.reset();
        coverage_.robot_radius_m = assumed_radius_m_;
        map_ = make_map();
      }
      is_complete_ = !choose_target();
      if (is_complete_ || robot_.travelled_m() >= options_.max_metres) state_ = State::returning;
    }
    const bool is_driving_back = state_ == State::recovering || state_ == State::returning;
    driving_back_ = is_driving_back ? driving_back_ + 1 : 0;
    if (driving_back_ > max_driving_back) state_ = State::lost;
    decide_motion(current, decision);
    decision.state = state_;
    return decision;
  }

  [[nodiscard]] const ExplorerPose& robot() const noexcept { return robot_; }

  [[nodiscard]] ExplorationProgress progress() const {
    if (!map_) return {};
    const CoverageMap::Areas areas = map_->measure_areas();
    return {.floor_m2 = areas.floor_m2,
            .covered_m2 = areas.covered_m2,
            .position_deviation_m = robot_.compute_position_deviation_m(),
            .is_complete = is_complete_};
  }

 private:
  // A position that moves with the pose of a view when the map is corrected.
  struct AnchoredPoint {
    std::size_t view;
    Point2 position;
  };
  struct AnchoredLine {
    AnchoredPoint from;
    AnchoredPoint to;
  };

  [[nodiscard]] AnchoredPoint anchor(Point2 position) const {
    return {robot_.anchor(), inverse(robot_.poses()[robot_.anchor()]) * position};
  }
  [[nodiscard]] Point2 resolve(const AnchoredPoint& point) const {
    return robot_.poses()[point.view] * point.position;
  }

  // Stores what the robot sensed of the floor.
  void store_sensed(const ExplorationReport& report) {
    driven_.push_back({anchor(before_.position()), anchor(robot_.pose().position())});
    const auto point_at = [this](double direction_rad, double length_m) {
      return anchor(robot_.pose() *
                    Point2{length_m * std::cos(direction_rad), length_m * std::sin(direction_rad)});
    };
    if (report.contact_rad) {
      obstacles_.push_back(point_at(*report.contact_rad, robot_radius_m_));
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
      const double open_m = used_m - 0.5 * robot_radius_m_;
      if (open_m > 0.0) {
        open_.push_back({anchor(robot_.pose().position()), point_at(range.direction_rad, open_m)});
      }
    }
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
    for (const Pose2& pose : robot_.poses()) {
      floor.views.push_back({pose.position(), coverage_.radius_m});
    }
    return {floor, coverage_};
  }

  // Makes the map again if an obstacle was felt, a target is reached or needed, or it is old.
  void update_map(bool has_contact) {
    const bool is_target_near =
        target_ && distance(robot_.pose().position(), resolve(*target_)) <= options_.step_m;
    if (map_ && !has_contact && target_ && !is_target_near && ++map_age_ < max_map_age) return;
    map_ = make_map();
    map_age_ = 0;
  }

  // Drives back if the robot recognised no view for too long.
  void check_place(const OdometryView& current, bool is_recognised) {
    if (is_recognised) {
      state_ = State::exploring;
      return;
    }
    if (robot_.unrecognised_m() <= options_.max_unrecognised_m) return;
    if (state_ == State::exploring) {
      state_ = State::recovering;
      target_.reset();
    }
    const bool is_back =
        distance(robot_.pose().position(), robot_.poses()[robot_.anchor()].position()) <= arrival_m;
    if (!is_back && robot_.unrecognised_m() <= 4.0 * options_.max_unrecognised_m) return;
    state_ = robot_.relocalise(current) ? State::exploring : State::lost;
  }

  // True if the robot is at its target and a view there covers new floor. Gives up a target where
  // it does not.
  bool has_reached_view_point() {
    if (!target_) return false;
    const Point2 target = resolve(*target_);
    if (distance(robot_.pose().position(), target) > arrival_m) return false;
    const double area_m2 = map_->compute_gain_m2(robot_.pose().position());
    if (area_m2 < options_.min_area_m2) {
      give_up_target();
      return false;
    }
    learn_covered_share(area_m2);
    return true;
  }

  void learn_covered_share(double covered_m2) {
    const double share = std::min(covered_m2 / target_area_m2_, 1.0);
    covered_share_ += covered_share_gain * (share - covered_share_);
  }

  void give_up_target() {
    given_up_.push_back(*target_);
    drop_target();
  }
  void drop_target() {
    learn_covered_share(0.0);
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
        drop_target();
      }
    }
    if (target_) return true;
    const auto find = [this] {
      return map_->find_view_point(robot_.pose().position(), covered_share_);
    };
    auto next = find();
    if (!next && coverage_.robot_radius_m > robot_radius_m_) {
      // Enclosed by what it assumes: until the next view an obstacle is no wider than it felt.
      coverage_.robot_radius_m = robot_radius_m_;
      map_ = make_map();
      next = find();
    }
    if (!next && forget_contradictions()) next = find();
    if (!next) return false;
    target_ = anchor(next->position);
    target_area_m2_ = next->area_m2;
    contacts_ = 0;
    return true;
  }

  // Drives the last part of the way back by the images alone.
  void home_to_start(const OdometryView& current, ExplorationDecision& decision) {
    if (!homing_) homing_.emplace(robot_.views().front().coefficients);
    const HomingPursuit::Decision step = homing_->decide(current.coefficients);
    decision.direction_rad = step.turn_rad;
    decision.advance_m = step.advance_m;
    if (step.state != HomingPursuit::State::moving) state_ = State::done;
  }

  // The robot drove from each view to the next, so that a map in which it reaches one of them no
  // more is wrong: forgets the obstacles then, and returns true.
  bool forget_contradictions() {
    const bool is_consistent = std::ranges::all_of(robot_.poses(), [this](const Pose2& view) {
      return map_->find_path(robot_.pose().position(), view.position()).has_value();
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
  void decide_motion(const OdometryView& current, ExplorationDecision& decision) {
    if (state_ == State::lost) return;
    Point2 goal = robot_.poses().front().position();
    if (state_ == State::exploring) goal = resolve(*target_);
    if (state_ == State::recovering) goal = robot_.poses()[robot_.anchor()].position();
    const bool is_near_start = distance(robot_.pose().position(), goal) <= 0.5 * options_.radius_m;
    if (homing_ || (state_ == State::returning && is_near_start)) {
      home_to_start(current, decision);
      return;
    }
    auto path = map_->find_path(robot_.pose().position(), goal);
    if (!path && forget_contradictions()) path = map_->find_path(robot_.pose().position(), goal);
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
      if (!map_->is_open_between(robot_.pose().position(), point)) break;
      next = point;
      if (distance(robot_.pose().position(), point) >= options_.step_m) break;
    }
    if (distance(next, goal) < coverage_.cell_m &&
        map_->is_open_between(robot_.pose().position(), goal)) {
      next = goal;
    }
    const Point2 there = inverse(robot_.pose()) * next;
    decision.direction_rad = std::atan2(there.y_m, there.x_m);
    decision.advance_m = std::min(options_.step_m, std::hypot(there.x_m, there.y_m));
  }

  ExplorationOptions options_;
  double robot_radius_m_;
  double assumed_radius_m_ = 0.0;  // with the assumed width of obstacles
  ExplorerPose robot_;
  CoverageOptions coverage_;
  State state_ = State::exploring;
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
  double covered_share_ = 1.0;           // share of promised areas that views covered
  std::optional<HomingPursuit> homing_;  // to the start
  int contacts_ = 0;                     // on the way to the target
  int driving_back_ = 0;                 // observations since it drives back
  bool is_new_ = false;                  // the first view was just memorised
  bool is_complete_ = false;             // no view point is left
  Pose2 before_;                         // pose at the last observation
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
  return implementation_->robot().pose();
}
std::span<const Pose2> Explorer::view_poses() const noexcept {
  return implementation_->robot().poses();
}
TopologicalMap Explorer::map(std::span<const ViewId> ids) const {
  return implementation_->robot().map(ids);
}
double Explorer::travelled_m() const noexcept {
  return implementation_->robot().travelled_m();
}
ExplorationProgress Explorer::progress() const {
  return implementation_->progress();
}

}  // namespace panonav
