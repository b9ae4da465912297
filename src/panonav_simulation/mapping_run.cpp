#include "panonav_simulation/mapping_run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/mapping/map_measures.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/simulated_odometry.hpp"

namespace panonav::simulation {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

float largest_nonconstant_magnitude(const MappingRecording& recording, int components) {
  float largest = 0.0F;
  const std::size_t every = std::max<std::size_t>(1, recording.views.size() / 32);
  for (std::size_t i = 0; i < recording.views.size(); i += every) {
    const FourierSignature& view = recording.views[i];
    const auto rows = static_cast<std::size_t>(view.rows());
    const auto counted =
        view.magnitudes().subspan(rows, rows * static_cast<std::size_t>(components - 1));
    largest = std::max(largest, *std::ranges::max_element(counted));
  }
  return largest > 0.0F ? largest : 1.0F;
}

}  // namespace

PlaceRecording make_empty_place(Scene scene, std::uint64_t seed, PanoramaRendering rendering,
                                Executor& executor) {
  PlaceRecording place{make_place(std::move(scene), executor), seed};
  place.rendering = std::move(rendering);
  return place;
}

OdometryNoise make_noisy_wheels() {
  return {.translation_from_translation = 0.06,
          .translation_from_rotation = 0.01,
          .rotation_from_translation = 0.04,
          .rotation_from_rotation = 0.06,
          .translation_scale_error = 0.04,
          .rotation_scale_error = 0.03};
}

std::vector<Pose2> drive(const PlaceRecording& place, std::span<const Point2> way_points,
                         double spacing_m, std::size_t max_poses) {
  const auto planned = plan_recording(
      place.scene, *place.free_space,
      {.path = RecordingPath::tour, .heading = RecordingHeading::path, .spacing_m = spacing_m}, {},
      place.seed, way_points);
  std::vector<Pose2> poses;
  for (const RecordedPose& pose : planned) {
    if (poses.size() < max_poses) poses.push_back(pose.pose);
  }
  return poses;
}

MappingRecording record_for_mapping(const PlaceRecording& place, std::vector<Pose2> poses,
                                    int components, const OdometryNoise& wheels, std::uint64_t seed,
                                    Executor& executor) {
  MappingRecording recording;
  recording.wheels = simulate_odometry(poses, wheels, seed);
  recording.views = make_each(executor, poses.size(), [&](std::size_t i) {
    return compute_signature(preprocess(capture_view(place, poses[i], seed + i), {}), components);
  });
  recording.truth = std::move(poses);
  return recording;
}

FourierSignature first_components(const FourierSignature& signature, int components) {
  require(components >= 1 && components <= signature.components(), "components", components,
          "1 .. " + std::to_string(signature.components()));
  const auto count = static_cast<std::ptrdiff_t>(signature.rows()) * components;
  const auto magnitudes = signature.magnitudes();
  const auto phases = signature.phases_rad();
  return {{signature.rows(), components},
          {magnitudes.begin(), magnitudes.begin() + count},
          {phases.begin(), phases.begin() + count},
          signature.elevations()};
}

MappingRecording thin_recording(const MappingRecording& recording, std::size_t n) {
  require(n >= 1, "n", static_cast<double>(n), ">= 1");
  MappingRecording thinned;
  for (std::size_t i = 0; i < recording.truth.size(); i += n) {
    thinned.truth.push_back(recording.truth[i]);
    thinned.wheels.push_back(recording.wheels[i]);
    thinned.views.push_back(recording.views[i]);
  }
  return thinned;
}

MappedRecording map_recording(const MappingRecording& recording, const MappingRunOptions& options) {
  require(!recording.views.empty(), "views of a recording", 0.0, ">= 1");
  MappedRecording result;
  const SignatureShape shape{recording.views.front().rows(), options.components};
  VisualMemory memory(shape, largest_nonconstant_magnitude(recording, options.components),
                      recording.views.front().elevations());
  TopologicalMapper mapper(memory, options.mapping, options.odometry, options.closure);
  double total_s = 0.0;
  std::size_t processed_views = 0;
  for (std::size_t i = 0; i < recording.views.size(); ++i) {
    if (options.max_nodes > 0 && result.number.size() == options.max_nodes) break;
    ++processed_views;
    const FourierSignature view = first_components(recording.views[i], options.components);
    const auto start = Clock::now();
    OdometryView seen(view);
    if (mapper.is_new(seen)) {
      std::optional<Pose2> moved;
      if (options.wheels && !result.number.empty()) {
        moved = inverse(recording.wheels[result.number.back()]) * recording.wheels[i];
      }
      const ViewId id = memory.append(view, {.name = std::to_string(i)});
      static_cast<void>(mapper.add(id, std::move(seen), moved));
      result.number.push_back(i);
    }
    const double step_s = seconds_since(start);
    total_s += step_s;
    result.max_step_s = std::max(result.max_step_s, step_s);
  }
  const auto start = Clock::now();
  mapper.finish();
  result.finish_s = seconds_since(start);
  result.mean_step_s = (total_s + result.finish_s) / static_cast<double>(processed_views);
  result.map = mapper.map();
  for (std::size_t i = 0; i < result.number.size(); ++i) {
    result.estimate.push_back(result.map.nodes[i].pose.position());
    result.truth.push_back(recording.truth[result.number[i]].position());
  }
  const auto closures = count_closures(result.map, [&](ViewId view) -> std::optional<Point2> {
    const auto found =
        std::ranges::lower_bound(result.map.nodes, view, {}, &TopologicalMap::Node::view);
    return result.truth[static_cast<std::size_t>(found - result.map.nodes.begin())];
  });
  result.right_closures = closures.right;
  result.wrong_closures = closures.wrong;
  return result;
}

double shape_error(std::span<const Point2> estimate, std::span<const Point2> truth) {
  const auto is_one_place = [](std::span<const Point2> points) {
    return std::ranges::all_of(points, [&](const Point2& p) { return p == points.front(); });
  };
  if (estimate.size() < 2 || is_one_place(estimate) || is_one_place(truth)) return 1.0;
  return shape_difference(estimate, truth).value;
}

std::vector<Point2> align_to(std::span<const Point2> estimate, std::span<const Point2> truth) {
  const Alignment alignment = align(estimate, truth, {.allow_scale = true});
  std::vector<Point2> points;
  for (const Point2& p : estimate) points.push_back(alignment.apply(p));
  return points;
}

}  // namespace panonav::simulation
