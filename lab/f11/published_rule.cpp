// The published rule of [F11] step by step: what each of its steps brings.

#include "lab/f11/published_rule.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <optional>
#include <span>
#include <utility>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::lab {

namespace {

// Grid of figure 6; k1 is the number of components of the distance, k2 of the turn.
constexpr std::array<int, 7> k1_grid{2, 4, 8, 16, 26, 40, 64};
constexpr std::array<int, 6> k2_grid{4, 8, 14, 20, 40, 64};
constexpr double max_spacing_m = 0.4;
constexpr double min_way_m = 1e-9;  ///< shortest drive; below it the robot stands

using TravelDirection = PublishedRuleVariant::TravelDirection;
using UsedRows = PublishedRuleVariant::UsedRows;

struct NamedVariant {
  std::string key;
  std::string text;
  PublishedRuleVariant variant;
};

/// Variants that are also measured on mirror images.
constexpr std::array mirror_variants{"as_written", "above", "true_lengths", "true_turns"};

std::vector<NamedVariant> list_variants() {
  return {
      {"unit_phases", "all phases weigh the same", {.unit_phases = true}},
      {"unit_signatures", "signatures of norm 1", {.unit_signatures = true}},
      {"as_written",
       "all phases weigh the same and signatures of norm 1",
       {.unit_phases = true, .unit_signatures = true}},
      {"first_heading",
       "travel along the heading before the step",
       {.direction = TravelDirection::first_heading}},
      {"last_heading",
       "travel along the heading after the step",
       {.direction = TravelDirection::last_heading}},
      {"above", "rows above the horizon", {.rows = UsedRows::above_horizon}},
      {"below", "rows below the horizon", {.rows = UsedRows::below_horizon}},
      {"rows_16", "five rows averaged to one", {.rows_per_band = 5}},
      {"rows_4", "twenty rows averaged to one", {.rows_per_band = 20}},
      {"reflection", "mirrored maps allowed", {.reflection = true}},
      {"root", "root of the shape difference", {.root = true}},
      {"true_lengths", "true lengths", {.length_error = 0.0}},
      {"half_turn_error", "half the errors of turns", {.turn_error = 0.5}},
      {"quarter_turn_error", "a quarter of the errors of turns", {.turn_error = 0.25}},
      {"true_turns", "true turns", {.turn_error = 0.0}},
      {"true_steps", "true lengths and turns", {.length_error = 0.0, .turn_error = 0.0}},
  };
}

/// Returns the rows that a variant uses, averaged in bands. With `unit_magnitudes` all magnitudes
/// are 1.
FourierSignature select_rows(const FourierSignature& view, const PublishedRuleVariant& variant,
                             bool unit_magnitudes) {
  const int rows = view.rows();
  int horizon = rows / 2;
  if (view.elevations()) {
    const double low = view.elevations()->bottom_rad;
    const double high = view.elevations()->top_rad;
    horizon = std::clamp(static_cast<int>(std::lround(rows * high / (high - low))), 1, rows - 1);
  }
  const int begin = variant.rows == UsedRows::below_horizon ? horizon : 0;
  const int end = variant.rows == UsedRows::above_horizon ? horizon : rows;
  const int bands = std::max(1, (end - begin) / variant.rows_per_band);
  std::vector<float> magnitudes;
  std::vector<float> phases;
  for (int k = 0; k < view.components(); ++k) {
    for (int band = 0; band < bands; ++band) {
      const int first = begin + band * (end - begin) / bands;
      const int last = begin + (band + 1) * (end - begin) / bands;
      std::complex<float> sum;
      for (int row = first; row < last; ++row)
        sum += std::polar(view.magnitude(row, k), view.phase_rad(row, k));
      const float magnitude = std::abs(sum) / static_cast<float>(last - first);
      magnitudes.push_back(unit_magnitudes && magnitude > 0.0F ? 1.0F : magnitude);
      phases.push_back(std::arg(sum));
    }
  }
  return {{bands, view.components()}, std::move(magnitudes), std::move(phases), std::nullopt};
}

/// Returns the distance of two signatures by their first `k1` components [F11 eq. 2].
double compute_distance(const FourierSignature& a, const FourierSignature& b, int k1, bool unit) {
  const auto count = static_cast<std::size_t>(a.rows()) * static_cast<std::size_t>(k1);
  const auto x = a.magnitudes().first(count);
  const auto y = b.magnitudes().first(count);
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    xx += static_cast<double>(x[i]) * x[i];
    yy += static_cast<double>(y[i]) * y[i];
    xy += static_cast<double>(x[i]) * y[i];
  }
  if (!unit) return std::sqrt(std::max(0.0, xx + yy - 2.0 * xy));
  if (!(xx > 0.0 && yy > 0.0)) return 0.0;
  return std::sqrt(std::max(0.0, 2.0 - 2.0 * xy / std::sqrt(xx * yy)));
}

std::vector<Point2> integrate(std::span<const double> lengths, std::span<const double> turns,
                              TravelDirection direction) {
  const double share = direction == TravelDirection::first_heading ? 0.0
                       : direction == TravelDirection::middle      ? 0.5
                                                                   : 1.0;
  Pose2 pose;
  std::vector<Point2> path{pose.position()};
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double turn = turns[i];
    pose = pose *
           Pose2{lengths[i] * std::cos(share * turn), lengths[i] * std::sin(share * turn), turn};
    path.push_back(pose.position());
  }
  return path;
}

/// Lengths by k1 and turns by k2 of all steps of a recording.
struct RuleSteps {
  std::array<std::vector<double>, k1_grid.size()> lengths;
  std::array<std::vector<double>, k2_grid.size()> turns;
};

RuleSteps compute_steps(const simulation::MappingRecording& recording,
                        const PublishedRuleVariant& variant, Executor& executor) {
  RuleSteps steps;
  const std::size_t count = recording.views.size() - 1;
  for (auto& lengths : steps.lengths) lengths.resize(count);
  for (auto& turns : steps.turns) turns.resize(count);
  executor.for_each_chunk(count, 8, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const FourierSignature before = select_rows(recording.views[i], variant, false);
      const FourierSignature after = select_rows(recording.views[i + 1], variant, false);
      for (std::size_t k = 0; k < k1_grid.size(); ++k)
        steps.lengths[k][i] = compute_distance(after, before, k1_grid[k], variant.unit_signatures);
      const FourierSignature phases_before = select_rows(recording.views[i], variant, true);
      const FourierSignature phases_after = select_rows(recording.views[i + 1], variant, true);
      for (std::size_t k = 0; k < k2_grid.size(); ++k) {
        const auto reading = variant.unit_phases ? compass(phases_after, phases_before, k2_grid[k])
                                                 : compass(after, before, k2_grid[k]);
        steps.turns[k][i] = reading ? reading->heading_rad : 0.0;
      }
    }
  });
  return steps;
}

/// Removes the share of the errors that the variant does not keep. Lengths are compared in units of
/// their sum.
void correct_steps(RuleSteps& steps, std::span<const Pose2> truth,
                   const PublishedRuleVariant& variant) {
  std::vector<Pose2> motions;
  double way_m = 0.0;
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
    motions.push_back(inverse(truth[i]) * truth[i + 1]);
    way_m += std::hypot(motions.back().x_m, motions.back().y_m);
  }
  for (auto& lengths : steps.lengths) {
    double unit = 0.0;
    for (const double length : lengths) unit += length / std::max(way_m, min_way_m);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const double right = unit * std::hypot(motions[i].x_m, motions[i].y_m);
      lengths[i] = right + variant.length_error * (lengths[i] - right);
    }
  }
  for (auto& turns : steps.turns) {
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const double right = motions[i].heading_rad;
      turns[i] = right + variant.turn_error * angle_difference(turns[i], right);
    }
  }
}

/// Returns the standard deviation of the errors of the headings along the path in degrees; an error
/// that all headings share only rotates the map.
double compute_heading_error_deg(std::span<const Pose2> truth, std::span<const double> turns) {
  double error_rad = 0.0;
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    sum += error_rad;
    squares += error_rad * error_rad;
    error_rad += angle_difference(turns[i], (inverse(truth[i]) * truth[i + 1]).heading_rad);
  }
  const auto count = static_cast<double>(turns.size());
  return degrees(std::sqrt(std::max(0.0, squares / count - sum * sum / (count * count))));
}

/// Median distances of what the camera sees at its height: all around, on the left, on the right.
struct Clearances {
  std::vector<double> around_m, left_m, right_m;
  /// Returns the median on the right over that on the left; nullopt if one side is open.
  [[nodiscard]] std::optional<double> sidedness() const {
    if (left_m.empty() || right_m.empty()) return std::nullopt;
    return median(right_m) / median(left_m);
  }
};

Clearances measure_clearances(const simulation::PlaceRecording& place,
                              std::span<const Pose2> poses) {
  constexpr int step_degrees = 10;
  Clearances found;
  for (std::size_t i = 0; i < poses.size(); i += 10) {
    const simulation::Vector3 eye{poses[i].x_m, poses[i].y_m, place.scene.camera_height_m};
    for (int azimuth = -180; azimuth < 180; azimuth += step_degrees) {
      const Direction3 ray = Direction3::from_angles(poses[i].heading_rad + radians(azimuth), 0.0);
      const double distance_m = place.renderer->distance_along(eye, ray);
      if (!std::isfinite(distance_m)) continue;
      found.around_m.push_back(distance_m);
      if (azimuth > 45 && azimuth < 135) found.left_m.push_back(distance_m);
      if (azimuth < -45 && azimuth > -135) found.right_m.push_back(distance_m);
    }
  }
  return found;
}

}  // namespace

PublishedRuleErrors measure_published_rule(const simulation::MappingRecording& recording,
                                           const PublishedRuleVariant& variant,
                                           const PublishedFigure& published, Executor& executor) {
  const std::size_t views = recording.views.size();
  require(views >= 2 && recording.truth.size() == views, "views", static_cast<double>(views),
          ">= 2, as many as poses");
  require(recording.views.front().components() >= k2_grid.back(), "components",
          recording.views.front().components(), ">= 64");
  require(std::ranges::count(k1_grid, published.k1) == 1, "k1", published.k1, "one of figure 6");
  const auto at_k2 = std::ranges::find(k2_grid, published.k2);
  require(at_k2 != k2_grid.end(), "k2", published.k2, "one of figure 6");
  RuleSteps steps = compute_steps(recording, variant, executor);
  correct_steps(steps, recording.truth, variant);
  PublishedRuleErrors errors;
  errors.heading_deg = compute_heading_error_deg(
      recording.truth, steps.turns.at(static_cast<std::size_t>(at_k2 - k2_grid.begin())));
  const std::vector<Point2> truth = positions_of(recording.truth);
  for (std::size_t a = 0; a < k1_grid.size(); ++a) {
    for (std::size_t b = 0; b < k2_grid.size(); ++b) {
      const auto path = integrate(steps.lengths[a], steps.turns[b], variant.direction);
      double error = variant.reflection ? shape_difference(path, truth).with_reflection
                                        : simulation::shape_error(path, truth);
      if (variant.root) error = std::sqrt(error);
      errors.smallest = std::min(errors.smallest, error);
      if (k1_grid[a] == published.k1 && k2_grid[b] == published.k2) errors.fixed = error;
    }
  }
  return errors;
}

simulation::MappingRecording record_by_mirror(const simulation::PlaceRecording& place,
                                              std::span<const Pose2> plan, int components,
                                              const OdometryNoise& wheels, std::uint64_t seed,
                                              Executor& executor) {
  const simulation::PanoramaRendering rendering = simulation::make_mirror_rendering(80, 512);
  Random random(seed, 500);
  simulation::MappingRecording recording;
  for (const Pose2& planned : plan) {
    Pose2 pose = planned;
    if (!recording.truth.empty()) {
      const Pose2& last = recording.truth.back();
      pose = last * sample_step(inverse(last) * planned, wheels, random);
      if (!place.free_space->is_free(pose.position())) pose = planned;
    }
    Panorama view = simulation::capture_panorama(*place.renderer, pose, rendering,
                                                 {.camera_height_m = place.scene.camera_height_m},
                                                 {}, seed + recording.truth.size(), executor);
    recording.views.push_back(compute_signature(preprocess(std::move(view), {}), components));
    recording.truth.push_back(pose);
  }
  recording.wheels = simulation::simulate_odometry(recording.truth, wheels, seed);
  return recording;
}

PublishedRuleStudy::Entry& PublishedRuleStudy::add_entry(const std::string& key,
                                                         const std::string& text,
                                                         const PublishedRuleErrors& errors) {
  if (!entries_.contains(key)) keys_.push_back(key);
  Entry& entry = entries_[key];
  entry.text = text;
  entry.fixed.push_back(errors.fixed);
  entry.smallest.push_back(errors.smallest);
  entry.headings_deg.push_back(errors.heading_deg);
  return entry;
}

void PublishedRuleStudy::add(const simulation::PlaceRecording& place,
                             const simulation::MappingRecording& recording,
                             const simulation::MappingRecording& by_mirror, Executor& executor) {
  const auto measure = [&](const simulation::MappingRecording& of,
                           const PublishedRuleVariant& variant) {
    return measure_published_rule(of, variant, published_, executor);
  };
  const Clearances clearances = measure_clearances(place, recording.truth);
  if (!clearances.around_m.empty()) clearances_m_.push_back(median(clearances.around_m));
  Entry& rule = add_entry("rule", "", measure(recording, {}));
  if (const auto sidedness = clearances.sidedness()) rule.sidedness.push_back(*sidedness);
  for (const NamedVariant& named : list_variants())
    add_entry(named.key, named.text, measure(recording, named.variant));
  const std::string mirror = "mirror images of 640 x 480";
  add_entry("mirror", mirror, measure(by_mirror, {}));
  for (const NamedVariant& named : list_variants()) {
    if (std::ranges::count(mirror_variants, named.key) == 0) continue;
    add_entry("mirror_" + named.key, mirror + ", " + named.text, measure(by_mirror, named.variant));
  }
}

void PublishedRuleStudy::add_spacings(const simulation::MappingRecording& recording,
                                      double spacing_m, Executor& executor) {
  for (std::size_t n = 1; static_cast<double>(n) * spacing_m <= max_spacing_m + 1e-9; n *= 2) {
    const double spaced_m = static_cast<double>(n) * spacing_m;
    add_entry(
        "spacing_" + format_centimetres_id(spaced_m),
        "views " + format_centimetres(spaced_m) + " apart",
        measure_published_rule(simulation::thin_recording(recording, n), {}, published_, executor));
  }
}

void PublishedRuleStudy::add_offset_tours(const simulation::PlaceRecording& place,
                                          std::span<const double> offsets_m, double spacing_m,
                                          std::size_t views, Executor& executor) {
  const std::vector<Point2>& tour = place.scene.tour;
  Point2 middle;
  for (const Point2& corner : tour) {
    middle.x_m += corner.x_m / static_cast<double>(tour.size());
    middle.y_m += corner.y_m / static_cast<double>(tour.size());
  }
  const auto move_towards = [](double from, double to, double by) {
    return from + (to > from ? by : -by);
  };
  for (const double offset_m : offsets_m) {
    std::vector<Point2> path;
    for (const Point2& corner : tour) {
      path.push_back({move_towards(corner.x_m, middle.x_m, offset_m),
                      move_towards(corner.y_m, middle.y_m, offset_m)});
    }
    path.push_back(path.front());
    if (!std::ranges::all_of(path, [&](Point2 p) { return place.free_space->is_free(p); }))
      continue;
    const auto recording =
        simulation::record_for_mapping(place, simulation::drive(place, path, spacing_m, views),
                                       k2_grid.back() + 2, {}, place.seed, executor);
    const std::string side = offset_m > 0.0 ? "inside" : "outside";
    const double off_m = std::abs(offset_m);
    Entry& entry = add_entry(
        offset_m == 0.0 ? "on_tour" : side + "_" + format_centimetres_id(off_m),
        "a round " + (offset_m == 0.0 ? "on" : format_centimetres(off_m) + " " + side + " of") +
            " the tour",
        measure_published_rule(recording, {}, published_, executor));
    const auto sidedness = measure_clearances(place, recording.truth).sidedness();
    if (sidedness) entry.sidedness.push_back(*sidedness);
  }
}

void PublishedRuleStudy::report(const std::string& id, const std::string& what,
                                Reproduction& result) const {
  const double published = published_.shape_difference;
  const auto theirs = std::pair(published, published);
  const std::string rule = what + ": shape difference by the published rule";
  for (const std::string& key : keys_) {
    const Entry& entry = entries_.at(key);
    const bool is_rule = key == "rule";
    const std::string suffix = is_rule ? "" : "." + key;
    const std::string change = is_rule ? "" : ", " + entry.text;
    if (!is_rule)
      add_median(result, id + ".published_fixed" + suffix,
                 rule + ", k1 and k2 as published" + change, "", entry.fixed);
    add_median(result, id + ".published_chosen" + suffix,
               rule + ", k1 and k2 chosen for each recording as in figure 6" + change, "",
               entry.smallest, std::nullopt,
               is_rule || key == "mirror" ? std::optional(theirs) : std::nullopt);
    add_median(result, id + ".published_heading" + suffix,
               what + ": standard deviation of the heading errors by the published rule" + change,
               "deg", entry.headings_deg);
    if (entry.sidedness.empty()) continue;
    add_median(result, id + ".sidedness" + suffix,
               what + ": median distance of things on the right over that on the left" + change, "",
               entry.sidedness);
  }
  add_median(result, id + ".clearance", what + ": median distance of things around the camera", "m",
             clearances_m_);
}

}  // namespace panonav::lab
