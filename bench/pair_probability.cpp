// Learns the numbers of `PairFeatures` and `PairEvidence` and prints them, and what they achieve in
// buildings that are left out: built-in scenes (three variants of each), and from the folder
// PANONAV_DATA three Gazebo worlds and four recordings. Pairs of views in one building, up to 6 m
// apart, also behind walls, and foreign pairs of views in two buildings. Some five minutes.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/relative_pose/pair_evidence.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/place_recording.hpp"
#include "panonav_simulation/worlds.hpp"

namespace {

using namespace panonav;

constexpr std::array<double, 6> ranges_m{0.1, 0.5, 1.0, 2.0, 3.0, 6.0};
constexpr int range_count = 5;
constexpr int components = 15;
constexpr double max_direction_error_rad = std::numbers::pi / 4.0;
constexpr double max_turn_error_rad = 0.35;  // of pairs from which deviations are learnt
constexpr double max_known_foreign = 0.005;  // share of foreign pairs that are taken for related

struct View {
  HomingView view;
  std::optional<ReferencePose> pose;
};
struct Building {
  std::string kind;  // variants of one scene are of one kind; never foreign to each other
  std::vector<View> views;
  std::vector<std::array<std::size_t, 2>> pairs;  // home, current
};
struct Sample {
  PairFeatures features;
  std::string home_kind, current_kind;
  int range = -1;  // -1: a foreign pair
  double distance_m = 0.0, direction_error_rad = 0.0, turn_error_rad = 0.0;

  [[nodiscard]] bool is_foreign() const { return range < 0; }
  [[nodiscard]] bool is_right() const {
    return !is_foreign() && direction_error_rad <= max_direction_error_rad;
  }
  [[nodiscard]] bool is_of(const std::string& kind) const {
    return home_kind == kind || current_kind == kind;
  }
};

int find_range(double distance_m) {
  for (int range = range_count - 1; range >= 0; --range) {
    if (distance_m >= ranges_m[static_cast<std::size_t>(range)]) return range;
  }
  return 0;
}

/// Renders random views, and two views in each range of distances from each of them. Light and
/// occluders of every fourth view differ.
Building render_building(const std::filesystem::path& data, const std::string& kind,
                         const std::string& scene, std::uint64_t seed, Executor& executor) {
  constexpr int anchors = 20;
  constexpr int max_tries = 300;
  const auto place = simulation::make_place(
      simulation::make_or_read_scene(data, scene, {.seed = 100 + seed}), executor);
  Random random(seed, 77);
  std::vector<Pose2> poses;
  Building building{.kind = kind};
  for (int anchor = 0; anchor < anchors; ++anchor) {
    const std::size_t home = poses.size();
    const Pose2 middle = place.free_space->random_pose(random);
    poses.push_back(middle);
    for (std::size_t i = 0; i < 2 * range_count; ++i) {
      for (int tries = 0; tries < max_tries; ++tries) {
        const double distance_m = random.uniform(ranges_m[i / 2], ranges_m[i / 2 + 1]);
        const double direction_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
        const Pose2 pose{middle.x_m + distance_m * std::cos(direction_rad),
                         middle.y_m + distance_m * std::sin(direction_rad),
                         random.uniform(-std::numbers::pi, std::numbers::pi)};
        if (!place.free_space->is_free(pose.position())) continue;
        building.pairs.push_back({home, poses.size()});
        if (i % 2 == 1) std::swap(building.pairs.back()[0], building.pairs.back()[1]);
        poses.push_back(pose);
        break;
      }
    }
  }
  const auto views = simulation::make_each(executor, poses.size(), [&](std::size_t i) {
    Executor here(1);
    simulation::SensorOptions sensor;
    Random light(seed, 1000 + i);
    if (i % 4 == 1) {
      sensor.exposure = light.uniform(0.6, 1.3);
      sensor.directional_light = light.uniform(0.0, 0.2);
      sensor.occluded_fraction = light.uniform(0.0, 0.08);
    }
    return homing_view(compute_signature(
        apply_sensor(place.renderer->render_panorama(
                         {.pose = poses[i], .height_m = place.scene.camera_height_m},
                         {.rows = 40, .columns = 256, .rays_per_axis = 2}, here),
                     sensor, i),
        components));
  });
  for (std::size_t i = 0; i < poses.size(); ++i) {
    building.views.push_back(
        {views[i], ReferencePose{poses[i].x_m, poses[i].y_m, poses[i].heading_rad}});
  }
  return building;
}

/// Reads every `every`-th image of a recording; pairs of views if it has headings, at most 500.
Building read_building(const std::filesystem::path& folder, std::size_t every) {
  const Dataset dataset = read_dataset(folder);
  const bool is_scaled = dataset.source.kind == PictureKind::equirectangular;
  const PanoramaReader reader(dataset.source, is_scaled ? PanoramaShape{40, 256} : PanoramaShape{});
  Building building{.kind = folder.filename()};
  Random random(5, 5);
  for (std::size_t i = 0; i < dataset.entries.size(); i += every) {
    const DatasetEntry& entry = dataset.entries[i];
    // Turned at random, as robots are.
    const double turn_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    auto pose = entry.pose;
    if (pose && pose->heading_rad) *pose->heading_rad += turn_rad;
    building.views.push_back(
        {rotate(homing_view(compute_signature(reader.read(entry.path), components)), turn_rad),
         pose});
  }
  std::vector<std::array<std::size_t, 2>> all;
  for (std::size_t i = 0; i < building.views.size(); ++i) {
    for (std::size_t j = 0; j < building.views.size(); ++j) {
      const auto& a = building.views[i].pose;
      const auto& b = building.views[j].pose;
      if (i == j || !a || !b || !a->heading_rad || !b->heading_rad) continue;
      const double distance_m = distance(a->position(), b->position());
      if (distance_m > 0.05 && distance_m < 4.0) all.push_back({i, j});
    }
  }
  constexpr std::size_t max_pairs = 500;
  for (std::size_t i = 0; i < std::min(all.size(), max_pairs); ++i) {
    std::swap(all[i], all[i + random.index(all.size() - i)]);
    building.pairs.push_back(all[i]);
  }
  return building;
}

std::vector<Building> make_buildings(const std::filesystem::path& data, Executor& executor) {
  std::vector<Building> buildings;
  const auto add = [&](const std::string& kind, const std::string& scene, int variants) {
    if (!simulation::has_scene(data, scene)) return;
    for (int seed = 1; seed <= variants; ++seed) {
      buildings.push_back(
          render_building(data, kind, scene, static_cast<std::uint64_t>(seed), executor));
    }
  };
  for (const char* scene : {"office", "hall", "lab", "loop", "corridor", "garden"}) {
    add(scene, scene, 3);
  }
  add("hall", "hall_periodic", 2);
  for (const char* world : {"small_warehouse", "small_house", "industrial_warehouse"}) {
    add(world, world, 2);
  }
  for (const auto& [name, every] : {std::pair("ciirc_b670", 1), std::pair("indoor_walk_360", 2),
                                    std::pair("gantry_plants", 1)}) {
    if (simulation::has_data(data, name)) {
      buildings.push_back(read_building(data / name, static_cast<std::size_t>(every)));
    }
  }
  return buildings;
}

Sample make_sample(const Building& a, std::size_t home, const Building& b, std::size_t current) {
  const View& goal = a.views[home];
  const View& here = b.views[current];
  Sample sample{compute_pair_features(goal.view, here.view), a.kind, b.kind};
  if (&a != &b) return sample;
  const double x_m = goal.pose->x_m - here.pose->x_m;
  const double y_m = goal.pose->y_m - here.pose->y_m;
  const HomeVector& vector = sample.features.vector;
  sample.distance_m = std::hypot(x_m, y_m);
  sample.range = find_range(sample.distance_m);
  sample.direction_error_rad =
      std::abs(wrap_angle(vector.direction_rad() + *here.pose->heading_rad - std::atan2(y_m, x_m)));
  sample.turn_error_rad =
      std::abs(wrap_angle(vector.heading_rad - *goal.pose->heading_rad + *here.pose->heading_rad));
  return sample;
}

std::vector<Sample> compare_views(const std::vector<Building>& buildings, Executor& executor) {
  std::vector<std::function<Sample()>> tasks;
  Random random(9, 9);
  for (const Building& a : buildings) {
    for (const auto& pair : a.pairs) {
      tasks.emplace_back([&a, pair] { return make_sample(a, pair[0], a, pair[1]); });
    }
    for (const Building& b : buildings) {
      if (a.kind == b.kind || a.views[0].view.rows() != b.views[0].view.rows()) continue;
      for (int i = 0; i < 4; ++i) {
        const std::size_t home = random.index(a.views.size());
        const std::size_t current = random.index(b.views.size());
        tasks.emplace_back([&a, &b, home, current] { return make_sample(a, home, b, current); });
      }
    }
  }
  return simulation::make_each(executor, tasks.size(), [&](std::size_t i) { return tasks[i](); });
}

/// Log-odds: the first number is added to the products of the others with the terms.
using Model = Eigen::VectorXd;
using Terms = std::vector<double>;

double log_odds(const Model& model, const Terms& terms) {
  double sum = model(0);
  for (std::size_t i = 0; i < terms.size(); ++i) sum += model(static_cast<int>(i) + 1) * terms[i];
  return sum;
}
double logistic(double z) {
  return 1.0 / (1.0 + std::exp(-z));
}
Terms gate_terms(const Sample& sample) {
  return {sample.features.deviations_over_noise,
          std::log(sample.features.magnitude_difference + 0.01)};
}
Terms direction_terms(const Sample& sample) {
  const auto terms = sample.features.direction_terms();
  return {terms.begin(), terms.end()};
}

struct Example {
  Terms terms;
  bool is_true;
  double weight;
};

/// Logistic regression by Newton's rule with a weak prior.
Model fit(const std::vector<Example>& examples) {
  const auto size = static_cast<int>(examples.front().terms.size()) + 1;
  Model model = Model::Zero(size);
  double weights = 0.0;
  for (const Example& example : examples) weights += example.weight;
  for (int iteration = 0; iteration < 30; ++iteration) {
    constexpr double prior = 1e-4;
    Eigen::MatrixXd curvature = Eigen::MatrixXd::Identity(size, size) * prior * weights;
    Model slope = -prior * weights * model;
    for (const Example& example : examples) {
      Model row(size);
      row(0) = 1.0;
      for (int i = 1; i < size; ++i) row(i) = example.terms[static_cast<std::size_t>(i) - 1];
      const double p = logistic(log_odds(model, example.terms));
      slope += example.weight * ((example.is_true ? 1.0 : 0.0) - p) * row;
      curvature += example.weight * p * (1.0 - p) * row * row.transpose();
    }
    const Model step = curvature.ldlt().solve(slope);
    model += step;
    if (step.norm() < 1e-9) break;
  }
  return model;
}

/// Both models, and the log-odds from which on views are taken for related.
struct Learnt {
  Model gate, direction;
  double min_gate = 0.0;

  [[nodiscard]] bool is_related(const Sample& sample) const {
    constexpr double min_over_noise = 1.645;  // as PairFeatures::is_related
    return sample.features.deviations_over_noise > min_over_noise &&
           log_odds(gate, gate_terms(sample)) > min_gate;
  }
  [[nodiscard]] bool is_answered(const Sample& sample) const {
    return is_related(sample) && sample.features.vector.has_direction();
  }
  [[nodiscard]] double probability(const Sample& sample) const {
    return logistic(log_odds(direction, direction_terms(sample)));
  }
};

/// Learns from all pairs without a view of the kind `left_out`. Kinds and ranges of distances count
/// equally.
Learnt learn(const std::vector<Sample>& samples, const std::string& left_out) {
  constexpr double near_m = 2.0;
  const auto is_for_gate = [&](const Sample& sample) {
    return sample.is_foreign() || (sample.is_right() && sample.distance_m <= near_m);
  };
  std::map<std::pair<std::string, int>, double> counts;
  std::map<std::pair<std::string, bool>, double> gate_counts;
  for (const Sample& sample : samples) {
    counts[{sample.home_kind, sample.range}] += 1.0;
    if (is_for_gate(sample)) gate_counts[{sample.home_kind, sample.is_foreign()}] += 1.0;
  }
  std::vector<Example> gate, direction;
  for (const Sample& sample : samples) {
    if (sample.is_of(left_out)) continue;
    if (is_for_gate(sample)) {
      gate.push_back({gate_terms(sample), !sample.is_foreign(),
                      1.0 / gate_counts[{sample.home_kind, sample.is_foreign()}]});
    }
    if (!sample.is_foreign()) {
      direction.push_back({direction_terms(sample), sample.is_right(),
                           1.0 / std::max(10.0, counts[{sample.home_kind, sample.range}])});
    }
  }
  Learnt learnt{fit(gate), fit(direction)};
  std::vector<double> foreign;
  for (const Example& example : gate) {
    if (!example.is_true) foreign.push_back(log_odds(learnt.gate, example.terms));
  }
  std::ranges::sort(foreign, std::greater<>());
  learnt.min_gate =
      foreign[static_cast<std::size_t>(max_known_foreign * static_cast<double>(foreign.size()))];
  return learnt;
}

/// Fits hypot(factor * by_least_squares, rest * by_rest) to errors, by maximum likelihood.
void print_deviation(const char* name, const std::vector<std::array<double, 4>>& errors) {
  std::array<double, 2> best{};
  double best_cost = std::numeric_limits<double>::infinity();
  for (double factor = 1.0; factor < 20.0; factor *= 1.02) {
    for (double rest = 0.02; rest < 1.0; rest *= 1.02) {
      double cost = 0.0;
      for (const auto& [error, by_least_squares, by_rest, weight] : errors) {
        const double variance =
            std::pow(factor * by_least_squares, 2) + std::pow(rest * by_rest, 2);
        cost += weight * (std::log(variance) + error * error / variance);
      }
      if (cost < best_cost) best = {factor, rest};
      best_cost = std::min(best_cost, cost);
    }
  }
  std::size_t within = 0;
  for (const auto& [error, by_least_squares, by_rest, weight] : errors) {
    const double deviation = std::hypot(best[0] * by_least_squares, best[1] * by_rest);
    within += error <= 2.0 * deviation ? 1 : 0;
  }
  std::printf("deviation of the %s: factor %.2f, rest %.3f; within two deviations %.3f of %zu\n",
              name, best[0], best[1],
              static_cast<double>(within) / static_cast<double>(errors.size()), errors.size());
}

void print_deviations(const std::vector<Sample>& samples, const Learnt& learnt) {
  std::vector<std::array<double, 4>> directions, turns;
  std::map<std::pair<std::string, int>, double> counts;
  for (const Sample& sample : samples) counts[{sample.home_kind, sample.range}] += 1.0;
  for (const Sample& sample : samples) {
    if (!sample.is_right() || !learnt.is_answered(sample)) continue;
    const HomeVector& v = sample.features.vector;
    const double weight = 1.0 / std::max(10.0, counts[{sample.home_kind, sample.range}]);
    directions.push_back({sample.direction_error_rad, v.direction_deviation_rad(), 1.0, weight});
    if (sample.turn_error_rad > max_turn_error_rad) continue;
    turns.push_back({sample.turn_error_rad, std::sqrt(v.covariance[8]), v.length(), weight});
  }
  print_deviation("direction", directions);
  print_deviation("turn", turns);
}

/// Counts of pairs, for shares.
struct Share {
  double part = 0.0, all = 0.0;
  void add(bool is_part) {
    part += is_part ? 1.0 : 0.0;
    all += 1.0;
  }
  [[nodiscard]] double value() const { return all > 0.0 ? part / all : 0.0; }
};

void print_left_out(const std::vector<Sample>& samples, const std::set<std::string>& kinds) {
  constexpr std::array<double, 8> edges{0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 1.01};
  std::array<Share, 7> bins;
  std::array<double, 7> stated{};
  std::array<Share, range_count> answered, right;
  Share all_foreign, near_kept;
  for (const std::string& kind : kinds) {
    const Learnt learnt = learn(samples, kind);
    Share foreign, own;
    double own_stated = 0.0;
    for (const Sample& sample : samples) {
      if (sample.home_kind != kind) continue;
      const bool is_answered = learnt.is_answered(sample);
      if (sample.is_foreign()) {
        foreign.add(is_answered);
        all_foreign.add(is_answered);
        continue;
      }
      const auto range = static_cast<std::size_t>(sample.range);
      answered[range].add(is_answered);
      if (sample.distance_m <= 1.0 && sample.is_right()) near_kept.add(learnt.is_related(sample));
      if (!is_answered) continue;
      right[range].add(sample.is_right());
      own.add(sample.is_right());
      const double probability = learnt.probability(sample);
      own_stated += probability;
      std::size_t bin = 0;
      while (probability >= edges[bin + 1]) ++bin;
      bins[bin].add(sample.is_right());
      stated[bin] += probability;
    }
    std::printf("%-22s answered %4.0f, stated %.3f, right %.3f; foreign %4.0f, answered %.4f\n",
                kind.c_str(), own.all, own.all > 0.0 ? own_stated / own.all : 0.0, own.value(),
                foreign.all, foreign.value());
  }
  double error = 0.0, count = 0.0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (bins[i].all == 0.0) continue;
    std::printf("stated %.3f, right %.3f of %.0f\n", stated[i] / bins[i].all, bins[i].value(),
                bins[i].all);
    error += std::abs(stated[i] - bins[i].part);
    count += bins[i].all;
  }
  for (std::size_t i = 0; i < range_count; ++i) {
    std::printf("from %.1f m: answered %.3f of %.0f, of these right %.3f\n", ranges_m[i],
                answered[i].value(), answered[i].all, right[i].value());
  }
  std::printf(
      "calibration error %.4f of %.0f; foreign answered %.4f of %.0f; right vectors "
      "within 1 m known %.4f of %.0f\n",
      error / count, count, all_foreign.value(), all_foreign.all, near_kept.value(), near_kept.all);
}

}  // namespace

int main() {
  const char* const folder = std::getenv("PANONAV_DATA");
  Executor executor;
  const auto buildings = make_buildings(folder == nullptr ? "" : folder, executor);
  const std::vector<Sample> samples = compare_views(buildings, executor);
  std::set<std::string> kinds;
  for (const Building& building : buildings) kinds.insert(building.kind);
  std::printf("Learnt from all %zu pairs:\n", samples.size());
  const Learnt learnt = learn(samples, "");
  std::printf("related: deviations over noise > %.2f + %.2f ln(magnitude difference + 0.01)\n",
              (learnt.min_gate - learnt.gate(0)) / learnt.gate(1),
              -learnt.gate(2) / learnt.gate(1));
  std::printf("direction: offset %.2f, coefficients", learnt.direction(0));
  for (int i = 1; i <= direction_term_count; ++i) std::printf(" %.2f", learnt.direction(i));
  std::printf("\n");
  print_deviations(samples, learnt);
  std::printf("In buildings that are left out:\n");
  print_left_out(samples, kinds);
}
