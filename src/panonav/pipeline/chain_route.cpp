#include "panonav/pipeline/chain_route.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/line_encoder.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav {

ChainSummary summarise_chain(const SnapshotChain& chain) {
  ChainSummary summary;
  summary.snapshots = chain.snapshots();
  summary.way_points = chain.nodes().size() - summary.snapshots;
  summary.length_m = chain.length_m();
  summary.bytes = chain.pack().size();
  if (summary.length_m > 0.0) {
    summary.bytes_per_m = static_cast<double>(summary.bytes) / summary.length_m;
  }
  if (summary.snapshots > 1) {
    summary.spacing_m = summary.length_m / static_cast<double>(summary.snapshots - 1);
  }
  summary.expected_offset_m = chain.odometry().position_error_m(summary.spacing_m);
  return summary;
}

namespace {

// Throws FileError if a drive cannot be stored as a chain of this name.
void check_new_chain(const MemoryFile& memory, const std::string& name, const DrivePoses& drive) {
  if (memory.route_method(name)) {
    throw FileError(memory.path().string(),
                    "already contains the route '" + name +
                        "'; allowed for the name of a chain: one that no route has");
  }
  if (drive.assumed_unit_m) {
    throw FileError(drive.drive.folder.string(),
                    "has poses in view steps; allowed for a chain: metres of odometry, of "
                    "positions, or of a map that panonav scale has scaled");
  }
}

SnapshotShape limit_shape(SnapshotShape shape, const MemoryFile& memory) {
  shape.rows = std::min(shape.rows, memory.header().shape.rows);
  shape.components = std::min(shape.components, memory.header().shape.components);
  return shape;
}

// Passes the views of a drive in their order, each with the motion since the one before.
void add_drive(const MemoryFile& memory, const DrivePoses& drive, Executor& executor,
               const std::function<void()>& progress,
               const std::function<void(const HomingView&, const Pose2&)>& add) {
  const HomingEncoder encoder(memory.header(), drive.drive.source);
  process_in_order(
      drive.drive.entries.size(), executor,
      [&](std::size_t i) {
        return encoder.view(encoder.panorama(read_observation(drive.drive.entries[i])));
      },
      [&](std::size_t i, HomingView&& view) {
        add(view, i == 0 ? Pose2{} : inverse(drive.poses[i - 1]) * drive.poses[i]);
        if (progress) progress();
      });
}

}  // namespace

SnapshotChain record_chain(MemoryFile& memory, const std::string& name, const DrivePoses& drive,
                           const ChainSpacing& spacing, const ChainOdometry& odometry,
                           Executor& executor, const std::function<void()>& progress) {
  check_new_chain(memory, name, drive);
  ChainRecorder recorder(limit_shape({}, memory), spacing, odometry);
  add_drive(memory, drive, executor, progress,
            [&](const HomingView& view, const Pose2& moved) { recorder.add(view, moved); });
  SnapshotChain chain = recorder.finish();
  memory.save_chain(name, chain);
  return chain;
}

HomeArea learn_home_area(MemoryFile& memory, const std::string& name, const DrivePoses& walk,
                         const HomeAreaOptions& options, Executor& executor,
                         const std::function<void()>& progress) {
  check_new_chain(memory, name, walk);
  HomeAreaLearner learner(limit_shape({}, memory), options);
  add_drive(memory, walk, executor, progress,
            [&](const HomingView& view, const Pose2& moved) { learner.add(view, moved); });
  HomeArea area = learner.finish(executor);
  memory.save_chain(name, area.chain);
  return area;
}

namespace {

SnapshotChain load_chain(const MemoryFile& memory, const std::optional<std::string>& name) {
  return memory.chain(find_route_name(memory, name)).value();
}

const Pose2& require_odometry(const Observation& observation) {
  if (!observation.odometry) {
    throw ContractError("odometry of the observation", "unknown",
                        "known for each image along a chain of snapshots");
  }
  return *observation.odometry;
}

}  // namespace

ChainGuide::ChainGuide(const MemoryFile& memory, const std::optional<PictureSource>& source,
                       const std::optional<std::string>& name, ChainDirection direction,
                       const ChainFollowerOptions& options)
    : chain_(load_chain(memory, name)),
      encoder_(memory.header(), source.value_or(memory.header().source)),
      follower_(chain_, direction, options) {}

ChainDecision ChainGuide::step(const HomingView& view, const Pose2& odometry) {
  const Pose2 moved = odometry_ ? inverse(*odometry_) * odometry : Pose2{};
  odometry_ = odometry;
  return follower_.decide(view, moved);
}

ChainDecision ChainGuide::step(const Observation& observation) {
  return step(encode(observation), require_odometry(observation));
}

std::size_t ChainGuide::snapshot_number(std::size_t node) const {
  const auto nodes = chain_.nodes().first(node + 1);
  return static_cast<std::size_t>(
      std::count_if(nodes.begin(), nodes.end(), [](const auto& n) { return n.has_snapshot(); }));
}

HomeAreaGuide::HomeAreaGuide(const MemoryFile& memory, const std::optional<PictureSource>& source,
                             const std::optional<std::string>& name, const OdometryNoise& noise,
                             const HomeFinderOptions& options)
    : finder_(load_chain(memory, name), noise, options),
      encoder_(memory.header(), source.value_or(memory.header().source)) {}

HomeStep HomeAreaGuide::step(const Observation& observation, bool is_back) {
  const Pose2& odometry = require_odometry(observation);
  if (odometry_) finder_.move(inverse(*odometry_) * odometry);
  odometry_ = odometry;
  if (finder_.may_be_near()) finder_.see(encoder_.view(encoder_.panorama(observation)));
  HomeStep step;
  if (is_back) step.decision = finder_.decide();
  step.pose = finder_.area_from_robot();
  const Point2 home = inverse(step.pose) * Point2{};
  step.distance_m = distance(home, {});
  step.direction_rad = std::atan2(home.y_m, home.x_m);
  step.deviation_m = finder_.deviation_m();
  step.drift_m_per_m = finder_.drift_m_per_m();
  return step;
}

const char* to_string(ChainState state) {
  switch (state) {
    case ChainState::travelling:
      return "travelling";
    case ChainState::homing:
      return "homing";
    case ChainState::searching:
      return "searching";
    case ChainState::arrived:
      return "arrived";
    case ChainState::lost:
      return "lost";
  }
  return "lost";
}

}  // namespace panonav
