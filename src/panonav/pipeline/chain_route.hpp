#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "panonav/core/executor.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/pipeline/homing_guide.hpp"
#include "panonav/pipeline/observation.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/route/chain_follower.hpp"
#include "panonav/route/chain_recorder.hpp"
#include "panonav/route/home_area.hpp"
#include "panonav/route/home_finder.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Size and spacing of a chain of snapshots.
struct ChainSummary {
  std::size_t snapshots = 0;   ///< number of snapshots
  std::size_t way_points = 0;  ///< number of nodes without a snapshot
  double length_m = 0.0;       ///< sum of all legs
  std::uint64_t bytes = 0;     ///< of the packed form
  double bytes_per_m = 0.0;    ///< 0 for a chain without length
  double spacing_m = 0.0;      ///< mean distance between snapshots along the legs; 0: one snapshot
  /// Offset to be expected from the errors of odometry, as the chain limits them, after travelling
  /// `spacing_m` from a snapshot.
  double expected_offset_m = 0.0;
};
/// Computes the size and spacing of a chain. Throws ContractError as `SnapshotChain::pack`.
[[nodiscard]] ChainSummary summarise_chain(const SnapshotChain& chain);

/// Records a drive as a chain of snapshots and stores it in the memory under a name. The motions
/// between images are those of the poses, one for each image. Snapshots have up to 8 rows and 6
/// components, as far as views of the memory have them. Calls `progress` after each image. Throws
/// FileError if the memory has a route of that name, if poses are in view steps, or on an image
/// that cannot be read; OptionError.
SnapshotChain record_chain(MemoryFile& memory, const std::string& name, const DrivePoses& drive,
                           const ChainSpacing& spacing, const ChainOdometry& odometry,
                           Executor& executor, const std::function<void()>& progress = {});

/// Decides the motions of a robot along a stored chain, observation by observation.
class ChainGuide {
 public:
  /// `source`: layout of the images; nullopt: that of the memory. `name`: of the route; nullopt:
  /// the only one. Throws FileError if there is no such route or if it is no chain; OptionError.
  ChainGuide(const MemoryFile& memory, const std::optional<PictureSource>& source,
             const std::optional<std::string>& name, ChainDirection direction,
             const ChainFollowerOptions& options = {});

  /// Makes the view of an observation for `step`; several threads may encode the next observations
  /// concurrently. Throws as `HomingEncoder::panorama`.
  [[nodiscard]] HomingView encode(const Observation& observation) const {
    return encoder_.view(encoder_.panorama(observation));
  }
  /// Decides the next motion by the next view and the pose by odometry at it.
  [[nodiscard]] ChainDecision step(const HomingView& view, const Pose2& odometry);
  /// Encodes the next observation and decides the next motion. Throws as `encode`, and
  /// ContractError if the observation has no odometry.
  [[nodiscard]] ChainDecision step(const Observation& observation);

  /// Returns the estimated pose in the frame of the chain: that of the first image of its
  /// recording.
  [[nodiscard]] const Pose2& chain_from_robot() const noexcept {
    return follower_.chain_from_robot();
  }
  /// Returns the number of the snapshot at a node, from 1 in the order of the recording.
  [[nodiscard]] std::size_t snapshot_number(std::size_t node) const;
  /// Returns the chain.
  [[nodiscard]] const SnapshotChain& chain() const noexcept { return chain_; }

 private:
  SnapshotChain chain_;
  HomingEncoder encoder_;
  ChainFollower follower_;
  std::optional<Pose2> odometry_;  // at the last view
};

/// Learns the surroundings of the place at which a walk begins, and stores them in the memory as a
/// chain whose first snapshot is home. The motions between images are those of the poses. Throws as
/// `record_chain`. `progress` is called after each image.
HomeArea learn_home_area(MemoryFile& memory, const std::string& name, const DrivePoses& walk,
                         const HomeAreaOptions& options, Executor& executor,
                         const std::function<void()>& progress = {});

/// Where a robot is relative to its home, and its next motion.
struct HomeStep {
  /// Motion on the way back; nullopt on the way out.
  std::optional<ChainDecision> decision;
  Pose2 pose;                ///< area_from_robot
  double distance_m = 0.0;   ///< from home
  double direction_rad = 0;  ///< to home, in the robot frame
  double deviation_m = 0.0;  ///< of the position, in the worst direction
  Point2 drift_m_per_m;      ///< that odometry does not see, along the axes of the area
};

/// Leads a robot back to a home whose surroundings are stored in a memory, observation by
/// observation.
class HomeAreaGuide {
 public:
  /// The robot is at home, at the heading of the learning walk's first view. `source` and `name` as
  /// of `ChainGuide`. Throws as `ChainGuide`.
  HomeAreaGuide(const MemoryFile& memory, const std::optional<PictureSource>& source,
                const std::optional<std::string>& name, const OdometryNoise& noise = {},
                const HomeFinderOptions& options = {});

  /// Takes the next observation; its image is used only where the robot may be near home.
  /// `is_back`: the robot is on the way back, so the next motion is decided. Throws as
  /// `ChainGuide::step`.
  [[nodiscard]] HomeStep step(const Observation& observation, bool is_back);

  /// Returns the area.
  [[nodiscard]] const SnapshotChain& area() const noexcept { return finder_.area(); }

 private:
  HomeFinder finder_;
  HomingEncoder encoder_;
  std::optional<Pose2> odometry_;  // at the last observation
};

/// Returns the word for a state.
[[nodiscard]] const char* to_string(ChainState state);

}  // namespace panonav
