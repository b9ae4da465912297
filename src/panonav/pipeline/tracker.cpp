#include "panonav/pipeline/tracker.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"

namespace panonav {

namespace {

MonteCarloLocaliser make_localiser(const MemoryFile& file, const VisualMemory& memory,
                                   const TrackerOptions& options) {
  const auto posed = std::ranges::count_if(
      memory.views(), [&](ViewId view) { return memory.info(view).pose.has_value(); });
  if (posed < ObservationModel::min_views) {
    throw FileError(file.path().string(),
                    "holds " + std::to_string(posed) + " views with a position; allowed: " +
                        std::to_string(ObservationModel::min_views) +
                        " or more; memorise a data set whose table has the columns "
                        "'x_m' and 'y_m'");
  }
  validate(options.filter);
  try {
    // Stored models were learnt with the default seed, and the filter's seed is that of learning
    // too.
    if (options.filter.seed == LearningOptions{}.seed) {
      if (const auto models = load_stored_models(file, memory); models && models->observation) {
        return {std::make_shared<const ColumnRanking>(memory), *models->observation, options.filter,
                options.odometry};
      }
    }
    return MonteCarloLocaliser(memory, options.filter, options.odometry);
  } catch (const ContractError& error) {  // the views are all in one place
    throw FileError(file.path().string(), error.what());
  }
}

}  // namespace

struct Tracker::Implementation {
  Implementation(const MemoryFile& file, const TrackerOptions& options)
      : memory(file.load()),
        encoder(file.header(), options.source.value_or(file.header().source)),
        localiser(make_localiser(file, memory, options)) {}

  VisualMemory memory;
  ViewEncoder encoder;
  MonteCarloLocaliser localiser;
  std::optional<Pose2> odometry;  ///< the last one
};

Tracker::Tracker(const std::filesystem::path& memory, const TrackerOptions& options)
    : Tracker(MemoryFile::open(memory, Access::read_only), options) {}
Tracker::Tracker(const MemoryFile& file, const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(file, options)) {}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::start_globally(std::optional<double> heading_rad) {
  implementation_->localiser.start_globally(heading_rad);
}
void Tracker::start_at(const Pose2& pose, double deviation_m, double heading_deviation_rad) {
  implementation_->localiser.start_at(pose, deviation_m, heading_deviation_rad);
}

MonteCarloEstimate Tracker::observe(const Observation& observation) {
  if (observation.odometry) move_to(*observation.odometry);
  return observe(implementation_->encoder.packed(observation));
}

MonteCarloEstimate Tracker::observe(const PackedSignature& view) {
  return implementation_->localiser.observe(view);
}

void Tracker::move_to(const Pose2& odometry) {
  require(is_position(odometry.x_m), "x_m of the odometry", odometry.x_m, position_range);
  require(is_position(odometry.y_m), "y_m of the odometry", odometry.y_m, position_range);
  auto& last = implementation_->odometry;
  if (last) implementation_->localiser.move(inverse(*last) * odometry);
  last = odometry;
}

const VisualMemory& Tracker::memory() const noexcept {
  return implementation_->memory;
}
const ViewEncoder& Tracker::encoder() const noexcept {
  return implementation_->encoder;
}
const MonteCarloLocaliser& Tracker::localiser() const noexcept {
  return implementation_->localiser;
}

}  // namespace panonav
