// A place that changes day by day, with a memory that is kept true and with one that is not.

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "experiments/elsewhere/experiments.hpp"
#include "experiments/rows.hpp"
#include "experiments/runs/changing_scene.hpp"
#include "experiments/runs/make_each.hpp"
#include "experiments/runs/tracking_run.hpp"
#include "experiments/runs/worlds.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/localisation/memory_update.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/simulation/scenes.hpp"

namespace panonav {

namespace {

constexpr double spacing_m = 0.5;
constexpr int rows = 40;
constexpr int columns = 256;
constexpr double moved_share = 0.03;

using FeatureMap = std::map<ViewId, std::optional<LocalFeatures>>;
using Features = std::shared_ptr<const FeatureMap>;

Features features_of(const PlaceRecording& place, const VisualMemory& memory) {
  auto features = std::make_shared<FeatureMap>();
  for (const ViewId view : memory.views()) {
    const Point2 at = memory.info(view).pose->position();
    (*features)[view] = extract_features(place.references[place.nearest_reference(at)].panorama);
  }
  return features;
}

/// A memory with all that localises in it and the features of its views.
class RememberedPlace {
 public:
  RememberedPlace(VisualMemory memory, Features features)
      : place_(std::move(memory), spacing_m),
        features_(std::move(features)),
        localiser_(place_.localiser()) {
    const FeatureSource source = [kept = features_](ViewId view) { return kept->at(view); };
    const NeighbourSupport support(*place_.ranking());
    localiser_.use_features(source, try_features(*place_.ranking(), support, source).tell_more());
  }
  [[nodiscard]] Localisation localise(const Panorama& view) const {
    return localiser_.localise(signature_for(view, place_.memory()), {}, features_of_query(view));
  }
  [[nodiscard]] const TrackingPlace& place() const noexcept { return place_; }
  [[nodiscard]] const Features& features() const noexcept { return features_; }

 private:
  TrackingPlace place_;
  Features features_;
  Localiser localiser_;
};

/// A memory that is recorded again in a place as it is on that day.
RememberedPlace recorded_again(PlaceRecording today, std::uint64_t seed, Executor& executor) {
  std::vector<Pose2> grid;
  for (const auto& point : today.free_space->grid(spacing_m)) {
    grid.push_back({point.position.x_m, point.position.y_m, 0.0});
  }
  today.references = take_views(today, today.rendering, grid, seed, {}, executor);
  VisualMemory memory = memory_of_references(today, executor);
  const Features features = features_of(today, memory);
  return {std::move(memory), features};
}

/// A robot that goes to one random place after the other, with a picture each spacing.
std::vector<Pose2> errands(const FreeSpace& space, int pictures, Random& random) {
  std::vector<Pose2> path;
  Point2 at = space.random_pose(random).position();
  double left_m = 0.0;  // to the next picture
  while (static_cast<int>(path.size()) < pictures) {
    const auto way = space.shortest_path(at, space.random_pose(random).position());
    if (!way) continue;
    for (const Point2 next : *way) {
      const double heading_rad = std::atan2(next.y_m - at.y_m, next.x_m - at.x_m);
      double leg_m = distance(at, next);
      while (leg_m >= left_m && static_cast<int>(path.size()) < pictures) {
        at = {at.x_m + left_m * std::cos(heading_rad), at.y_m + left_m * std::sin(heading_rad)};
        leg_m -= left_m;
        path.push_back({at.x_m, at.y_m, heading_rad});
        left_m = spacing_m;
      }
      left_m -= leg_m;
      at = next;
    }
  }
  return path;
}

/// Known places, and of these positions within one spacing of the truth.
struct DayAnswers {
  std::size_t right = 0;
  std::size_t wrong = 0;
  std::vector<double> errors_m;
};

DayAnswers ask(const RememberedPlace& remembered, const std::vector<PlacedView>& views,
               Executor& executor) {
  const auto answers = make_each(executor, views.size(), [&](std::size_t i) {
    return remembered.localise(views[i].panorama);
  });
  DayAnswers result;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!answers[i].known || !answers[i].position) continue;
    const double error_m = distance(answers[i].position->position, views[i].pose.position());
    result.errors_m.push_back(error_m);
    ++(error_m <= spacing_m ? result.right : result.wrong);
  }
  return result;
}

RunView run_view(const Pose2& odometry, const PackedSignature& signature,
                 const Localisation& answer) {
  RunView view{odometry, signature, answer.known_probability, std::nullopt, std::nullopt};
  if (answer.position && answer.heading_rad) {
    const Point2 at = answer.position->position;
    view.pose = Pose2{at.x_m, at.y_m, *answer.heading_rad};
    view.radius_m = answer.position->radius_m;
  }
  return view;
}

/// What a robot learns in the course of the days.
class LearningRobot {
 public:
  LearningRobot(VisualMemory memory, Features features)
      : memory_(std::move(memory)),
        remembered_(std::make_unique<RememberedPlace>(memory_, std::move(features))) {}

  [[nodiscard]] const RememberedPlace& remembered() const noexcept { return *remembered_; }
  [[nodiscard]] std::size_t views() const noexcept { return memory_.size(); }
  [[nodiscard]] std::size_t added() const noexcept { return errors_m_.size(); }
  [[nodiscard]] std::size_t dropped() const noexcept { return dropped_; }
  /// Of the poses with which views were learnt.
  [[nodiscard]] const std::vector<double>& errors_m() const noexcept { return errors_m_; }

  void learn(const std::vector<PlacedView>& seen, std::uint64_t seed, Executor& executor) {
    const auto answers = make_each(executor, seen.size(), [&](std::size_t i) {
      return remembered_->localise(seen[i].panorama);
    });
    SimulatedOdometry odometry(OdometryNoise{}, seed);
    MemoryUpdate update(*remembered_->place().ranking(), remembered_->place().model(), use_);
    std::vector<PackedSignature> signatures;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i > 0) odometry.advance(inverse(seen[i - 1].pose) * seen[i].pose);
      signatures.push_back(signature_for(seen[i].panorama, memory_));
      update.add(run_view(odometry.pose(), signatures.back(), answers[i]));
    }
    RunChanges changes = update.finish();
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
  MemoryUse use_;
  std::vector<double> errors_m_;
  std::size_t dropped_ = 0;
};

}  // namespace

void reproduce_days(const ElsewhereReproductionOptions& options, const std::string& name,
                    Executor& executor, Reproduction& result) {
  const bool built_in = std::ranges::find(scene_names(), name) != scene_names().end();
  Scene first =
      built_in ? make_scene(name, {.seed = options.seed}) : read_world(options.data, name);
  first.name = name;
  ChangingScene changing(first, options.seed);
  const PlaceRecording place = record_place(std::move(first),
                                            {.seed = options.seed,
                                             .spacing_m = spacing_m,
                                             .queries = 1,
                                             .rows = rows,
                                             .columns = columns},
                                            executor);
  const VisualMemory memory = memory_of_references(place, executor);
  const Features features = features_of(place, memory);
  const RememberedPlace still(memory, features);
  LearningRobot robot(memory, features);
  Random light(options.seed, 91);
  Series with_learning{.label = "with learning"};
  Series without_learning{.label = "without"};
  DayAnswers with;
  DayAnswers without;
  DayAnswers rerecorded;
  std::size_t max_views = robot.views();
  const int asked_every = std::max(1, options.days / 6);
  for (int day = 1; day <= options.days; ++day) {
    changing.pass_day(moved_share);
    PlaceRecording today = place;
    today.scene = changing.scene(light.uniform(0.6, 1.2));
    today.renderer = std::make_shared<const Renderer>(today.scene, RendererOptions{}, executor);
    today.free_space =
        std::make_shared<const FreeSpace>(today.scene, free_space_options(today.scene));
    const std::uint64_t seed = options.seed * 1000003U + static_cast<std::uint64_t>(day) * 1000U;
    if (day == 1 || day % asked_every == 0 || day == options.days) {
      Random random(seed, 6);
      std::vector<Pose2> poses;
      for (int q = 0; q < 3 * options.queries; ++q) {
        poses.push_back(today.free_space->random_pose(random));
      }
      const auto queries = take_views(today, place.rendering, poses, seed + 500, {}, executor);
      with = ask(robot.remembered(), queries, executor);
      without = ask(still, queries, executor);
      if (day == options.days) {
        rerecorded = ask(recorded_again(today, seed + 50'000, executor), queries, executor);
      }
      add_point(with_learning, day, success_rate(with.right, queries.size()));
      add_point(without_learning, day, success_rate(without.right, queries.size()));
    }
    if (day == options.days) break;
    Random walking(seed, 5);
    const auto path = errands(*today.free_space, options.day_pictures, walking);
    robot.learn(take_views(today, place.rendering, path, seed, {}, executor), seed, executor);
    max_views = std::max(max_views, robot.views());
  }
  const auto asked = static_cast<std::size_t>(3 * options.queries);
  const std::string id = "elsewhere.days." + name;
  const std::string what = name + ", day " + std::to_string(options.days) + ", " +
                           std::to_string(changing.moved()) + " of " +
                           std::to_string(changing.movable()) + " objects moved: ";
  add_rate(result, id + ".with", what + "single pictures localised within one spacing, learning",
           with.right, asked, at_least(0.98));
  add_rate(result, id + ".without", what + "the same without learning", without.right, asked);
  add_rate(result, id + ".rerecorded", what + "the same with a memory recorded again that day",
           rerecorded.right, asked);
  add_rate(result, id + ".wrong", what + "answers farther off than one spacing, learning",
           with.wrong, asked);
  add_rate(result, id + ".wrong_without", what + "the same without learning", without.wrong, asked);
  if (!with.errors_m.empty() && !without.errors_m.empty()) {
    add_median(result, id + ".error", what + "error of positions, learning", "m", with.errors_m);
    add_median(result, id + ".error_without", what + "the same without learning", "m",
               without.errors_m);
  }
  add_row(result, id + ".views",
          name + ": views of the memory, most on any day, over those at first",
          static_cast<double>(max_views) / static_cast<double>(memory.size()), "",
          at_most(static_cast<double>(MemoryUpdateOptions{}.appearances)));
  result.rows.back().over = std::to_string(memory.size()) + " at first, " +
                            std::to_string(robot.added()) + " learnt, " +
                            std::to_string(robot.dropped()) + " dropped";
  add_plot(
      result, options.out, "days_" + name + ".svg",
      "Single pictures of " + name +
          " that are localised within one spacing, while objects move and light changes.",
      LinePlot{
          .x_label = "day", .y_label = "localised", .series = {with_learning, without_learning}});
  const auto astray = static_cast<std::size_t>(
      std::ranges::count_if(robot.errors_m(), [](double error_m) { return error_m > spacing_m; }));
  if (robot.added() > 0) {
    add_rate(result, id + ".astray", name + ": views learnt farther off than one spacing", astray,
             robot.added(), at_most(0.0));
  }
}

}  // namespace panonav
