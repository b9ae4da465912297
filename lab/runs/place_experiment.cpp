#include "lab/runs/place_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>

#include "lab/runs/tracking_run.hpp"
#include "lab/statistics.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/recording.hpp"

namespace panonav::lab {

namespace {

/// The memory of a recorded place with its localiser, with the defaults of the command line
/// program: columns rank the places, and local features only decide whether a place is known. Not
/// copyable, because the localiser refers to the memory.
class MemorisedPlace {
 public:
  MemorisedPlace(const simulation::PlaceRecording& place, Executor& executor)
      : memory_(make_memory_of_references(place, executor)), localiser_(memory_) {
    localiser_.use_features(extract_reference_features(place, memory_, executor), false);
  }
  MemorisedPlace(const MemorisedPlace&) = delete;
  MemorisedPlace& operator=(const MemorisedPlace&) = delete;

  [[nodiscard]] const VisualMemory& memory() const noexcept { return memory_; }
  [[nodiscard]] Place localise(const Panorama& view) const {
    return localiser_.localise(compute_packed_signature(view, memory_), {},
                               make_query_features(view));
  }

 private:
  VisualMemory memory_;
  Localiser localiser_;
};

// True if two positions are at most one grid step apart in x and in y.
bool is_neighbour(Point2 a, Point2 b, double spacing_m) {
  return std::abs(std::lround((a.x_m - b.x_m) / spacing_m)) <= 1 &&
         std::abs(std::lround((a.y_m - b.y_m) / spacing_m)) <= 1;
}

// Localises all queries of the place under a condition; `seed`: of the noise of the first one.
std::vector<Place> localise_queries(const MemorisedPlace& memorised,
                                    const simulation::PlaceRecording& place,
                                    const PlaceCondition& condition, std::uint64_t seed,
                                    Executor& executor) {
  return simulation::make_each(executor, place.queries.size(), [&](std::size_t i) {
    Executor here(1);
    const simulation::FrameOptions frame{.camera_height_m = place.scene.camera_height_m,
                                         .tilt_rad = condition.tilt_rad};
    const Panorama seen =
        simulation::capture_panorama(*place.renderer, place.queries[i].pose, place.rendering, frame,
                                     condition.sensor, seed + i, here);
    const Tilt measured = condition.levelled ? sample_tilt(frame, seed + i) : Tilt{};
    return memorised.localise(level_panorama(seen, measured));
  });
}

// Seed of the noise of the first query under the first condition.
std::uint64_t make_noise_seed(const simulation::PlaceRecording& place) {
  return place.seed * 1000003U;
}

}  // namespace

std::vector<PlaceCondition> place_conditions() {
  std::vector<PlaceCondition> conditions(4);
  conditions[0].name = "as memorised";
  conditions[1].name = "light 30 % less, 10 % of the columns hidden";
  conditions[1].sensor.exposure = 0.7;
  conditions[1].sensor.occluded_fraction = 0.1;
  conditions[2].name = "light 30 % more, 10 % of the columns hidden";
  conditions[2].sensor.exposure = 1.3;
  conditions[2].sensor.occluded_fraction = 0.1;
  conditions[3].name = "5 degrees of tilt";
  conditions[3].tilt_rad = radians(5.0);
  return conditions;
}

std::vector<PlaceResult> run_place_experiment(const simulation::PlaceRecording& place,
                                              const std::vector<PlaceCondition>& conditions,
                                              Executor& executor) {
  const MemorisedPlace memorised(place, executor);
  std::vector<PlaceResult> results;
  std::uint64_t seed = make_noise_seed(place);
  for (const PlaceCondition& condition : conditions) {
    const std::size_t query_count = place.queries.size();
    const auto answers = localise_queries(memorised, place, condition, seed, executor);
    seed += query_count;
    std::size_t nearest = 0;
    std::size_t nearest_or_neighbour = 0;
    std::size_t known = 0;
    std::size_t stated = 0;  // answers with a radius
    std::size_t inside = 0;
    std::vector<double> heading_errors;
    std::vector<double> position_errors;
    for (std::size_t i = 0; i < query_count; ++i) {
      const Pose2& truth = place.queries[i].pose;
      const Place& answer = answers[i];
      const PlaceMatch& best = answer.matches.at(0);
      const ReferencePose& found = *memorised.memory().info(best.view).pose;
      const Point2 nearest_position =
          place.references[place.nearest_reference(truth.position())].pose.position();
      nearest += found.position() == nearest_position ? 1 : 0;
      nearest_or_neighbour +=
          is_neighbour(found.position(), nearest_position, place.spacing_m) ? 1 : 0;
      known += answer.known ? 1 : 0;
      // A match without heading is counted with the largest error, pi.
      heading_errors.push_back(best.heading_rad
                                   ? std::abs(angle_difference(
                                         *found.heading_rad + *best.heading_rad, truth.heading_rad))
                                   : std::numbers::pi);
      if (!answer.position) continue;
      position_errors.push_back(distance(answer.position->position(), truth.position()));
      if (!answer.position->radius_m) continue;  // states nothing
      ++stated;
      inside += position_errors.back() <= *answer.position->radius_m ? 1 : 0;
    }
    results.push_back({condition.name, success_rate(nearest, query_count),
                       success_rate(nearest_or_neighbour, query_count),
                       success_rate(known, query_count), quantile(heading_errors, 0.5),
                       quantile(heading_errors, 0.95), quantile(position_errors, 0.5),
                       success_rate(inside, stated)});
  }
  return results;
}

std::vector<StatedPlace> collect_stated_places(const simulation::PlaceRecording& place,
                                               const std::vector<PlaceCondition>& conditions,
                                               Executor& executor) {
  const MemorisedPlace memorised(place, executor);
  std::vector<StatedPlace> stated;
  std::uint64_t seed = make_noise_seed(place);
  for (const PlaceCondition& condition : conditions) {
    const auto answers = localise_queries(memorised, place, condition, seed, executor);
    seed += answers.size();
    for (std::size_t i = 0; i < answers.size(); ++i) {
      const Point2 truth = place.queries[i].pose.position();
      const Point2 nearest = place.references[place.nearest_reference(truth)].pose.position();
      const auto is_right = [&](const PlaceMatch& match) {
        return is_neighbour(memorised.memory().info(match.view).pose->position(), nearest,
                            place.spacing_m);
      };
      stated.push_back({.known = answers[i].known,
                        .probability = answers[i].probability,
                        .right = is_right(answers[i].matches.at(0)),
                        .right_is_named = std::ranges::any_of(answers[i].alternatives, is_right,
                                                              &AlternativePlace::match)});
    }
  }
  return stated;
}

BuildingResult run_building_experiment(std::span<const simulation::PlaceRecording* const> floors,
                                       Executor& executor) {
  std::optional<VisualMemory> memory;
  std::map<ViewId, std::optional<LocalFeatures>> features;
  for (std::size_t i = 0; i < floors.size(); ++i) {
    const VisualMemory part = make_memory_of_references(*floors[i], executor);
    if (!memory) memory.emplace(part.shape(), part.full_scale(), part.elevations());
    const FeatureSource part_features = extract_reference_features(*floors[i], part, executor);
    for (const ViewId view : part.views()) {
      ReferenceInfo info = part.info(view);
      info.name = make_name_on_floor(std::to_string(i), info.name);
      features.emplace(memory->append(part.signature(view), info), part_features(view));
    }
  }
  Localiser localiser(*memory);
  localiser.use_features([&](ViewId view) { return features.at(view); }, false);
  BuildingResult result{.learnt_spacing_m = localiser.position_model().spacing_m};
  for (std::size_t i = 0; i < floors.size(); ++i) {
    const auto& queries = floors[i]->queries;
    const auto answers = simulation::make_each(executor, queries.size(), [&](std::size_t q) {
      const Panorama& view = queries[q].panorama;
      return localiser.localise(compute_packed_signature(view, *memory), {},
                                make_query_features(view));
    });
    result.queries += queries.size();
    for (std::size_t q = 0; q < queries.size(); ++q) {
      if (!answers[q].known) continue;
      ++result.known;
      const bool is_right = answers[q].floor() == std::to_string(i);
      result.right_floor += is_right ? 1 : 0;
      const auto& position = answers[q].position;
      if (!position || !position->radius_m) continue;
      ++result.stated;
      const bool is_inside =
          distance(position->position(), queries[q].pose.position()) <= *position->radius_m;
      result.inside += is_right && is_inside ? 1 : 0;
    }
  }
  return result;
}

std::vector<RecognitionRate> measure_recognition_rates(
    std::span<const simulation::PlaceRecording* const> places, Executor& executor) {
  const auto name = [](const simulation::PlaceRecording& place) {
    return place.scene.name + " " + std::to_string(place.seed);
  };
  std::vector<RecognitionRate> own;
  std::vector<RecognitionRate> others;
  for (const simulation::PlaceRecording* const place : places) {
    const MemorisedPlace memorised(*place, executor);
    for (const simulation::PlaceRecording* const queried : places) {
      std::vector<std::uint8_t> known(queried->queries.size());
      executor.for_each_chunk(known.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
        known[i] = memorised.localise(queried->queries[i].panorama).known ? 1 : 0;
      });
      const auto count = static_cast<std::size_t>(std::ranges::count(known, 1));
      (place == queried ? own : others)
          .push_back({name(*place), name(*queried), success_rate(count, known.size())});
    }
  }
  own.insert(own.end(), others.begin(), others.end());
  return own;
}

}  // namespace panonav::lab
