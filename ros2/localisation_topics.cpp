#include "ros2/localisation_topics.hpp"

#include <utility>

namespace panonav::ros2 {

LocalisationTopics::LocalisationTopics(Participant& participant, FrameNames frames)
    : frames_(std::move(frames)),
      transforms_(participant, "/tf", {.depth = 100}),
      poses_(participant, "~/pose", {.depth = 1, .transient_local = true}),
      particles_(participant, "~/particles"),
      references_(participant, "~/references", {.depth = 1, .transient_local = true}),
      best_matches_(participant, "~/best_match/compressed"),
      diagnostics_(participant, "/diagnostics") {}

void LocalisationTopics::send_transform(const Pose2& map_from_odom, std::int64_t stamp_ns) {
  if (std::exchange(last_transform_ns_, stamp_ns) == stamp_ns) return;  // a clock that stands
  transforms_.publish({{{{stamp_ns, frames_.map}, frames_.odom, ros::pose_of(map_from_odom)}}});
}

void LocalisationTopics::publish_references(const VisualMemory& memory, std::int64_t now_ns) const {
  PointValues cloud;
  for (const ViewId view : memory.views()) {
    const auto& pose = memory.info(view).pose;
    if (pose) cloud.add(pose->position(), static_cast<double>(cloud.values.size() / 4));
  }
  references_.publish(cloud.message(now_ns, frames_.map, "number"));
}

void LocalisationTopics::publish_estimate(RunMoment& moment, std::int64_t stamp_ns,
                                          const LoadedMemory& memory,
                                          const PackedSignature& view) const {
  constexpr std::size_t shown_particles = 500;  // of thousands, no more tell a person more
  if (moment.sure && moment.pose) poses_.publish(pose_message(moment, stamp_ns, frames_.map));
  if (particles_.subscribers() > 0) {
    moment.particles = even_sample(memory.tracker.localiser().particles(), shown_particles);
    particles_.publish(poses_message(moment.particles, stamp_ns, frames_.map));
  }
  if (best_matches_.subscribers() > 0) {
    const auto found = memory.tracker.memory().search(view, {.top = 1});
    const auto thumbnail = memory.file.thumbnail(found.matches.front().view);
    if (thumbnail) best_matches_.publish({{stamp_ns, frames_.base}, "png", *thumbnail});
  }
}

void LocalisationTopics::publish_state(const RunMoment& moment, std::int64_t stamp_ns) const {
  diagnostics_.publish(diagnostics_message(moment, stamp_ns));
}

}  // namespace panonav::ros2
