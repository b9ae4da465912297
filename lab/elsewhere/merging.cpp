// Merging the memories of two sessions in one place, and of two sessions in places with nothing in
// common.

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "lab/rows.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/motion/odometry.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_merge.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/recording.hpp"
#include "panonav_simulation/worlds.hpp"

namespace panonav::lab {

namespace {

constexpr double walk_spacing_m = 0.1;
constexpr double same_place_radius_m = 0.5;    // views this near each other show one place
constexpr double min_shared_overlap = 0.13;    // overlap of walks that share places
constexpr double max_disjoint_overlap = 0.02;  // overlap of walks that share almost no place
constexpr double wrong_rms_m = 2.0;            // above the drift of both walks
constexpr std::size_t first_views = 100;       // from which the full scale is learnt

/// A random walk with its memory and the map that the robot built from noisy odometry, without
/// known positions.
struct Session {
  std::filesystem::path memory;
  std::map<std::string, Point2> truth;  ///< by view name
  [[nodiscard]] double overlap_fraction(const Session& other) const {
    const auto shared_views = std::ranges::count_if(truth, [&](const auto& view) {
      return std::ranges::any_of(other.truth, [&](const auto& one) {
        return distance(one.second, view.second) <= same_place_radius_m;
      });
    });
    return static_cast<double>(shared_views) / static_cast<double>(truth.size());
  }
};

Session record_walk(const simulation::PlaceRecording& place, const std::string& name, int pictures,
                    const std::filesystem::path& folder, std::uint64_t seed, Executor& executor) {
  const auto planned = simulation::plan_recording(place.scene, *place.free_space,
                                                  {.path = simulation::RecordingPath::walk,
                                                   .heading = simulation::RecordingHeading::path,
                                                   .spacing_m = walk_spacing_m,
                                                   .poses = pictures},
                                                  OdometryNoise{}, seed);
  Session session{folder / (name + ".panonav"), {}};
  std::filesystem::remove(session.memory);
  auto seen = simulation::make_each(executor, planned.size(), [&](std::size_t i) {
    Observation observation(
        simulation::capture_view(place, planned[i].pose, seed * 1'000'003U + i));
    observation.name = name + " " + std::to_string(i);
    observation.odometry = planned[i].odometry;
    return observation;
  });
  for (std::size_t i = 0; i < planned.size(); ++i) {
    session.truth[seen[i].name] = planned[i].pose.position();
  }
  const std::span<const Observation> first(seen.data(), std::min(first_views, seen.size()));
  PictureSource source;
  source.layout.elevations = std::get<Panorama>(seen.front().picture).elevations();
  Mapper mapper(
      MemoryFile::create(session.memory, make_memory_header(first, source, {}, {}, executor)),
      source, {.thumbnails = false});
  const auto encoded = simulation::make_each(executor, seen.size(),
                                             [&](std::size_t i) { return mapper.encode(seen[i]); });
  for (const Mapper::EncodedView& view : encoded) mapper.add(view);
  (void)mapper.finish();
  return session;
}

/// Errors of the map that merges two sessions.
struct MergedMapError {
  double shape_difference = 1.0;
  double rms_m = 0.0;
};
std::optional<MergedMapError> try_merge(const Session& first, const Session& second,
                                        const std::filesystem::path& folder) {
  const std::filesystem::path both = folder / "both.panonav";
  std::filesystem::remove(both);
  std::optional<MergedMapError> error;
  const MergedMemory merged = merge_memories(first.memory, second.memory, both);
  if (merged.alignment) {
    const MemoryFile file = MemoryFile::open(both, Access::read_only);
    const TopologicalMap map = file.map(map_name).value();
    const VisualMemory memory = file.load();
    const std::size_t largest = find_largest_component(map);
    std::vector<Point2> estimate;
    std::vector<Point2> truth;
    for (const TopologicalMap::Node& node : map.nodes) {
      if (node.component != largest) continue;
      const std::string& name = memory.info(node.view).name;
      estimate.push_back(node.pose.position());
      const auto known = first.truth.find(name);
      truth.push_back(known != first.truth.end() ? known->second : second.truth.at(name));
    }
    error = {simulation::shape_error(estimate, truth), align(estimate, truth).rms_m};
  }
  std::filesystem::remove(both);
  return error;
}

/// Number of pairs of walks, and how many of them were merged into one map.
struct PairCount {
  std::size_t all = 0;
  std::size_t joined = 0;
};

/// Adds the results of merging each walk through one place with the next one.
void report_place(const std::string& name, const std::vector<Session>& walks,
                  const std::filesystem::path& folder, Reproduction& result) {
  PairCount sharing;
  PairCount between;
  PairCount apart;
  std::size_t wrong = 0;
  double worst_shape = 0.0;
  for (std::size_t i = 0; i < walks.size(); ++i) {
    const Session& first = walks[i];
    const Session& second = walks[(i + 1) % walks.size()];
    const double overlap = std::max(first.overlap_fraction(second), second.overlap_fraction(first));
    const auto found = try_merge(first, second, folder);
    PairCount& group = overlap >= min_shared_overlap    ? sharing
                       : overlap < max_disjoint_overlap ? apart
                                                        : between;
    ++group.all;
    if (!found) continue;
    ++group.joined;
    wrong += found->rms_m > wrong_rms_m ? 1 : 0;
    worst_shape = std::max(worst_shape, found->shape_difference);
  }
  const std::string id = "elsewhere.merge." + name;
  const std::string what = "memories of two walks through " + name + " that ";
  const auto add_pairs = [&](const std::string& key, const std::string& how, const PairCount& pairs,
                             std::optional<Target> target) {
    if (pairs.all == 0) return;
    add_rate(result, id + key, what + how + ": joined", pairs.joined, pairs.all, target);
  };
  add_pairs(".joined", "share 13 % of the path or more", sharing, at_least(0.95));
  if (const auto joined = sharing.joined + between.joined + apart.joined; joined > 0) {
    add_rate(result, id + ".wrong", what + "were joined: off by more than 2 m rms", wrong, joined,
             at_most(0.0));
    add_row(result, id + ".shape", what + "were joined: shape difference of the worst map",
            worst_shape, "", at_most(0.02));
  }
  add_pairs(".between", "share 2 to 13 % of the path", between, std::nullopt);
  add_pairs(".apart", "share less than 2 % of the path", apart, std::nullopt);
}

}  // namespace

void ElsewhereExperiments::reproduce_merging() {
  const std::filesystem::path folder = result.out / "merged";
  std::filesystem::create_directories(folder);
  std::map<std::string, std::vector<Session>> sessions;
  for (const char* const name : {"loop", "small_warehouse", "small_house"}) {
    if (!simulation::has_scene(options.data, name)) continue;
    const simulation::PlaceRecording place = simulation::make_empty_place(
        simulation::make_or_read_scene(options.data, name, {.seed = options.seed}), options.seed,
        {.columns = 512, .rays_per_axis = 1}, executor);
    for (int i = 0; i < options.walks; ++i) {
      sessions[name].push_back(
          record_walk(place, std::string(name) + "_" + std::to_string(i), options.walk_pictures,
                      folder, options.seed + 100U + static_cast<std::uint64_t>(i), executor));
    }
  }
  for (const auto& [name, walks] : sessions) report_place(name, walks, folder, result);
  PairCount disjoint;
  for (auto one = sessions.begin(); one != sessions.end(); ++one) {
    for (auto other = std::next(one); other != sessions.end(); ++other) {
      for (std::size_t i = 0; i < one->second.size(); ++i) {
        ++disjoint.all;
        disjoint.joined += try_merge(one->second[i], other->second[i], folder) ? 1 : 0;
      }
    }
  }
  if (disjoint.all > 0) {
    add_rate(result, "elsewhere.merge.disjoint", "memories of walks through two places: joined",
             disjoint.joined, disjoint.all, at_most(0.0));
  }
  std::filesystem::remove_all(folder);
}

}  // namespace panonav::lab
