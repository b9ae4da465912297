#include "panonav/pipeline/mapper.hpp"

#include <chrono>
#include <map>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/map_scale.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

std::size_t find_largest_component(const TopologicalMap& map) {
  std::map<std::size_t, std::size_t> sizes;
  for (const TopologicalMap::Node& node : map.nodes) ++sizes[node.component];
  std::size_t largest = 0;
  for (const auto& [component, size] : sizes) {
    if (size > sizes[largest]) largest = component;
  }
  return largest;
}

Mapper::Mapper(const std::filesystem::path& memory, const MapperOptions& options)
    : Mapper(MemoryFile::open(memory, Access::read_write), std::nullopt, options) {}

// Keeps the nodes in a separate memory, because the file may already hold views of later
// observations.
Mapper::Mapper(MemoryFile memory, const std::optional<PictureSource>& source,
               const MapperOptions& options)
    : options_(options),
      file_(std::move(memory)),
      encoder_(file_.header(), source.value_or(file_.header().source)),
      node_views_(file_.header().shape, file_.header().full_scale, file_.header().elevations),
      mapper_(node_views_, options.mapping, options.odometry, options.closure, options.graph) {
  if (options.odometry.camera_height_m > 0.0) {
    require_known_elevations(source.value_or(file_.header().source), file_.path().string());
  }
}

Mapper::EncodedView Mapper::encode(const Observation& observation) const {
  const ReferenceInfo info{observation.name, observation.pose, observation.stamp_s};
  if (!options_.thumbnails) {
    return {encoder_.signature(observation), info, observation.odometry, {}};
  }
  const Panorama panorama = encoder_.panorama(observation);
  return {encoder_.signature(panorama), info, observation.odometry, encode_thumbnail(panorama)};
}

bool Mapper::add(EncodedView encoded) {
  const std::size_t number = observation_count_++;
  has_all_odometry_ = has_all_odometry_ && encoded.odometry.has_value();
  has_any_pose_ = has_any_pose_ || encoded.info.pose.has_value();
  OdometryView view(std::move(encoded.signature));
  auto start = Clock::now();
  const bool is_node = mapper_.is_new(view);
  result_.mapping_s += seconds_since(start);
  if (!is_node) {
    ++result_.skipped;
    return false;
  }
  const NewView added{std::move(encoded.info), pack(view.signature, file_.header().full_scale),
                      std::move(encoded.thumbnail)};
  if (added.info.pose) remove_positions_from_map(file_);
  const auto known = file_.find(added.info.name);
  const ViewId id = known ? *known : append(added);
  is_last_node_new_ = !known;
  std::optional<Pose2> moved;
  ++nodes_since_odometry_;
  if (last_odometry_ && encoded.odometry) moved = inverse(*last_odometry_) * *encoded.odometry;
  start = Clock::now();
  try {
    node_views_.append_with_id(id, added.signature, added.info);
    static_cast<void>(mapper_.add(id, std::move(view), moved, nodes_since_odometry_));
  } catch (const ContractError& error) {
    throw FileError(file_.path().string(), added.info.name + ": " + error.what());
  }
  result_.mapping_s += seconds_since(start);
  result_.observations.push_back(number);
  if (encoded.odometry) {
    last_odometry_ = encoded.odometry;
    nodes_since_odometry_ = 0;
  }
  return true;
}

// Appends a view, which begins a path (`read_path_starts`) unless it follows the file's last view.
ViewId Mapper::append(const NewView& view) {
  const std::vector<ViewId> stored = is_last_node_new_ ? std::vector<ViewId>() : file_.views();
  const auto nodes = node_views_.views();
  if (stored.empty() || (!nodes.empty() && nodes.back() == stored.back())) {
    return file_.append(view);
  }
  ViewId id;
  file_.change([&] {
    id = file_.append(view);
    add_path_starts(file_, {&id, 1});
  });
  return id;
}

Mapper::Result Mapper::map(const Dataset& recording, Executor& executor,
                           const std::function<void()>& mapped, const SkipImage& skipped) {
  process_in_order(
      recording.entries.size(), executor,
      [&](std::size_t i) { return encode(read_observation(recording.entries[i])); },
      [&](std::size_t, EncodedView&& encoded) {
        add(std::move(encoded));
        if (mapped) mapped();
      },
      [&](std::size_t i, const std::exception_ptr& failure) {
        if (!skipped) std::rethrow_exception(failure);
        skipped(i, failure);
        skip();
      });
  return finish();
}

LengthUnit Mapper::current_unit() const {
  const bool is_by_wheels = options_.mapping.wheels && has_all_odometry_;
  return is_by_wheels || mapper_.is_metric() || options_.is_scale_known ? LengthUnit::metres
                                                                        : LengthUnit::view_steps;
}

Mapper::Result Mapper::finish() {
  const auto start = Clock::now();
  mapper_.finish();
  result_.mapping_s += seconds_since(start);
  result_.map = mapper_.map();
  result_.wheels = options_.mapping.wheels && has_all_odometry_;
  result_.unit = current_unit();
  result_.is_former_scale = false;
  result_.scale_m.reset();
  if (result_.unit == LengthUnit::metres) result_.scale_m = mapper_.scale_m();
  if (!has_any_pose_ && (has_positions_from_map(file_) || file_.info().views_with_position == 0)) {
    store_map(file_, result_.map, result_.unit);
    if (const auto stored = file_.map(map_name)) result_.map = *stored;
    result_.is_former_scale = result_.unit != read_length_unit(file_);
    if (result_.is_former_scale) {
      result_.unit = LengthUnit::metres;
      const auto factor = compare_lengths(mapper_.map(), result_.map);
      if (factor) result_.scale_m = *factor * mapper_.scale_m();
    }
    return result_;
  }
  std::vector<Link> links;
  for (const TopologicalMap::Edge& edge : result_.map.edges)
    links.push_back({edge.a, edge.b, edge.kind});
  file_.change([&] {
    file_.link(links);
    file_.save_map(map_name, result_.map);
    store_own_map_unit(file_, result_.unit);
    learn_and_store_models(file_);
  });
  return result_;
}

}  // namespace panonav
