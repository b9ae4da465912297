#include "panonav/pipeline/visual_motion.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "panonav/core/text.hpp"
#include "panonav/mapping/topological_mapper.hpp"
#include "panonav/pipeline/observation_source.hpp"

namespace panonav {

namespace {

/// Estimates the scale in metres per unit of visual displacement, from nearest pairs of views with
/// positions.
double compute_scale(const VisualMemory& memory, const VisualOdometryOptions& options) {
  std::vector<ViewId> posed;
  for (const ViewId view : memory.views()) {
    if (memory.info(view).pose) posed.push_back(view);
  }
  const auto distance_m = [&](ViewId a, ViewId b) {
    return distance(memory.info(a).pose->position(), memory.info(b).pose->position());
  };
  constexpr std::size_t sampled = 64;
  const std::size_t every = std::max<std::size_t>(1, posed.size() / sampled);
  std::vector<KnownLength> known;
  for (std::size_t i = 0; i < posed.size(); i += every) {
    std::optional<ViewId> nearest;
    for (const ViewId other : posed) {
      const double off_m = distance_m(posed[i], other);
      if (off_m > 0.0 && (!nearest || off_m < distance_m(posed[i], *nearest))) nearest = other;
    }
    if (!nearest) continue;
    const auto step = visual_step(OdometryView(memory.signature(posed[i])),
                                  OdometryView(memory.signature(*nearest)), options);
    if (step) known.push_back({step->length_in_views, distance_m(posed[i], *nearest)});
  }
  return length_scale_m(known).value_or(options.scale_m);
}

}  // namespace

OdometryNoise visual_odometry_noise() {
  const MappingOptions mapping;
  return {.drive = DriveKind::holonomic,
          .translation_from_translation = mapping.step_deviation,
          .rotation_from_translation = mapping.turn_deviation};
}

VisualOdometry visual_odometry(const VisualMemory& memory) {
  VisualOdometryOptions options;
  options.scale_m = compute_scale(memory, options);
  return VisualOdometry(options);
}

std::string add_visual_odometry(Dataset& run, const VisualMemory& memory,
                                const ViewEncoder& encoder, Executor& executor) {
  VisualOdometry odometry = visual_odometry(memory);
  process_in_order(
      run.entries.size(), executor,
      [&](std::size_t i) {
        return OdometryView(encoder.signature(read_observation(run.entries[i])));
      },
      [&](std::size_t i, OdometryView&& view) {
        odometry.add(std::move(view));
        run.entries[i].odometry = odometry.pose();
      });
  return std::to_string(odometry.breaks()) + " of " + std::to_string(run.entries.size() - 1) +
         " steps unread; one unit of the views is " + format_number(odometry.scale_m()) +
         " m, as in the memory";
}

}  // namespace panonav
