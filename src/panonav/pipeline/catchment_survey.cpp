#include "panonav/pipeline/catchment_survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/geometry/voronoi.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav {

namespace {

// Tolerance for distances, so that rounding of coordinates does not decide whether a pair is used.
constexpr double distance_tolerance_m = 1e-6;

/// Home vector of a pair, without its quality.
struct PairVector {
  float xi = 0.0F;
  float eta = 0.0F;
  float heading_rad = 0.0F;
};

std::vector<Pose2> to_robot_poses(const RecordedViews& views) {
  std::vector<Pose2> poses;
  for (std::size_t i = 0; i < views.views.size(); ++i) {
    if (!views.poses[i] || !views.poses[i]->heading_rad) {
      throw ContractError("pose of " + views.files[i], "not known", "a position and a heading");
    }
    const ReferencePose& pose = *views.poses[i];
    poses.push_back({pose.x_m, pose.y_m, wrap_angle(*pose.heading_rad + views.rotation_rad[i])});
  }
  return poses;
}

std::vector<PairVector> compute_home_vectors(const RecordedViews& goals,
                                             const RecordedViews& places,
                                             const FourierHomingOptions& homing,
                                             const std::string& work, Executor& executor,
                                             const WorkProgress& progress) {
  const std::size_t count = places.views.size();
  std::vector<PairVector> vectors(goals.views.size() * count);
  const std::size_t batch = 4 * static_cast<std::size_t>(executor.threads());
  if (progress) progress(work, 0, goals.views.size());
  for (std::size_t begin = 0; begin < goals.views.size(); begin += batch) {
    const std::size_t many = std::min(batch, goals.views.size() - begin);
    executor.for_each_chunk(many, 1, [&](std::size_t i, std::size_t, std::size_t) {
      const HomingView& home = goals.views[begin + i];
      for (std::size_t p = 0; p < count; ++p) {
        const HomeVector found = home_vector(home, places.views[p], homing);
        vectors[(begin + i) * count + p] = {static_cast<float>(found.xi),
                                            static_cast<float>(found.eta),
                                            static_cast<float>(found.heading_rad)};
      }
    });
    if (progress) progress(work, many, goals.views.size());
  }
  return vectors;
}

/// Estimates the metres per unit of home vector length: median ratio over nearby pairs.
double estimate_typical_distance_m(const std::vector<Pose2>& goals,
                                   const std::vector<Pose2>& places,
                                   const std::vector<PairVector>& vectors, double near_m) {
  std::vector<double> ratios;
  for (std::size_t g = 0; g < goals.size(); ++g) {
    for (std::size_t p = 0; p < places.size(); ++p) {
      const double off_m = distance(goals[g].position(), places[p].position());
      const PairVector& found = vectors[g * places.size() + p];
      const double length = std::hypot(found.xi, found.eta);
      if (off_m > distance_tolerance_m && off_m <= near_m + distance_tolerance_m && length > 0.0) {
        ratios.push_back(off_m / length);
      }
    }
  }
  if (ratios.empty()) return near_m;
  return std::clamp(upper_median_in_place(std::span(ratios)), 1e-3, 1e3);
}

/// Sums of unit vectors of heading errors.
struct ErrorSum {
  double cosine = 0.0;
  double sine = 0.0;
  std::size_t count = 0;
  void add(double error_rad) {
    cosine += std::cos(error_rad);
    sine += std::sin(error_rad);
    ++count;
  }
  [[nodiscard]] double compute_deviation() const {
    if (count == 0) return std::numeric_limits<double>::quiet_NaN();
    const double length = std::hypot(cosine, sine) / static_cast<double>(count);
    return std::sqrt(std::max(0.0, -2.0 * std::log(length)));
  }
};

void summarise_pairs(const std::vector<PairVector>& vectors, const CatchmentSettings& settings,
                     CatchmentResult& result) {
  const HomingSurvey& survey = result.survey;
  const double bin_m = settings.bin_m.value_or(result.spacing_m);
  const double max_m = settings.up_to_m.value_or(std::numeric_limits<double>::infinity());
  const auto homeward = homeward_by_distance(survey, bin_m);
  std::vector<ErrorSum> errors(homeward.size());
  ErrorSum all;
  for (std::size_t g = 0; g < survey.goals.size(); ++g) {
    for (std::size_t p = 0; p < survey.places.size(); ++p) {
      const Pose2& goal = survey.goals[g];
      const Pose2& place = survey.places[p];
      const double off_m = distance(goal.position(), place.position());
      if (off_m <= distance_tolerance_m) continue;
      const double error = static_cast<double>(vectors[g * survey.places.size() + p].heading_rad) -
                           (goal.heading_rad - place.heading_rad);
      const auto bin = static_cast<std::size_t>(std::lround(off_m / bin_m));
      if (bin < errors.size()) errors[bin].add(error);
      if (off_m <= max_m + distance_tolerance_m) all.add(error);
    }
  }
  for (std::size_t i = 0; i < homeward.size(); ++i) {
    if (homeward[i].pairs == 0) continue;
    result.bins.push_back({homeward[i], errors[i].compute_deviation()});
  }
  result.pairs = all.count;
  result.orientation_error_rad = all.compute_deviation();
  result.component = mean_homeward_component(survey, max_m + distance_tolerance_m);
}

}  // namespace

RecordedViews read_views(const Dataset& recording, const HomingViewOptions& options,
                         const std::optional<std::uint64_t>& rotation_seed, Executor& executor,
                         const WorkProgress& progress,
                         const std::function<void(const std::exception_ptr&)>& skip) {
  struct RotatedView {
    HomingView view;
    double rotation_rad = 0.0;
  };
  const HomingEncoder encoder(recording.source, options);
  const std::size_t total = recording.entries.size();
  RecordedViews result;
  if (progress) progress("reading", 0, total);
  process_in_order(
      total, executor,
      [&](std::size_t index) {
        Panorama panorama = encoder.panorama(read_observation(recording.entries[index]));
        double rotation_rad = 0.0;
        if (rotation_seed) {
          Random random(*rotation_seed, index);
          const auto columns = static_cast<std::uint64_t>(panorama.columns());
          const auto rotation_columns = static_cast<int>(random.index(columns));
          panorama = rotate_columns(panorama, rotation_columns);
          rotation_rad =
              wrap_angle(2.0 * std::numbers::pi * rotation_columns / static_cast<double>(columns));
        }
        return RotatedView{encoder.view(panorama), rotation_rad};
      },
      [&](std::size_t index, RotatedView&& rotated) {
        const DatasetEntry& entry = recording.entries[index];
        HomingView& view = rotated.view;
        if (!result.views.empty() && view.rows() != result.views.front().rows()) {
          throw FileError(entry.path.string(),
                          "rows is " + std::to_string(view.rows()) +
                              "; allowed: " + std::to_string(result.views.front().rows()) +
                              ", as in " + result.files.front());
        }
        result.files.push_back(entry.file);
        result.poses.push_back(entry.pose);
        result.rotation_rad.push_back(rotated.rotation_rad);
        result.views.push_back(std::move(view));
        if (progress) progress("reading", 1, total);
      },
      [&](std::size_t, const std::exception_ptr& failure) {
        if (!skip) std::rethrow_exception(failure);
        skip(failure);
        if (progress) progress("reading", 1, total);
      });
  return result;
}

CatchmentResult survey_catchment(const RecordedViews& goals, const RecordedViews& places,
                                 const CatchmentSettings& settings, const std::string& name,
                                 Executor& executor, const WorkProgress& progress) {
  CatchmentResult result;
  const auto goal_poses = to_robot_poses(goals);
  const auto place_poses = to_robot_poses(places);
  result.spacing_m = VoronoiCells(positions_of(place_poses)).spacing_m();
  if (!(result.spacing_m > 0.0)) throw FileError(name, "has no two places that differ");
  const auto vectors =
      compute_home_vectors(goals, places, settings.homing, "homing", executor, progress);

  result.run = settings.run;
  const double near_m = 3.0 * result.spacing_m;
  result.typical_distance_m = estimate_typical_distance_m(goal_poses, place_poses, vectors, near_m);
  if (settings.has_typical_distance) {
    result.typical_distance_m = settings.run.typical_distance_m;
  }
  result.run.typical_distance_m = result.typical_distance_m;
  if (!settings.has_longest_step) result.run.max_step_m = 2.0 * result.spacing_m;
  if (!settings.has_obstacle) result.run.obstacle_m = 0.8 * result.spacing_m;
  const auto surveyed = [&](const std::vector<PairVector>& all) {
    const HomingRule known = [&](std::size_t goal, std::size_t place) {
      const PairVector& found = all[goal * place_poses.size() + place];
      HomeVector vector;
      vector.xi = static_cast<double>(found.xi);
      vector.eta = static_cast<double>(found.eta);
      return vector;
    };
    return survey_homing(goal_poses, place_poses, known, result.run, executor);
  };
  result.survey = surveyed(vectors);
  summarise_pairs(vectors, settings, result);

  std::vector<HomingSurvey> staged;
  for (const int highest : settings.stages) {
    FourierHomingOptions stage = settings.homing;
    stage.highest = highest;
    staged.push_back(surveyed(compute_home_vectors(
        goals, places, stage, "stage K = " + std::to_string(highest), executor, progress)));
  }
  std::vector<const HomingSurvey*> stages;
  for (const HomingSurvey& stage : staged) stages.push_back(&stage);
  if (stages.empty()) stages.push_back(&result.survey);
  result.final_m = final_distances(stages, result.run, executor);
  for (const double many : {0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0}) {
    result.accepted_m.push_back(many * result.spacing_m);
  }
  result.areas = mean_catchment_areas(result.final_m, goal_poses.size(), result.accepted_m);
  return result;
}

std::size_t count_places_in_catchment(const CatchmentResult& result, std::size_t goal,
                                      double accepted_m) {
  const std::size_t count = result.survey.places.size();
  const auto ends = std::span(result.final_m).subspan(goal * count, count);
  return static_cast<std::size_t>(std::ranges::count_if(ends, [&](float end_m) {
    return static_cast<double>(end_m) <= accepted_m + distance_tolerance_m;
  }));
}

}  // namespace panonav
