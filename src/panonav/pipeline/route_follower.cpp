#include "panonav/pipeline/route_follower.hpp"

#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/learnt_route.hpp"

namespace panonav {

namespace {

RouteTracker make_tracker(const MemoryFile& memory, const std::string& name,
                          const RouteSource& source, const RouteFollowerOptions& options) {
  const RoutePanorama route = load_route_to_follow(memory, name);
  const RouteFitOptions fit = scale_fit(options.fit, source);
  return RouteTracker(route, options.tracker, fit,
                      load_route_limits(memory, name, route, options.tracker, fit));
}

}  // namespace

RouteFollower::RouteFollower(const std::filesystem::path& memory,
                             const RouteFollowerOptions& options)
    : RouteFollower(MemoryFile::open(memory, Access::read_only), std::nullopt, options) {}

RouteFollower::RouteFollower(const MemoryFile& memory, const std::optional<PictureSource>& source,
                             const RouteFollowerOptions& options)
    : options_(options),
      name_(find_route_name(memory, options.name)),
      source_(read_route_source(memory, name_, memory.route(name_).value().columns())),
      views_(memory.header(), source.value_or(memory.header().source)),
      encoder_(source.value_or(memory.header().source), source_),
      tracker_(make_tracker(memory, name_, source_, options)),
      changes_(tracker_.lines().poses()) {}

RouteFollower::Step RouteFollower::step(std::vector<float> line,
                                        const std::optional<Pose2>& odometry) {
  RouteFollower::Step step{std::move(line), std::nullopt, {}};
  // Odometry is in metres, which a route in view steps does not have.
  if (options_.use_odometry && odometry && !source_.assumed_unit_m) {
    step.fix = tracker_.track(step.line, inverse(odometry_.value_or(*odometry)) * *odometry);
  } else {
    step.fix = tracker_.search(step.line);
  }
  // A fix without odometry is where the next motion begins; otherwise the last odometry is.
  if (odometry || step.fix) odometry_ = odometry;
  if (step.fix) {
    step.changed = changes_.add(*step.fix);
  } else {
    changes_.reset();
  }
  return step;
}

}  // namespace panonav
