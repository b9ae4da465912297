// Localisation in a place that changes day by day: with a memory that is updated and with an
// unchanged one.

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "lab/elsewhere/experiments.hpp"
#include "lab/rows.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/localisation/memory_update.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav_simulation/changing_scene.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/paths.hpp"
#include "panonav_simulation/simulated_odometry.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

constexpr double spacing_m = 0.5;
constexpr int rows = 40;
constexpr int columns = 256;
constexpr double moved_fraction_per_day = 0.03;

using FeatureMap = std::map<ViewId, std::optional<LocalFeatures>>;
using Features = std::shared_ptr<const FeatureMap>;

Features extract_all_features(const simulation::PlaceRecording& place, const VisualMemory& memory) {
  auto features = std::make_shared<FeatureMap>();
  for (const ViewId view : memory.views()) {
    const Point2 at = memory.info(view).pose->position();
    (*features)[view] = extract_features(place.references[place.nearest_reference(at)].panorama);
  }
  return features;
}

/// A memory with its localisers and the local features of its views.
class RememberedPlace {
 public:
  RememberedPlace(VisualMemory memory, Features features)
      : place_(std::move(memory), spacing_m),
        features_(std::move(features)),
        localiser_(place_.localiser()) {
    const FeatureSource source = [kept = features_](ViewId view) { return kept->at(view); };
    const NeighbourSupport support(*place_.ranking());
    localiser_.use_features(
        source, evaluate_features(*place_.ranking(), support, source).is_significantly_better());
  }
  [[nodiscard]] Place localise(const Panorama& view) const {
    return localiser_.localise(compute_packed_signature(view, place_.memory()), {},
                               make_query_features(view));
  }
  [[nodiscard]] const TrackingPlace& place() const noexcept { return place_; }
  [[nodiscard]] const Features& features() const noexcept { return features_; }

 private:
  TrackingPlace place_;
  Features features_;
  Localiser localiser_;
};

/// Records the memory again in the scene of `today`.
RememberedPlace rerecord_memory(simulation::PlaceRecording today, std::uint64_t seed,
                                Executor& executor) {
  std::vector<Pose2> grid;
  for (const auto& point : today.free_space->grid(spacing_m)) {
    grid.push_back({point.position.x_m, point.position.y_m, 0.0});
  }
  today.references = simulation::capture_views(today, today.rendering, grid, seed, {}, executor);
  VisualMemory memory = make_memory_of_references(today, executor);
  const Features features = extract_all_features(today, memory);
  return {std::move(memory), features};
}

/// The rule by which the robot chooses its goals of a day.
enum class DailyDrive {
  errands,  ///< from one random place to the next
  rounds,   ///< to the least recently visited places, the nearest of them first
};

/// A robot that drives through a place day by day and takes a picture every `spacing_m`.
class DrivingRobot {
 public:
  explicit DrivingRobot(DailyDrive drive) : drive_(drive) {}

  /// Returns the poses of one day's images; the day begins at a random position.
  std::vector<Pose2> simulate_day(const simulation::FreeSpace& space, int pictures,
                                  Random& random) {
    ++day_;
    std::vector<simulation::GridPosition> grid;
    if (drive_ == DailyDrive::rounds) grid = space.grid(spacing_m);
    std::vector<Pose2> path;
    Point2 at = space.random_pose(random).position();
    double distance_to_picture_m = 0.0;  // distance to the next picture
    while (static_cast<int>(path.size()) < pictures) {
      Point2 goal = space.random_pose(random).position();
      if (drive_ == DailyDrive::rounds) {
        goal = find_least_recent(grid, at).value_or(goal);
        last_visit_day_[grid_square(goal)] = day_;
      }
      const auto path_to_goal = space.shortest_path(at, goal);
      if (!path_to_goal) continue;
      for (const Point2 next : *path_to_goal) {
        const double heading_rad = std::atan2(next.y_m - at.y_m, next.x_m - at.x_m);
        double leg_m = distance(at, next);
        while (leg_m >= distance_to_picture_m && static_cast<int>(path.size()) < pictures) {
          at = {at.x_m + distance_to_picture_m * std::cos(heading_rad),
                at.y_m + distance_to_picture_m * std::sin(heading_rad)};
          leg_m -= distance_to_picture_m;
          path.push_back({at.x_m, at.y_m, heading_rad});
          for (const simulation::GridPosition& place : grid) {
            if (distance(place.position, at) <= spacing_m) {
              last_visit_day_[grid_square(place.position)] = day_;
            }
          }
          distance_to_picture_m = spacing_m;
        }
        distance_to_picture_m -= leg_m;
        at = next;
      }
    }
    return path;
  }

 private:
  using Square = std::pair<long, long>;
  static Square grid_square(Point2 p) {
    return {std::lround(p.x_m / spacing_m), std::lround(p.y_m / spacing_m)};
  }
  /// Returns the least recently visited grid position, the nearest of equal ones; nullopt if the
  /// robot is at the only one.
  [[nodiscard]] std::optional<Point2> find_least_recent(
      const std::vector<simulation::GridPosition>& grid, Point2 at) const {
    std::optional<Point2> best;
    std::pair<int, double> best_rank;
    for (const simulation::GridPosition& place : grid) {
      const auto found = last_visit_day_.find(grid_square(place.position));
      const double distance_m = distance(place.position, at);
      const std::pair rank(found == last_visit_day_.end() ? 0 : found->second, distance_m);
      if (distance_m < 0.5 * spacing_m || (best && best_rank <= rank)) continue;
      best = place.position;
      best_rank = rank;
    }
    return best;
  }

  DailyDrive drive_;
  int day_ = 0;
  std::map<Square, int> last_visit_day_;  ///< day of the last visit
};

/// Answers that recognise the place, with a position within one spacing of the truth (right) or
/// farther off (wrong).
struct DayResult {
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::vector<double> errors_m;
};

DayResult localise_all(const RememberedPlace& remembered,
                       const std::vector<simulation::PlacedView>& views, Executor& executor) {
  const auto answers = simulation::make_each(executor, views.size(), [&](std::size_t i) {
    return remembered.localise(views[i].panorama);
  });
  DayResult result;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!answers[i].known || !answers[i].position) continue;
    const double error_m = distance(answers[i].position->position(), views[i].pose.position());
    result.errors_m.push_back(error_m);
    ++(error_m <= spacing_m ? result.right : result.wrong);
  }
  return result;
}

MemoryUpdate::LocalisedView make_localised_view(const Pose2& odometry,
                                                const PackedSignature& signature,
                                                const Place& answer) {
  MemoryUpdate::LocalisedView view{odometry, signature, answer.probability, std::nullopt,
                                   std::nullopt};
  if (answer.position && answer.heading_rad) {
    const Point2 at = answer.position->position();
    view.pose = Pose2{at.x_m, at.y_m, *answer.heading_rad};
    view.radius_m = answer.position->radius_m;
  }
  return view;
}

/// A robot that updates its memory day by day.
class LearningRobot {
 public:
  LearningRobot(VisualMemory memory, Features features)
      : memory_(std::move(memory)),
        remembered_(std::make_unique<RememberedPlace>(memory_, std::move(features))) {}

  [[nodiscard]] const RememberedPlace& remembered() const noexcept { return *remembered_; }
  [[nodiscard]] std::size_t views() const noexcept { return memory_.size(); }
  [[nodiscard]] std::size_t added() const noexcept { return errors_m_.size(); }
  [[nodiscard]] std::size_t dropped() const noexcept { return dropped_; }
  /// Returns the position errors of the learnt views, in metres.
  [[nodiscard]] const std::vector<double>& errors_m() const noexcept { return errors_m_; }

  void learn(const std::vector<simulation::PlacedView>& seen, std::uint64_t seed,
             Executor& executor) {
    const auto answers = simulation::make_each(executor, seen.size(), [&](std::size_t i) {
      return remembered_->localise(seen[i].panorama);
    });
    simulation::SimulatedOdometry odometry(OdometryNoise{}, seed);
    MemoryUpdate update(*remembered_->place().ranking(), remembered_->place().model(), use_);
    std::vector<PackedSignature> signatures;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i > 0) odometry.advance(inverse(seen[i - 1].pose) * seen[i].pose);
      signatures.push_back(compute_packed_signature(seen[i].panorama, memory_));
      update.add(make_localised_view(odometry.pose(), signatures.back(), answers[i]));
    }
    MemoryUpdate::Changes changes = update.finish();
    use_ = std::move(changes.use);
    auto features = std::make_shared<FeatureMap>(*remembered_->features());
    for (const auto* views : {&changes.replaced, &changes.forgotten}) {
      for (const ViewId view : *views) memory_.remove(view);
      dropped_ += views->size();
    }
    for (const auto& [number, pose] : changes.added) {
      const std::string name = std::to_string(use_.runs) + "/" + std::to_string(number);
      const ViewId view = memory_.append(signatures[number], {name, pose, std::nullopt});
      (*features)[view] = extract_features(seen[number].panorama);
      use_.views[view] = {.last_run = use_.runs, .learnt = true};
      errors_m_.push_back(distance(pose.position(), seen[number].pose.position()));
    }
    use_.size = static_cast<int>(memory_.size());
    if (changes.added.empty() && changes.replaced.empty() && changes.forgotten.empty()) return;
    remembered_ = std::make_unique<RememberedPlace>(memory_, std::move(features));
  }

 private:
  VisualMemory memory_;
  std::unique_ptr<RememberedPlace> remembered_;
  MemoryUpdate::UseStatistics use_;
  std::vector<double> errors_m_;
  std::size_t dropped_ = 0;
};

/// A robot that updates its memory on its daily drives.
struct DailyRobot {
  std::string id;
  std::string what;
  DrivingRobot driving;
  LearningRobot learning;
  std::size_t max_views;
  DayResult answers{};
  viewer::Series series{};
};

/// One experiment over many days with an unchanged memory, learning robots, and a memory recorded
/// again on the last day.
class Days {
 public:
  Days(ElsewhereExperiments& elsewhere, const std::string& name)
      : elsewhere_(elsewhere),
        options_(elsewhere.options),
        name_(name),
        place_(simulation::record_place(make_first_scene(),
                                        {.seed = options_.seed,
                                         .spacing_m = spacing_m,
                                         .queries = 1,
                                         .rows = rows,
                                         .columns = columns},
                                        elsewhere.executor)),
        changing_(place_.scene, options_.seed),
        memory_(make_memory_of_references(place_, elsewhere.executor)),
        features_(extract_all_features(place_, memory_)),
        unchanged_(memory_, features_) {
    for (const auto& [id, what, drive] :
         {std::tuple{".with", "learning on errands", DailyDrive::errands},
          {".rounds", "learning on rounds", DailyDrive::rounds}}) {
      robots_.push_back(
          {id, what, DrivingRobot(drive), LearningRobot(memory_, features_), memory_.size()});
      robots_.back().series.label = what;
    }
  }

  void run_days() {
    Random light(options_.seed, 91);
    const int evaluation_interval_days = std::max(1, options_.days / 6);
    for (int day = 1; day <= options_.days; ++day) {
      changing_.simulate_day(moved_fraction_per_day);
      const simulation::PlaceRecording today = make_place_today(light.uniform(0.6, 1.2));
      const std::uint64_t seed = options_.seed * 1000003U + static_cast<std::uint64_t>(day) * 1000U;
      if (day == 1 || day % evaluation_interval_days == 0 || day == options_.days)
        evaluate_day(today, day, seed);
      if (day == options_.days) break;
      for (DailyRobot& robot : robots_) {
        Random driving(seed, 5);
        const auto path =
            robot.driving.simulate_day(*today.free_space, options_.day_pictures, driving);
        robot.learning.learn(
            simulation::capture_views(today, place_.rendering, path, seed, {}, executor()), seed,
            executor());
        robot.max_views = std::max(robot.max_views, robot.learning.views());
      }
    }
  }

  void report() const {
    const std::string id = "elsewhere.days." + name_;
    const std::string what = name_ + ", day " + std::to_string(options_.days) + ", " +
                             std::to_string(changing_.moved()) + " of " +
                             std::to_string(changing_.movable()) + " objects moved: ";
    Reproduction& result = elsewhere_.result;
    add_rate(result, id + ".without",
             what + "single images localised within one spacing, without learning",
             unchanged_result_.right, query_count());
    add_rate(result, id + ".rerecorded", what + "the same with a memory recorded again on that day",
             rerecorded_result_.right, query_count());
    add_rate(result, id + ".wrong_without",
             what + "answers farther off than one spacing, without learning",
             unchanged_result_.wrong, query_count());
    if (!unchanged_result_.errors_m.empty()) {
      add_median(result, id + ".error_without", what + "error of positions, without learning", "m",
                 unchanged_result_.errors_m);
    }
    for (const DailyRobot& robot : robots_) report(robot, id + robot.id, what + robot.what + ", ");
    add_plot(result, "days_" + name_ + ".svg",
             "Single images of " + name_ +
                 " that are localised within one spacing, while objects move and light changes.",
             viewer::LinePlot{.x_label = "day",
                              .y_label = "localised",
                              .series = {robots_[0].series, robots_[1].series, unchanged_series_}});
  }

 private:
  [[nodiscard]] simulation::Scene make_first_scene() const {
    simulation::Scene scene =
        simulation::make_or_read_scene(options_.data, name_, {.seed = options_.seed});
    scene.name = name_;
    return scene;
  }
  [[nodiscard]] Executor& executor() const { return elsewhere_.executor; }
  [[nodiscard]] std::size_t query_count() const {
    return static_cast<std::size_t>(3 * options_.queries);
  }

  [[nodiscard]] simulation::PlaceRecording make_place_today(double light) const {
    simulation::PlaceRecording today = place_;
    static_cast<simulation::SimulatedPlace&>(today) =
        simulation::make_place(changing_.scene(light), executor());
    return today;
  }

  void evaluate_day(const simulation::PlaceRecording& today, int day, std::uint64_t seed) {
    Random random(seed, 6);
    std::vector<Pose2> poses;
    for (std::size_t q = 0; q < query_count(); ++q)
      poses.push_back(today.free_space->random_pose(random));
    const auto queries =
        simulation::capture_views(today, place_.rendering, poses, seed + 500, {}, executor());
    unchanged_result_ = localise_all(unchanged_, queries, executor());
    add_point(unchanged_series_, day, success_rate(unchanged_result_.right, query_count()));
    for (DailyRobot& robot : robots_) {
      robot.answers = localise_all(robot.learning.remembered(), queries, executor());
      add_point(robot.series, day, success_rate(robot.answers.right, query_count()));
    }
    if (day == options_.days) {
      rerecorded_result_ =
          localise_all(rerecord_memory(today, seed + 50'000, executor()), queries, executor());
    }
  }

  void report(const DailyRobot& robot, const std::string& row, const std::string& which) const {
    Reproduction& result = elsewhere_.result;
    const LearningRobot& learning = robot.learning;
    add_rate(result, row, which + "localised within one spacing", robot.answers.right,
             query_count(), at_least(0.98));
    add_rate(result, row + ".wrong", which + "answers farther off than one spacing",
             robot.answers.wrong, query_count());
    if (!robot.answers.errors_m.empty()) {
      add_median(result, row + ".error", which + "error of positions", "m", robot.answers.errors_m);
    }
    add_row(result, row + ".views",
            which + "views of the memory, most on any day, over those at first",
            static_cast<double>(robot.max_views) / static_cast<double>(memory_.size()), "",
            at_most(static_cast<double>(MemoryUpdateOptions{}.appearances)))
        .over = std::to_string(memory_.size()) + " at first, " + std::to_string(learning.added()) +
                " learnt, " + std::to_string(learning.dropped()) + " dropped";
    if (learning.added() == 0) return;
    add_rate(result, row + ".astray", which + "views learnt farther off than one spacing",
             count_where(learning.errors_m(), [](double error_m) { return error_m > spacing_m; }),
             learning.added(), at_most(0.0));
  }

  ElsewhereExperiments& elsewhere_;
  const ReproductionOptions& options_;
  std::string name_;
  simulation::PlaceRecording place_;
  simulation::ChangingScene changing_;
  VisualMemory memory_;
  Features features_;
  RememberedPlace unchanged_;
  std::vector<DailyRobot> robots_;
  viewer::Series unchanged_series_{.label = "without learning"};
  DayResult unchanged_result_;
  DayResult rerecorded_result_;
};

}  // namespace

void ElsewhereExperiments::reproduce_days(const std::string& place) {
  Days days(*this, place);
  days.run_days();
  days.report();
}

}  // namespace panonav::lab
