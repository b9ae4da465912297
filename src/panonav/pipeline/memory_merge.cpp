#include "panonav/pipeline/memory_merge.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/temporary_file.hpp"
#include "panonav/core/text.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/learnt_route.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/mapper.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/memory_address.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;
using NewIds = std::map<ViewId, ViewId>;  // id in the new memory, by id in the old one

std::optional<Pose2> get_complete_pose(const ReferenceInfo& info) {
  if (!info.pose || !info.pose->heading_rad) return std::nullopt;
  return Pose2{info.pose->x_m, info.pose->y_m, *info.pose->heading_rad};
}

/// Returns the file's map, or makes one from the views' poses on a floor if there is none. The
/// largest connected component becomes number 0.
TopologicalMap read_or_make_map(const MemoryFile& file, const VisualMemory& views,
                                std::string_view floor) {
  TopologicalMap map = file.map(map_name).value_or(TopologicalMap{});
  if (map.nodes.empty()) {
    for (const ViewId view : views.views()) {
      const auto pose = get_complete_pose(views.info(view));
      if (!pose || floor_of(views.info(view).name) != floor) continue;
      if (!map.nodes.empty()) {
        const TopologicalMap::Node& before = map.nodes.back();
        map.edges.push_back({before.view, view, inverse(before.pose) * *pose});
      }
      map.nodes.push_back({view, *pose, 0});
    }
    return map;
  }
  const std::size_t largest = find_largest_component(map);
  for (TopologicalMap::Node& node : map.nodes) {
    if (node.component == largest) {
      node.component = 0;
    } else if (node.component < largest) {
      ++node.component;
    }
  }
  // Poses from a recording are more accurate than those estimated by the map, so they replace the
  // map's.
  std::size_t nodes = 0;
  std::size_t positions = 0;
  std::size_t poses = 0;
  for (const TopologicalMap::Node& node : map.nodes) {
    if (node.component != 0) continue;
    ++nodes;
    positions += views.info(node.view).pose.has_value() ? 1 : 0;
    poses += get_complete_pose(views.info(node.view)).has_value() ? 1 : 0;
  }
  if (poses < nodes && positions > 0) {
    throw FileError(file.path().string(),
                    "has positions in another frame than its map: of " + std::to_string(nodes) +
                        " views of the map " + std::to_string(positions) + " have a position and " +
                        std::to_string(poses) + " a heading; a merge needs both for all or none");
  }
  if (poses == nodes) {
    for (TopologicalMap::Node& node : map.nodes) {
      if (node.component == 0) node.pose = *get_complete_pose(views.info(node.view));
    }
  }
  return map;
}

TopologicalMap select_components(const TopologicalMap& map, bool largest) {
  TopologicalMap part;
  for (const TopologicalMap::Node& node : map.nodes) {
    if ((node.component == 0) == largest) part.nodes.push_back(node);
  }
  const auto is_in = [&](ViewId view) {
    return std::ranges::binary_search(part.nodes, view, {}, &TopologicalMap::Node::view);
  };
  for (const TopologicalMap::Edge& edge : map.edges) {
    if (is_in(edge.a) && is_in(edge.b)) part.edges.push_back(edge);
  }
  return part;
}

TopologicalMap replace_ids(const TopologicalMap& map, const NewIds& ids) {
  TopologicalMap result;
  for (TopologicalMap::Node node : map.nodes) {
    node.view = ids.at(node.view);
    result.nodes.push_back(node);
  }
  std::ranges::sort(result.nodes, {}, &TopologicalMap::Node::view);
  for (TopologicalMap::Edge edge : map.edges) {
    edge.a = ids.at(edge.a);
    edge.b = ids.at(edge.b);
    result.edges.push_back(edge);
  }
  return result;
}

/// Appends a map whose poses are in separate frames, as separate components. Leaves out nodes that
/// `map` already has, and their edges.
void append_disconnected(TopologicalMap& map, const TopologicalMap& more) {
  std::size_t next = 0;
  for (const TopologicalMap::Node& node : map.nodes) next = std::max(next, node.component + 1);
  const std::vector<TopologicalMap::Node> there = map.nodes;
  const auto is_there = [&](ViewId view) {
    return std::ranges::binary_search(there, view, {}, &TopologicalMap::Node::view);
  };
  for (TopologicalMap::Node node : more.nodes) {
    if (is_there(node.view)) continue;
    node.component += next;
    map.nodes.push_back(node);
  }
  for (const TopologicalMap::Edge& edge : more.edges) {
    if (!is_there(edge.a) && !is_there(edge.b)) map.edges.push_back(edge);
  }
  std::ranges::sort(map.nodes, {}, &TopologicalMap::Node::view);
  renumber_components(map);
}

void require_same_settings(const MemoryFile& first, const MemoryFile& second) {
  const auto require_same = [&](const char* what, bool same) {
    if (same) return;
    throw ContractError(
        std::string(what) + " of " + second.path().string(), "another",
        "that of " + first.path().string() +
            ", because views that were made with other settings cannot be compared");
  };
  const MemoryHeader& a = first.header();
  const MemoryHeader& b = second.header();
  require_same("rows and components", a.shape == b.shape);
  require_same("elevations of the rows", a.elevations == b.elevations);
  require_same("number of columns", a.panorama_columns == b.panorama_columns);
  require_same("preprocessing", a.preprocessing == b.preprocessing);
  require_same("features for narrow pictures (option narrow)",
               has_narrow_features(first) == has_narrow_features(second));
}

/// Returns `name` if it is free, else the name prefixed by that of its file, on the same floor.
template <class IsTaken>
std::string make_free_name(const std::string& name, const MemoryFile& from,
                           const IsTaken& is_taken) {
  if (!is_taken(name)) return name;
  const std::string file = fs::path(memory_name(from.path())).stem().string();
  const std::string base = add_prefix_on_floor(file + "/", name);
  std::string new_name = base;
  for (int i = 2; is_taken(new_name); ++i) new_name = base + " (" + std::to_string(i) + ")";
  return new_name;
}

/// Files of a memory that is being written: next to its target, or in the folder of temporary files
/// if the target is on a server. A locked file reserves their names, so that no two processes use
/// the same. Removes files that a killed process has left next to the target.
class UnfinishedMemory {
 public:
  explicit UnfinishedMemory(const fs::path& target)
      : lock_(name_files(target)), path_(lock_.path().string() + "-memory") {
    remove_files();
  }
  ~UnfinishedMemory() { remove_files(); }
  UnfinishedMemory(const UnfinishedMemory&) = delete;
  UnfinishedMemory& operator=(const UnfinishedMemory&) = delete;

  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

 private:
  static fs::path name_files(const fs::path& target) {
    if (!is_server_address(target)) return target.string() + ".unfinished";
    std::random_device device;  // other processes may use the same folder
    const std::uint64_t number = (std::uint64_t{device()} << 32U) | device();
    return fs::temp_directory_path() / ("merged." + to_hex_digits(number, 16));
  }
  void remove_files() const noexcept {
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
      fs::remove(path_.string() + suffix, ignored);
    }
  }

  TemporaryFile lock_;
  fs::path path_;
};

bool is_in_view_steps(const MemoryFile& file) {
  return read_length_unit(file) == LengthUnit::view_steps;
}

/// True if all positions of two memories come from maps.
bool are_positions_from_maps(const MemoryFile& first, const MemoryFile& second) {
  const auto has_no_others = [](const MemoryFile& file) {
    return has_positions_from_map(file) || file.info().views_with_position == 0;
  };
  return has_no_others(first) && has_no_others(second) &&
         (has_positions_from_map(first) || has_positions_from_map(second));
}

/// Throws FileError if one of two memories has positions in metres and the other in view steps.
void require_same_unit(const MemoryFile& first, const MemoryFile& second) {
  if (is_in_view_steps(first) == is_in_view_steps(second)) return;
  const MemoryFile& unscaled = is_in_view_steps(first) ? first : second;
  const MemoryFile& other = is_in_view_steps(first) ? second : first;
  if (other.info().views_with_position == 0) return;
  throw FileError(unscaled.path().string(),
                  "has positions in view steps, those of " + other.path().string() +
                      " are in metres; first scale it to metres: panonav scale " +
                      quote_for_shell(unscaled.path().string()) +
                      ", with the option distance (two of its views and the distance between "
                      "them)");
}

class Merge {
 public:
  Merge(const MemoryFile& first, const MemoryFile& second, const SessionAlignmentOptions& alignment,
        const PoseGraphOptions& graph)
      : files_{&first, &second},
        views_{first.load(), second.load()},
        positions_from_maps_(are_positions_from_maps(first, second)),
        floor_(find_shared_floor()),
        alignment_(alignment),
        graph_(graph) {}

  MergedMemory write(MemoryFile& file, const std::function<void()>& advance) {
    for (std::size_t i = 0; i < 2; ++i) add_views(file, i, advance);
    for (std::size_t i = 0; i < 2; ++i) copy_path_starts(file, i);
    const VisualMemory all = file.load();
    TopologicalMap map = join_maps(all);
    add_links(file);
    if (positions_from_maps_) {
      const bool is_unscaled = is_in_view_steps(*files_[0]) || is_in_view_steps(*files_[1]);
      store_map(file, map, is_unscaled ? LengthUnit::view_steps : LengthUnit::metres);
      const double unit_m = read_assumed_unit_m(file);
      if (result_.alignment) {
        result_.alignment->first_from_second.x_m /= unit_m;
        result_.alignment->first_from_second.y_m /= unit_m;
      }
    } else {
      if (!map.nodes.empty()) file.save_map(map_name, map);
      set_poses(file, map);
    }
    for (std::size_t i = 0; i < 2; ++i) add_routes(file, i);
    result_.views = all.size();
    result_.has_shared_floor = floor_.has_value();
    result_.connected_components = count_components(map);
    return result_;
  }

 private:
  void add_views(MemoryFile& file, std::size_t from, const std::function<void()>& advance) {
    constexpr std::size_t batch = 256;
    std::vector<NewView> waiting;
    std::vector<ViewId> ids;
    const auto append = [&] {
      const std::vector<ViewId> appended = file.append(waiting);
      for (std::size_t i = 0; i < appended.size(); ++i) ids_[from].emplace(ids[i], appended[i]);
      waiting.clear();
      ids.clear();
    };
    const VisualMemory& views = views_[from];
    for (const ViewId view : views.views()) {
      if (advance) advance();
      ReferenceInfo info = views.info(view);
      const PackedSignature signature = pack(views.signature(view), file.header().full_scale);
      if (from == 1) {
        const auto known = views_[0].find(info.name);
        if (known && is_same_picture(views_[0].packed(*known), signature)) {
          ids_[1].emplace(view, ids_[0].at(*known));
          ++result_.shared;
          continue;
        }
        const std::string name =
            make_free_name(info.name, *files_[1], [&](const std::string& new_name) {
              return views_[0].find(new_name) || (new_name != info.name && views.find(new_name));
            });
        if (name != info.name) ++result_.renamed;
        info.name = name;
      }
      waiting.push_back({std::move(info), signature,
                         files_[from]->thumbnail(view).value_or(Bytes{}),
                         files_[from]->features(view).value_or(Bytes{})});
      ids.push_back(view);
      if (waiting.size() == batch) append();
    }
    append();
  }

  /// Stores where the paths of a memory begin. Views that both memories have interrupt the
  /// second's.
  void copy_path_starts(MemoryFile& file, std::size_t from) const {
    const std::vector<ViewId> old_starts = read_path_starts(*files_[from]);
    std::vector<ViewId> starts;
    std::optional<ViewId> before;
    std::optional<ViewId> new_before;
    for (const auto& [old, view] : ids_[from]) {
      const bool is_start = !before || std::ranges::upper_bound(old_starts, *before) !=
                                           std::ranges::upper_bound(old_starts, old);
      const bool is_shared = from == 1 && !ids_[0].empty() && view <= ids_[0].rbegin()->second;
      if (!is_shared && (is_start || view.value != new_before->value + 1)) starts.push_back(view);
      before = old;
      new_before = view;
    }
    if (from == 0 && !starts.empty()) starts.erase(starts.begin());  // of the whole memory
    add_path_starts(file, starts);
  }

  TopologicalMap join_maps(const VisualMemory& all) {
    std::array own{read_or_make_map(*files_[0], views_[0], floor_.value_or("")),
                   read_or_make_map(*files_[1], views_[1], floor_.value_or(""))};
    for (std::size_t i = 0; i < 2; ++i) scale_lengths(own[i], read_assumed_unit_m(*files_[i]));
    const std::array maps{replace_ids(own[0], ids_[0]), replace_ids(own[1], ids_[1])};
    const std::array largest{select_components(maps[0], true), select_components(maps[1], true)};
    if (floor_) result_.alignment = align_sessions(all, largest[0], largest[1], alignment_);
    TopologicalMap map = largest[0];
    if (result_.alignment) {
      map = join_sessions(largest[0], largest[1], *result_.alignment, graph_);
    } else {
      append_disconnected(map, largest[1]);
    }
    for (const TopologicalMap& one : maps) append_disconnected(map, select_components(one, false));
    return map;
  }

  void add_links(MemoryFile& file) const {
    std::vector<Link> links;
    for (std::size_t i = 0; i < 2; ++i) {
      for (const Link& link : views_[i].links()) {
        links.push_back({ids_[i].at(link.a), ids_[i].at(link.b), link.kind});
      }
    }
    file.link(links);
  }

  /// Sets the poses of the second memory's views in the frame of the first, whose poses are kept
  /// unless the pose graph has moved them.
  void set_poses(MemoryFile& file, const TopologicalMap& map) {
    std::set<ViewId> of_first;
    for (const auto& both : ids_[0]) of_first.insert(both.second);
    for (const auto& [old, view] : ids_[1]) {
      const auto& pose = views_[1].info(old).pose;
      if (!pose || of_first.contains(view) || floor_of(views_[1].info(old).name) != floor_)
        continue;
      if (!result_.alignment) {
        file.set_pose(view, std::nullopt);
        ++result_.without_position;
        continue;
      }
      const Pose2& moved = result_.alignment->first_from_second;
      const Pose2 whole = moved * Pose2{pose->x_m, pose->y_m, pose->heading_rad.value_or(0.0)};
      ReferencePose there{whole.x_m, whole.y_m, std::nullopt};
      if (pose->heading_rad) there.heading_rad = whole.heading_rad;
      file.set_pose(view, there);
    }
    if (!result_.alignment) return;
    // Sets the poses of the joined component, as optimised by the pose graph.
    const std::size_t joined = map.nodes.front().component;
    for (const TopologicalMap::Node& node : map.nodes) {
      if (node.component != joined) continue;
      file.set_pose(node.view, ReferencePose{node.pose.x_m, node.pose.y_m, node.pose.heading_rad});
    }
  }

  /// Returns the name, or a free one like it, for a route of one of the memories.
  [[nodiscard]] std::string choose_route_name(const MemoryFile& file, const std::string& name,
                                              std::size_t from) {
    const auto used_names = file.route_names();
    std::string new_name = make_free_name(name, *files_[from], [&](const std::string& other) {
      return std::ranges::find(used_names, other) != used_names.end();
    });
    if (new_name != name) ++result_.renamed;
    return new_name;
  }

  void add_routes(MemoryFile& file, std::size_t from) {
    for (const std::string& name : files_[from]->route_names()) {
      if (files_[from]->route_method(name) == RouteMethod::chain) {
        // A chain is in a frame of its own.
        file.save_chain(choose_route_name(file, name, from), files_[from]->chain(name).value());
        continue;
      }
      RoutePanorama route = files_[from]->route(name).value();
      RouteSource source = read_route_source(*files_[from], name, route.columns());
      const double unit_m = source.assumed_unit_m ? read_assumed_unit_m(file) : 1.0;
      const double factor = source.assumed_unit_m.value_or(1.0) / unit_m;
      if (source.assumed_unit_m) source.assumed_unit_m = unit_m;
      if (source.map_scale) source.map_scale = read_map_scale(file);
      RoutePanorama moved(route.columns());
      for (std::size_t i = 0; i < route.size(); ++i) {
        Pose2 pose = route.poses()[i];
        pose.x_m *= factor;
        pose.y_m *= factor;
        if (from == 1 && result_.alignment) pose = result_.alignment->first_from_second * pose;
        moved.append(pose, route.line(i));
      }
      const std::string new_name = choose_route_name(file, name, from);
      file.append_route(new_name, moved);
      store_route_source(file, new_name, source);
      learn_and_store_route(file, new_name);
    }
  }

  /// Returns the floor of which both memories have views; nullopt: none. Throws FileError if there
  /// are several, as the frames of each would need an alignment of their own.
  [[nodiscard]] std::optional<std::string> find_shared_floor() const {
    std::vector<std::string> shared;
    std::ranges::set_intersection(list_floors(views_[0]), list_floors(views_[1]),
                                  std::back_inserter(shared));
    if (shared.size() > 1) {
      throw FileError(files_[1]->path().string(),
                      "has " + std::to_string(shared.size()) + " floors that " +
                          files_[0]->path().string() +
                          " has, too; allowed: one, so merge memories of single floors");
    }
    return shared.empty() ? std::nullopt : std::optional(shared.front());
  }

  std::array<const MemoryFile*, 2> files_;
  std::array<VisualMemory, 2> views_;
  bool positions_from_maps_;
  std::optional<std::string> floor_;  // that both memories have
  const SessionAlignmentOptions& alignment_;
  const PoseGraphOptions& graph_;
  std::array<NewIds, 2> ids_;
  MergedMemory result_;
};

}  // namespace

MergedMemory merge_memories(const std::filesystem::path& first, const std::filesystem::path& second,
                            const std::filesystem::path& memory,
                            const SessionAlignmentOptions& alignment, const PoseGraphOptions& graph,
                            const std::function<void()>& advance) {
  const MemoryFile a = MemoryFile::open(first, Access::read_only);
  const MemoryFile b = MemoryFile::open(second, Access::read_only);
  require_same_settings(a, b);
  require_same_unit(a, b);
  if (memory_exists(memory)) {
    throw FileError(mask_passwords(memory.string()),
                    "already exists; a merged memory is a new one");
  }
  const UnfinishedMemory unfinished(memory);
  MergedMemory result;
  MemoryFile file = MemoryFile::create(unfinished.path(), a.header());
  if (has_narrow_features(a)) set_narrow_features(file);
  Merge merge(a, b, alignment, graph);
  file.change([&] { result = merge.write(file, advance); });
  learn_and_store_models(file);
  file.copy_to(memory);
  return result;
}

}  // namespace panonav
