#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "panonav/core/executor.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/mapping/topological_mapper.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for making a map of observations.
struct MapperOptions {
  MappingOptions mapping;          ///< which images become nodes, and how nodes are joined
  VisualOdometryOptions odometry;  ///< how motions are estimated from views
  LoopClosureOptions closure;      ///< which loop closures are accepted
  PoseGraphOptions graph;          ///< how the pose graph is optimised
  bool thumbnails = true;          ///< keep small pictures of the views
  /// True: `odometry.scale_m` is known, so that lengths by it are in metres.
  bool is_scale_known = false;
};

/// Maps observations in the order in which they were taken: appends the views that become nodes to
/// a memory file, and stores the map there as "map". Does not append views whose names the file
/// already has; their ids must ascend in the order of the observations. Appended views remain even
/// if a later call fails. A node without odometry is joined by its view; the next odometry then
/// joins the nodes before and after. `docs/equations.md` and `TopologicalMapper` describe the
/// method. Only `encode` may be called from several threads concurrently.
class Mapper {
 public:
  /// Result of mapping.
  struct Result {
    TopologicalMap map;                     ///< all nodes and edges
    std::vector<std::size_t> observations;  ///< for each node, the index of its observation
    std::size_t skipped = 0;                ///< number of observations too similar to a node
    /// Metres per unit of visual displacement; nullopt if it is not known (`unit`).
    std::optional<double> scale_m;
    LengthUnit unit = LengthUnit::metres;  ///< of the map in the file and of `map`
    bool is_former_scale =
        false;               ///< true: metres come from the memory's earlier map (`store_map`)
    bool wheels = false;     ///< true: motions come from odometry, which all observations had
    double mapping_s = 0.0;  ///< time of the mapping alone, without decoding and file access
  };

  /// An encoded observation that is not in the map yet.
  struct EncodedView {
    FourierSignature signature;           ///< unpacked, as visual odometry needs it
    ReferenceInfo info;                   ///< name, pose and stamp, as the memory keeps them
    std::optional<Pose2> odometry;        ///< absolute, in its own frame; empty: unknown
    std::vector<std::uint8_t> thumbnail;  ///< PNG or JPEG file; empty if thumbnails are not kept
  };

  /// Pictures come from the memory's own camera. Throws FileError as `MemoryFile::open`,
  /// OptionError.
  explicit Mapper(const std::filesystem::path& memory, const MapperOptions& options = {});
  /// Uses a file that is open for writing. `source`: layout of the images; nullopt: that of the
  /// memory. Throws ContractError like `ViewEncoder`; OptionError.
  Mapper(MemoryFile memory, const std::optional<PictureSource>& source,
         const MapperOptions& options = {});
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  /// Encodes an observation for `add`; several threads may encode the next observations
  /// concurrently. Throws as `ViewEncoder::panorama`.
  [[nodiscard]] EncodedView encode(const Observation& observation) const;
  /// Adds the next observation. Returns true if it became a node. Throws as `encode`, FileError.
  bool add(EncodedView encoded);
  /// Encodes and adds the next observation.
  bool add(const Observation& observation) { return add(encode(observation)); }

  /// Counts an observation that cannot be used, so that `Result::observations` are as before.
  void skip() noexcept { ++observation_count_; }

  /// Adds all observations of a recording and finishes. Calls `mapped` after each picture, and
  /// `skipped` for one that cannot be used; without it, throws FileError then. Throws as `add`.
  Result map(const Dataset& recording, Executor& executor, const std::function<void()>& mapped = {},
             const SkipImage& skipped = {});

  /// Optimises the nodes that are not optimised yet, and stores the map and a link for each of its
  /// edges. If no observation and no other view has a position from a data set, the views get the
  /// poses of the map (`store_map`). More observations may follow. Throws FileError.
  Result finish();

  /// Returns a copy of the present map, for display; `finish` will still move nodes.
  [[nodiscard]] TopologicalMap current_map() const { return mapper_.map(); }
  /// Returns the unit of the present map as far as its observations show it. In view steps, lengths
  /// are not scaled yet.
  [[nodiscard]] LengthUnit current_unit() const;
  /// Returns the file to which views are appended.
  [[nodiscard]] const MemoryFile& memory() const noexcept { return file_; }
  /// Returns the encoder that makes views of pictures.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept { return encoder_; }

 private:
  ViewId append(const NewView& view);

  MapperOptions options_;
  MemoryFile file_;
  ViewEncoder encoder_;
  VisualMemory node_views_;  // the nodes so far
  TopologicalMapper mapper_;
  Result result_;
  std::size_t observation_count_ = 0;
  std::optional<Pose2> last_odometry_;  // of the last node that has one
  std::size_t nodes_since_odometry_ = 0;
  bool has_all_odometry_ = true;
  bool has_any_pose_ = false;
  bool is_last_node_new_ = false;  // the last node is a view that this object appended
};

/// Returns the component with the largest number of nodes; of ties the first one.
[[nodiscard]] std::size_t find_largest_component(const TopologicalMap& map);

}  // namespace panonav
