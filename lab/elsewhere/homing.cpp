// Home vectors where home can be reached from the current view, and where it cannot.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "lab/runs/homing_run.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

constexpr double homing_radius_m = 1.5;
constexpr double arrival_radius_m = 0.1;

/// Result of a home vector between two views of one place.
struct HomeAnswer {
  std::optional<double> direction_error_rad;  ///< nullopt: no direction
  double probability = 0.0;
};

bool has_direction(const HomeAnswer& answer) {
  return answer.direction_error_rad.has_value();
}

bool has_direction(const HomingResult& home) {
  return home.direction_rad.has_value();
}

HomingResult compute_home(const Panorama& goal, const Panorama& current) {
  return HomingGuide(Observation(goal), PictureSource{}).home(Observation(current));
}

/// Returns the angle between `direction_rad`, in the frame of a robot at `from`, and the
/// direction of `to`.
double direction_error_rad(double direction_rad, const Pose2& from, const Pose2& to) {
  const double truth = std::atan2(to.y_m - from.y_m, to.x_m - from.x_m);
  return std::abs(angle_difference(direction_rad + from.heading_rad, truth));
}

HomeAnswer compute_home_answer(const simulation::PlacedView& goal,
                               const simulation::PlacedView& current) {
  const HomingResult home = compute_home(goal.panorama, current.panorama);
  HomeAnswer answer{std::nullopt, home.probability()};
  if (home.direction_rad) {
    answer.direction_error_rad = direction_error_rad(*home.direction_rad, current.pose, goal.pose);
  }
  return answer;
}

/// Makes white noise, smoothed along columns so that neighbouring pixels are similar.
Panorama make_noise(int rows, int columns, int smoothing_columns, std::uint64_t seed) {
  Random random(seed, 5);
  Panorama view(rows, columns, ElevationBand{radians(-30.0), radians(40.0)});
  std::vector<double> line(static_cast<std::size_t>(columns));
  for (int y = 0; y < rows; ++y) {
    for (double& value : line) value = random.uniform(0.0, 1.0);
    for (int c = 0; c < columns; ++c) {
      double sum = 0.0;
      for (int i = 0; i < smoothing_columns; ++i) {
        sum += line[static_cast<std::size_t>((c + i) % columns)];
      }
      view.at(y, c) = static_cast<float>(sum / smoothing_columns);
    }
  }
  return view;
}

std::vector<const simulation::PlacedView*> collect_views(const simulation::PlaceRecording& place) {
  std::vector<const simulation::PlacedView*> views;
  for (const simulation::PlacedView& view : place.references) views.push_back(&view);
  for (const simulation::PlacedView& view : place.queries) views.push_back(&view);
  return views;
}

/// Describes how the runs that do not reach home end, and how many runs of a level robot reach
/// home.
std::string explain_failures(const std::vector<HomingRun>& runs, std::size_t level_home) {
  std::size_t others = 0;
  std::size_t pointing_away = 0;
  std::size_t more_similar = 0;
  std::size_t falsely_arrived = 0;
  for (const HomingRun& run : runs) {
    if (run.is_success(arrival_radius_m)) continue;
    ++others;
    const double first_rad = run.vectors.front().direction_rad();
    pointing_away +=
        direction_error_rad(first_rad, run.path.front(), run.goal) > radians(90.0) ? 1 : 0;
    more_similar += run.end_difference < run.start_difference ? 1 : 0;
    falsely_arrived += run.end == HomingRunEnd::arrived ? 1 : 0;
  }
  return "a level robot comes home in " + std::to_string(level_home) + " of these " +
         std::to_string(runs.size()) + " runs; of the " + std::to_string(others) +
         " that do not come home, " + std::to_string(pointing_away) +
         " begin with a vector that points away from home, " + std::to_string(more_similar) +
         " end where the view is more like that of home than at the start, and " +
         std::to_string(falsely_arrived) + " say that they arrived";
}

/// Adds the rate of answers that have a direction. `Answer` is HomeAnswer or HomingResult.
template <class Answer>
void add_direction_rate(Reproduction& result, const std::string& id, const std::string& what,
                        const std::vector<Answer>& answers, std::optional<Target> target) {
  add_rate(result, id, what,
           count_where(answers, [](const Answer& answer) { return has_direction(answer); }),
           answers.size(), target);
}

/// A range of distances between two views.
struct DistanceRange {
  std::string id;
  double low_m;
  double high_m;
};

/// Two views of one ground; the home vector leads from `current` to `goal`.
struct ViewPair {
  const simulation::PlacedView* goal;
  const simulation::PlacedView* current;
  const RecordedGround* ground;
};

/// Measures home vectors between random views.
class HomeVectors {
 public:
  explicit HomeVectors(ElsewhereExperiments& elsewhere)
      : elsewhere_(elsewhere),
        random_(elsewhere.options.seed, 11),
        pair_count_(static_cast<std::size_t>(elsewhere.options.queries)) {}

  void measure_pairs_within(const DistanceRange& range) {
    const auto pairs = sample_pairs(range);
    const auto answers = simulation::make_each(
        elsewhere_.executor, pairs.size(),
        [&](std::size_t i) { return compute_home_answer(*pairs[i].goal, *pairs[i].current); });
    std::size_t off = 0;
    std::map<std::string, std::size_t> off_in;
    for (std::size_t i = 0; i < answers.size(); ++i) {
      const bool is_right =
          answers[i].direction_error_rad.value_or(std::numbers::pi) <= radians(45.0);
      if (has_direction(answers[i])) calibration_.add(answers[i].probability, is_right);
      if (!has_direction(answers[i]) || is_right) continue;
      ++off;
      ++off_in[pairs[i].ground->name];
    }
    const std::string id = "elsewhere.home." + range.id;
    const std::string what = "views " + format_centimetres(range.low_m) + " to " +
                             format_centimetres(range.high_m) + " apart, the straight line free: ";
    Reproduction& result = elsewhere_.result;
    add_direction_rate(result, id + ".answered", what + "home vectors with a direction", answers,
                       std::nullopt);
    const std::size_t answered =
        count_where(answers, [](const HomeAnswer& answer) { return has_direction(answer); });
    if (answered == 0) return;
    add_rate(result, id + ".off", what + "of these, off by more than 45 degrees", off, answered,
             at_most(0.05));
    std::string& reason = result.rows.back().reason;
    for (const auto& [name, count] : off_in) {
      reason +=
          (reason.empty() ? "by scene or world: " : ", ") + name + " " + std::to_string(count);
    }
  }

  void report_probability() const {
    if (calibration_.count() == 0) return;
    add_row(elsewhere_.result, "elsewhere.home.calibration",
            "views 10 cm to 600 cm apart: mean difference between the stated probability and the "
            "share of home vectors within 45 degrees, over five bins",
            calibration_.error(), "", at_most(0.05));
    ResultRow& row = elsewhere_.result.rows.back();
    row.over = std::to_string(calibration_.count()) + " home vectors";
    row.reason = calibration_.describe();
  }

  void measure_foreign_pairs() {
    std::vector<std::pair<const simulation::PlacedView*, const simulation::PlacedView*>> foreign;
    for (const RecordedGround& a : elsewhere_.grounds) {
      for (const RecordedGround& b : elsewhere_.grounds) {
        if (&a == &b) continue;
        const auto goals = collect_views(a.variants.front());
        const auto currents = collect_views(b.variants.front());
        for (std::size_t i = 0; i < pair_count_; i += 4)
          foreign.emplace_back(pick_random_view(goals), pick_random_view(currents));
      }
    }
    if (foreign.empty()) return;
    add_direction_rate(elsewhere_.result, "elsewhere.home.foreign",
                       "views of two scenes or worlds: home vectors with a direction",
                       simulation::make_each(elsewhere_.executor, foreign.size(),
                                             [&](std::size_t i) {
                                               return compute_home(foreign[i].first->panorama,
                                                                   foreign[i].second->panorama);
                                             }),
                       at_most(0.01));
  }

  void measure_noise_pairs(int smoothing_columns) const {
    const Panorama& like = elsewhere_.grounds.front().variants.front().references.front().panorama;
    const auto noise_of = [&](std::size_t seed) {
      return make_noise(like.rows(), like.columns(), smoothing_columns, seed);
    };
    add_direction_rate(
        elsewhere_.result, "elsewhere.home.noise_" + std::to_string(smoothing_columns),
        "noise" +
            (smoothing_columns > 1
                 ? " smoothed over " + std::to_string(smoothing_columns) + " columns"
                 : std::string()) +
            ": home vectors with a direction",
        simulation::make_each(
            elsewhere_.executor, pair_count_,
            [&](std::size_t i) { return compute_home(noise_of(2 * i), noise_of(2 * i + 1)); }),
        at_most(0.02));
  }

 private:
  const simulation::PlacedView* pick_random_view(
      const std::vector<const simulation::PlacedView*>& views) {
    return views[random_.index(views.size())];
  }

  std::vector<ViewPair> sample_pairs(const DistanceRange& range) {
    std::vector<ViewPair> pairs;
    for (const RecordedGround& ground : elsewhere_.grounds) {
      const auto& place = ground.variants.front();
      const auto views = collect_views(place);
      std::size_t tries = 0;
      for (std::size_t found = 0; found < pair_count_ && tries < 200 * pair_count_; ++tries) {
        const simulation::PlacedView* goal = pick_random_view(views);
        const simulation::PlacedView* current = pick_random_view(views);
        const double distance_m = distance(goal->pose.position(), current->pose.position());
        if (distance_m < range.low_m || distance_m >= range.high_m) continue;
        // Skip views behind a wall: they show another place.
        if (!place.free_space->is_free_between(goal->pose.position(), current->pose.position())) {
          continue;
        }
        pairs.push_back({goal, current, &ground});
        ++found;
      }
    }
    return pairs;
  }

  ElsewhereExperiments& elsewhere_;
  Random random_;
  std::size_t pair_count_;
  Calibration calibration_;  // of all ranges
};

}  // namespace

void ElsewhereExperiments::reproduce_home_vectors() {
  HomeVectors vectors(*this);
  for (const DistanceRange& range :
       {DistanceRange{"0_1m", 0.1, 1.0}, DistanceRange{"1_3m", 1.0, 3.0},
        DistanceRange{"3_6m", 3.0, 6.0}}) {
    vectors.measure_pairs_within(range);
  }
  vectors.report_probability();
  vectors.measure_foreign_pairs();
  for (const int smoothing_columns : {1, 16}) vectors.measure_noise_pairs(smoothing_columns);
}

void ElsewhereExperiments::reproduce_tilted_homing() {
  for (const std::string& name : list_ground_names()) {
    HomingPlace place = make_homing_place(
        simulation::make_or_read_scene(options.data, name, {.seed = options.seed}), {}, executor);
    const auto tasks = sample_homing_tasks(place, options.runs, homing_radius_m, options.seed);
    struct Condition {
      int tilt_deg;
      bool measured;
      std::optional<Target> target;
    };
    std::size_t level_home = 0;
    for (const auto& [tilt_deg, measured, target] : {Condition{0, false, std::nullopt},
                                                     {3, true, at_least(0.95)},
                                                     {6, true, at_least(0.9)},
                                                     {3, false, at_least(0.9)},
                                                     {6, false, std::nullopt}}) {
      place.camera.frame.tilt_rad = radians(tilt_deg);
      place.camera.levelled = measured;
      const auto runs = run_home(place, tasks, {}, options.seed, executor);
      const auto home =
          count_where(runs, [](const HomingRun& run) { return run.is_success(arrival_radius_m); });
      if (tilt_deg == 0) level_home = home;
      std::string how = "level robot";
      if (tilt_deg > 0) {
        how = "tilt of " + std::to_string(tilt_deg) +
              " degrees in a random direction at each view, " + (measured ? "" : "not ") +
              "measured";
      }
      add_rate(
          result,
          "elsewhere.tilt." + name + "." + std::to_string(tilt_deg) + (measured ? "_measured" : ""),
          name + ", starts within " + format_centimetres(homing_radius_m) + ", " + how +
              ": home within " + format_centimetres(arrival_radius_m),
          home, runs.size(), target);
      result.rows.back().reason = explain_failures(runs, level_home);
    }
  }
}

}  // namespace panonav::lab
