// Prints the share of positions within the stated radius in grids and drives through built-in
// scenes, with two spacings each, in pictures as they are and in small pictures full of noise,
// queried at random positions of the grid, inside and outside an edge of it, on the drive and up to
// 1 m beside it, as memorised and with less light and a tenth hidden. Nothing of the radius is
// learnt in other places. Then learns the coefficients of `bound_terms` along the drives (quantile
// regression with equal weights of all memories), and prints them and the share of errors within
// these bounds for each kind of scene, by coefficients that were learnt without it. About ten
// minutes.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "lab/runs/place_experiment.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/localisation/position_model.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/recording.hpp"

namespace {

using namespace panonav;

constexpr std::array scenes{"office", "hall", "lab", "loop", "garden"};
constexpr std::array grid_spacings_m{0.3, 0.5};
constexpr std::array drive_spacings_m{0.1, 0.25};
constexpr std::array lateral_offsets_m{0.0, 0.1, 0.2, 0.3, 0.5, 1.0};
constexpr std::size_t queries_of_grid = 120;
constexpr std::size_t queries_of_offset = 40;
constexpr int seeds = 2;
/// Quantile of the regression. A scene that was not learnt from differs, so a little more than 95 %
/// is needed for 95 % of its errors.
constexpr double quantile_share = 0.96;

struct Pictures {
  const char* name;
  int rows;
  int columns;
  double read_noise;
};
constexpr std::array picture_kinds{Pictures{"clean", 48, 256, 0.004},
                                   Pictures{"noisy", 10, 96, 0.12}};

using Terms = Eigen::Matrix<double, bound_term_count, 1>;
/// Errors in metres of the positions of a group of queries.
struct Group {
  std::vector<double> errors_m;
  std::vector<double> radii_m;
};
using Groups = std::map<std::string, Group>;

/// An error along a drive.
struct Sample {
  Terms terms;
  double log_error = 0.0;  // in spacings
  std::string scene;
  std::string memory;
};

struct Query {
  Pose2 pose;
  PackedSignature signature;
};

std::vector<Query> take_queries(const simulation::PlaceRecording& place, const VisualMemory& memory,
                                const std::vector<Pose2>& poses, const Pictures& pictures,
                                Executor& executor) {
  return simulation::make_each(executor, 2 * poses.size(), [&](std::size_t i) {
    simulation::SensorOptions sensor;
    if (i % 2 == 1) sensor = lab::place_conditions()[1].sensor;
    sensor.read_noise = pictures.read_noise;
    const Pose2& pose = poses[i / 2];
    return Query{pose, lab::compute_packed_signature(
                           simulation::capture_view(place, place.rendering, pose,
                                                    place.seed * 1000003 + i, sensor),
                           memory)};
  });
}

std::vector<Pose2> poses_beside(const simulation::PlaceRecording& place, Random& random) {
  std::vector<Pose2> poses;
  for (const double offset_m : lateral_offsets_m) {
    for (std::size_t i = 0; i < queries_of_offset; ++i) {
      const std::size_t n = random.index(place.references.size() - 1);
      const Pose2 a = place.references[n].pose;
      const Point2 b = place.references[n + 1].pose.position();
      const double share = random.uniform();
      const double direction = std::atan2(b.y_m - a.y_m, b.x_m - a.x_m);
      const double side_m = random.uniform() < 0.5 ? -offset_m : offset_m;
      const Pose2 pose{a.x_m + share * (b.x_m - a.x_m) - side_m * std::sin(direction),
                       a.y_m + share * (b.y_m - a.y_m) + side_m * std::cos(direction),
                       random.uniform(-3.1, 3.1)};
      if (place.free_space->is_free(pose.position()) &&
          place.free_space->is_free_between(a.position(), pose.position())) {
        poses.push_back(pose);
      }
    }
  }
  return poses;
}

void add_samples(const simulation::PlaceRecording& place, const std::string& scene,
                 const std::string& name, const std::vector<Pose2>& poses, const Pictures& pictures,
                 bool is_drive, Executor& executor, Groups& groups, std::vector<Sample>& samples) {
  const VisualMemory memory = lab::make_memory_of_references(place, executor);
  const Localiser localiser(memory);
  const PositionModel& model = localiser.position_model();
  const ReferenceLayout layout(memory, model.spacing_m);
  if (!model.learnt) return;
  for (const Query& query : take_queries(place, memory, poses, pictures, executor)) {
    const Place found = localiser.localise(query.signature);
    if (!found.known || !found.position) continue;
    const ViewId best = found.position->shares.front().view;
    const Point2 near = memory.info(best).pose->position();
    const Point2 truth = query.pose.position();
    const auto match = std::ranges::find(found.matches, best, &PlaceMatch::view);
    // A place that was taken for another is not a matter of precision.
    if (match == found.matches.end() || distance(near, truth) > 3.0 * model.spacing_m + 1.0) {
      continue;
    }
    const Point2 error{found.position->x_m - truth.x_m, found.position->y_m - truth.y_m};
    if (found.position->radius_m) {
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const simulation::PlacedView& view : place.references) {
        nearest_m = std::min(nearest_m, distance(view.pose.position(), truth));
      }
      const double bin_m = 0.2 * std::round(5.0 * nearest_m);
      for (const std::string& name_of_group :
           {std::string(is_drive ? "drives" : "grids"),
            std::string(is_drive ? "drives, " : "grids, ") + pictures.name + ", nearest view at " +
                to_text(bin_m) + " m"}) {
        groups[name_of_group].errors_m.push_back(std::hypot(error.x_m, error.y_m));
        groups[name_of_group].radii_m.push_back(*found.position->radius_m);
      }
    }
    const LocalLayout local = layout.around({near, {}});
    if (local.kind != LocalLayout::Kind::line) continue;
    const auto terms = bound_terms(model, match->column_difference);
    if (!terms) continue;
    const double error_m = std::abs(error.x_m * std::cos(local.direction_rad) +
                                    error.y_m * std::sin(local.direction_rad));
    samples.push_back({Eigen::Map<const Terms>(terms->data()),
                       std::log(std::max(1e-3, error_m / model.spacing_m)), scene, name});
  }
}

void add_grid(const std::string& scene, std::uint64_t seed, double spacing_m,
              const Pictures& pictures, Executor& executor, Groups& groups,
              std::vector<Sample>& samples) {
  simulation::PlaceRecording place = simulation::record_place({.scene = scene,
                                                               .seed = seed,
                                                               .spacing_m = spacing_m,
                                                               .queries = 1,
                                                               .rows = pictures.rows,
                                                               .columns = pictures.columns},
                                                              executor);
  std::vector<Pose2> poses;
  for (const simulation::PlacedView& view : place.references) poses.push_back(view.pose);
  place.references = simulation::capture_views(place, place.rendering, poses, 7919 * seed,
                                               {.read_noise = pictures.read_noise}, executor);
  Random random(seed, 77);
  std::vector<Pose2> queries(queries_of_grid);
  for (Pose2& pose : queries) pose = place.free_space->random_pose(random);
  const std::string name = scene + std::to_string(seed) + pictures.name + to_text(spacing_m);
  add_samples(place, scene, name, queries, pictures, false, executor, groups, samples);
  // The same without the part of the grid beyond a straight edge.
  std::vector<double> columns_m;
  for (const Pose2& pose : poses) columns_m.push_back(pose.x_m);
  const double edge_m = order_statistic(columns_m, 0.7);
  std::erase_if(place.references, [&](const simulation::PlacedView& view) {
    return view.pose.x_m > edge_m + 0.1 * spacing_m;
  });
  std::erase_if(poses,
                [&](const Pose2& pose) { return std::abs(pose.x_m - edge_m) > 0.1 * spacing_m; });
  for (Pose2& pose : queries) {
    const Pose2& edge = poses[random.index(poses.size())];
    do {
      pose = {edge.x_m + random.uniform(-0.5, 1.0) * spacing_m,
              edge.y_m + random.uniform(-0.5, 0.5) * spacing_m, random.uniform(-3.1, 3.1)};
    } while (!place.free_space->is_free(pose.position()));
  }
  add_samples(place, scene, name, queries, pictures, false, executor, groups, samples);
}

void add_drive(const std::string& scene, std::uint64_t seed, double spacing_m,
               const Pictures& pictures, Executor& executor, Groups& groups,
               std::vector<Sample>& samples) {
  simulation::PlaceRecording place;
  static_cast<simulation::SimulatedPlace&>(place) =
      simulation::make_place(simulation::make_scene(scene, {.seed = seed}), executor);
  place.seed = seed;
  place.rendering.rows = pictures.rows;
  place.rendering.columns = pictures.columns;
  Random random(seed, 5);
  std::vector<Point2> way;
  while (way.size() < 3) {
    const Point2 next = place.free_space->random_pose(random).position();
    if (way.empty() || distance(next, way.back()) > 2.0) way.push_back(next);
  }
  std::vector<Pose2> poses;
  for (const simulation::RecordedPose& pose :
       simulation::plan_recording(place.scene, *place.free_space,
                                  {.path = simulation::RecordingPath::tour,
                                  .heading = simulation::RecordingHeading::path,
                                  .spacing_m = spacing_m},
                                  {}, seed, way)) {
    poses.push_back(pose.pose);
  }
  place.references = simulation::capture_views(place, place.rendering, poses, 7919 * seed,
                                               {.read_noise = pictures.read_noise}, executor);
  add_samples(place, scene, scene + std::to_string(seed) + pictures.name + to_text(spacing_m),
              poses_beside(place, random), pictures, true, executor, groups, samples);
}

// Quantile regression by iteratively reweighted least squares.
Terms learn(const std::vector<Sample>& samples) {
  std::map<std::string, double> counts;
  for (const Sample& sample : samples) counts[sample.memory] += 1.0;
  constexpr double min_residual = 1e-3;
  Terms learnt = Terms::Zero();
  for (int step = 0; step < 300; ++step) {
    Eigen::Matrix<double, bound_term_count, bound_term_count> left =
        1e-9 * decltype(left)::Identity();
    Terms right = Terms::Zero();
    for (const Sample& sample : samples) {
      const double residual = sample.log_error - learnt.dot(sample.terms);
      const double side =
          step == 0 ? 1.0 : (residual > 0.0 ? quantile_share : 1.0 - quantile_share);
      const double size = step == 0 ? 1.0 : std::max(min_residual, std::abs(residual));
      const double weight = side / size / counts[sample.memory];
      left += weight * sample.terms * sample.terms.transpose();
      right += weight * sample.log_error * sample.terms;
    }
    learnt = left.ldlt().solve(right);
  }
  return learnt;
}

void report(const char* title, const std::vector<Sample>& samples) {
  const Terms learnt = learn(samples);
  std::printf("%s:", title);
  for (const double weight : learnt) std::printf(" %.2f", weight);
  std::printf("\n");
  for (const std::string scene : scenes) {
    std::vector<Sample> rest;
    std::ranges::copy_if(samples, std::back_inserter(rest),
                         [&](const Sample& sample) { return sample.scene != scene; });
    const Terms without = learn(rest);
    std::map<std::string, std::array<int, 2>> counts;  // all, within the bound
    for (const Sample& sample : samples) {
      if (sample.scene != scene) continue;
      for (const std::string& group : {sample.memory, " all of " + scene}) {
        ++counts[group][0];
        counts[group][1] += sample.log_error <= without.dot(sample.terms) ? 1 : 0;
      }
    }
    for (const auto& [group, count] : counts) {
      std::printf("  %-24s %.3f of %d\n", group.c_str(), static_cast<double>(count[1]) / count[0],
                  count[0]);
    }
  }
}

}  // namespace

int main() {
  Executor executor;
  Groups groups;
  std::vector<Sample> samples;
  for (const std::string scene : scenes) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      for (const Pictures& pictures : picture_kinds) {
        for (const double spacing_m : grid_spacings_m) {
          add_grid(scene, seed, spacing_m, pictures, executor, groups, samples);
        }
        for (const double spacing_m : drive_spacings_m) {
          add_drive(scene, seed, spacing_m, pictures, executor, groups, samples);
        }
      }
      std::fprintf(stderr, "%s %d\n", scene.c_str(), static_cast<int>(seed));
    }
  }
  for (const auto& [name, group] : groups) {
    std::size_t within = 0;
    for (std::size_t i = 0; i < group.errors_m.size(); ++i) {
      within += group.errors_m[i] <= group.radii_m[i] ? 1 : 0;
    }
    std::printf("%-40s within the radius %.3f of %zu; median error %.3f m, radius %.3f m\n",
                name.c_str(),
                static_cast<double>(within) / static_cast<double>(group.errors_m.size()),
                group.errors_m.size(), quantile(group.errors_m, 0.5), quantile(group.radii_m, 0.5));
  }
  report("along drives", samples);
  return 0;
}
