#include "panonav/pipeline/tracker.hpp"

#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/localisation/place_model.hpp"
#include "panonav/localisation/sample.hpp"
#include "panonav/pipeline/internal/learning_sample.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

namespace {

void require_positions(const MemoryFile& file, const VisualMemory& memory) {
  const std::size_t posed = HeldViewIndex(memory).posed_views().size();
  if (posed >= static_cast<std::size_t>(ObservationModel::min_views)) return;
  throw FileError(file.path().string(),
                  "holds " + std::to_string(posed) + " views with a position; allowed: " +
                      std::to_string(ObservationModel::min_views) +
                      " or more; memorise a data set whose table has the columns "
                      "'x_m' and 'y_m'");
}

// True if the filter's seed, which is also the seed of learning, is the default one with which
// stored models were learnt.
bool can_use_stored_models(const TrackerOptions& options) {
  return options.filter.seed == LearningOptions{}.seed;
}

MonteCarloLocaliser make_localiser(const MemoryFile& file, const VisualMemory& memory,
                                   const TrackerOptions& options) {
  require_positions(file, memory);
  validate(options.filter);
  try {
    if (can_use_stored_models(options)) {
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

/// Returns the model of a memory that is not held. A small memory uses the current stored model or
/// learns from all views. A large one uses the model stored last, else learns from a part of the
/// views.
ObservationModel load_or_learn_model(const MemoryFile& file, const IndexedMemory& memory,
                                     const TrackerOptions& options) {
  const std::vector<ViewId> views = memory.views();
  const std::unique_ptr<ViewIndex> index = memory.index();
  const bool is_small = views.size() <= options.max_learnt_views;
  std::optional<VisualMemory> sample;
  if (is_small) sample.emplace(index->load(views));
  if (can_use_stored_models(options)) {
    const auto models = is_small ? load_stored_models(file, *sample) : load_stored_models(file);
    if (models && models->observation) return *models->observation;
  }
  if (!sample) {
    sample.emplace(load_learning_sample(*index, views, sample_reference_views(views),
                                        options.max_learnt_views));
  }
  return learn_observation_model(ColumnRanking(*sample), {.seed = options.filter.seed});
}

MonteCarloLocaliser make_localiser(const MemoryFile& file, const IndexedMemory& memory,
                                   const TrackerOptions& options) {
  validate(options.filter);
  try {
    return {[&memory] { return memory.index(); }, file.header().shape,
            load_or_learn_model(file, memory, options), options.filter, options.odometry};
  } catch (const ContractError& error) {  // too few views with positions, or all in one place
    throw FileError(file.path().string(), error.what());
  }
}

}  // namespace

struct Tracker::Implementation {
  Implementation(const MemoryFile& file, const TrackerOptions& options)
      : memory(file.load()),
        encoder(file.header(), options.source.value_or(file.header().source)),
        localiser(make_localiser(file, *memory, options)) {}
  Implementation(std::unique_ptr<IndexedMemory> index, const MemoryFile& file,
                 const TrackerOptions& options)
      : indexed(std::move(index)),
        encoder(file.header(), options.source.value_or(file.header().source)),
        localiser(make_localiser(file, *indexed, options)) {}
  /// Holds the memory if it is a file or small enough.
  static std::unique_ptr<Implementation> make(const std::filesystem::path& memory,
                                              const TrackerOptions& options) {
    const MemoryFile file = MemoryFile::open(memory, Access::read_only);
    auto index = open_index_if_large(memory, file, options.max_held_views);
    return index ? std::make_unique<Implementation>(std::move(index), file, options)
                 : std::make_unique<Implementation>(file, options);
  }

  std::optional<VisualMemory> memory;      // nullopt: not held
  std::unique_ptr<IndexedMemory> indexed;  // null: held
  ViewEncoder encoder;
  MonteCarloLocaliser localiser;
  std::optional<Pose2> odometry;  ///< of the last call of `move_to`
};

Tracker::Tracker(const std::filesystem::path& memory, const TrackerOptions& options)
    : implementation_(Implementation::make(memory, options)) {}
Tracker::Tracker(const MemoryFile& file, const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(file, options)) {}
Tracker::Tracker(std::unique_ptr<IndexedMemory> index, const std::filesystem::path& memory,
                 const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(
          std::move(index), MemoryFile::open(memory, Access::read_only), options)) {}
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

bool Tracker::refresh() {
  Implementation& own = *implementation_;
  if (!own.indexed || !own.indexed->refresh()) return false;
  own.localiser.update_views();
  return true;
}

bool Tracker::is_memory_held() const noexcept {
  return implementation_->memory.has_value();
}
const VisualMemory& Tracker::memory() const {
  if (!is_memory_held()) throw ContractError("memory", "not held", "one that is held");
  return *implementation_->memory;
}
std::unique_ptr<ViewIndex> Tracker::index() const {
  const Implementation& own = *implementation_;
  if (own.indexed) return own.indexed->index();
  return std::make_unique<HeldViewIndex>(*own.memory);
}
const ViewEncoder& Tracker::encoder() const noexcept {
  return implementation_->encoder;
}
const MonteCarloLocaliser& Tracker::localiser() const noexcept {
  return implementation_->localiser;
}

}  // namespace panonav
