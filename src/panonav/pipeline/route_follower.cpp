#include "panonav/pipeline/route_follower.hpp"

#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

RouteFollower::RouteFollower(const std::filesystem::path& memory,
                             const RouteFollowerOptions& options)
    : RouteFollower(MemoryFile::open(memory, Access::read_only), std::nullopt, options) {}

RouteFollower::RouteFollower(const MemoryFile& memory, const std::optional<PictureSource>& source,
                             const RouteFollowerOptions& options)
    : options_(options),
      name_(find_route_name(memory, options.name)),
      source_(read_route_source(memory, name_, memory.route(name_).value().columns())),
      encoder_(source.value_or(memory.header().source), source_),
      tracker_(load_route_to_follow(memory, name_), options.tracker, options.fit),
      changes_(tracker_.lines().poses()) {}

RouteFollower::Step RouteFollower::step(std::vector<float> line,
                                        const std::optional<Pose2>& odometry) {
  RouteFollower::Step step{std::move(line), std::nullopt, {}};
  if (options_.use_odometry && odometry) {
    step.fix = tracker_.track(step.line, inverse(odometry_.value_or(*odometry)) * *odometry);
  } else {
    step.fix = tracker_.search(step.line);
  }
  odometry_ = odometry;
  if (step.fix) {
    step.changed = changes_.add(*step.fix);
  } else {
    changes_.reset();
  }
  return step;
}

}  // namespace panonav
