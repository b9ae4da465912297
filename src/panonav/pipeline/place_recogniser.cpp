#include "panonav/pipeline/place_recogniser.hpp"

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/pipeline/internal/feature_cache.hpp"
#include "panonav/pipeline/internal/learning_sample.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/internal/sector_recogniser.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav/storage/memory_scheme.hpp"

namespace panonav {

namespace {

/// Computes signature and features of one observation; unwraps the panorama at most once, on first
/// use. Encoder and observation must outlive *this.
class ObservationQuery {
 public:
  ObservationQuery(const ViewEncoder& encoder, const Observation& observation)
      : encoder_(encoder), observation_(observation) {}

  /// Returns the packed signature. `by_features`: features are needed too, so it uses their
  /// panorama.
  [[nodiscard]] PackedSignature signature(bool by_features) {
    return by_features ? encoder_.packed(panorama()) : encoder_.packed(observation_);
  }
  [[nodiscard]] QueryFeatures features() {
    return [this](Handedness handedness) {
      return encoder_.features(handedness == Handedness::original ? panorama()
                                                                  : mirror(panorama()));
    };
  }

 private:
  const Panorama& panorama() {
    if (!panorama_) panorama_ = encoder_.panorama(observation_);
    return *panorama_;
  }
  const ViewEncoder& encoder_;
  const Observation& observation_;
  std::optional<Panorama> panorama_;
};

/// Returns the layout of the pictures that the encoder takes: that of the memory if the queries are
/// narrow pictures, which it cannot encode.
PictureSource choose_encoded_source(const PlaceRecogniserOptions& options,
                                    const MemoryHeader& header) {
  const PictureSource source = options.source.value_or(header.source);
  return source.kind == PictureKind::pinhole ? header.source : source;
}

bool is_narrow_source(const PlaceRecogniserOptions& options) {
  return options.source && options.source->kind == PictureKind::pinhole;
}

void check_options(const PlaceRecogniserOptions& options, const MemoryHeader& header,
                   bool is_memory_held) {
  validate(options.localiser);
  const int max_components = header.shape.components;
  if (options.areas && !is_memory_held) {
    throw ContractError("areas", "asked for",
                        "none in a memory that is not held: they take the positions of all views");
  }
  if (is_narrow_source(options) && (options.areas || !is_memory_held)) {
    throw ContractError("narrow pictures", options.areas ? "with areas" : "in a memory not held",
                        "without areas, in a memory that is held");
  }
  if (options.localiser.components > max_components) {
    throw ContractError("components", options.localiser.components,
                        "1 to " + std::to_string(max_components) + ", the memory's");
  }
}

[[noreturn]] void throw_empty_memory(const MemoryFile& file) {
  throw FileError(file.path().string(), "contains no view; memorise a recording first");
}

}  // namespace

struct PlaceRecogniser::Implementation {
  /// Holds the memory.
  Implementation(const MemoryFile& file, const PlaceRecogniserOptions& options_)
      : options(options_),
        unit(read_length_unit(file)),
        memory(file.load()),
        encoder(file.header(), choose_encoded_source(options, file.header())) {
    check_options(options, file.header(), true);
    if (memory->empty()) throw_empty_memory(file);
    learn_from_held_views(file);
    if (is_narrow_source(options)) {
      narrow.emplace(file, *memory, *options.source, models->sector);
    } else if (has_narrow_features(file)) {
      narrow_file.emplace(file.reopen(Access::read_only));
    }
    if (options.areas) areas.emplace(*memory);
  }
  /// Searches the memory on its server.
  Implementation(std::unique_ptr<IndexedMemory> index_, const MemoryFile& file,
                 std::filesystem::path path_, const PlaceRecogniserOptions& options_)
      : options(options_),
        unit(read_length_unit(file)),
        path(std::move(path_)),
        indexed(std::move(index_)),
        encoder(file.header(), choose_encoded_source(options, file.header())) {
    check_options(options, file.header(), false);
    learn_from_index(file);
  }

  // True if stored models can be used: they were learnt with all components.
  [[nodiscard]] bool can_use_stored_models() const { return options.localiser.components == 0; }

  /// Returns a cached source of the memory's features; empty if the memory has none. Features of
  /// views after `last_view` are ignored.
  FeatureSource get_or_create_features(const MemoryFile& file, std::optional<ViewId> last_view) {
    if (!file.header().elevations || !file.has_features()) return {};
    if (!features) features = std::make_shared<FeatureCache>(file, last_view);
    return [cache = features](ViewId view) { return cache->features(view); };
  }

  void learn_from_held_views(const MemoryFile& file) {
    const FeatureSource source = get_or_create_features(file, std::ranges::max(memory->views()));
    if (can_use_stored_models()) models = load_stored_models(file, *memory);
    if (!models) models = learn_place_models(*memory, source, options.localiser.components);
    Localiser localiser(*memory, models->place, models->position, options.localiser,
                        models->spacing_m);
    set_localiser(std::move(localiser), source);
  }

  void learn_from_index(const MemoryFile& file) {
    const std::vector<ViewId> views = indexed->views();
    if (views.empty()) throw_empty_memory(file);
    const FeatureSource source = get_or_create_features(file, std::nullopt);
    const std::unique_ptr<ViewIndex> index = indexed->index();
    const std::vector<ViewId> sampled = sample_reference_views(views);
    models = find_models(file, *index, views, sampled, source);
    Localiser localiser(std::make_shared<const VisualMemory>(index->load(sampled)), models->place,
                        models->position, options.localiser, models->spacing_m);
    set_localiser(std::move(localiser), source);
  }

  /// Returns models of a memory that is not held. A small memory uses current stored models or
  /// learns from all views. A large one uses the models stored last, else those in use, else learns
  /// from a part of the views.
  [[nodiscard]] LearntModels find_models(const MemoryFile& file, ViewIndex& index,
                                         std::span<const ViewId> views,
                                         std::span<const ViewId> sampled,
                                         const FeatureSource& source) const {
    const bool is_small = views.size() <= options.max_learnt_views;
    std::optional<LearntModels> found;
    std::optional<VisualMemory> all;
    if (is_small) all.emplace(index.load(views));
    if (can_use_stored_models())
      found = is_small ? load_stored_models(file, *all) : load_stored_models(file);
    if (!found && !is_small) found = models;
    if (found) return *found;
    if (!is_small) all = load_learning_sample(index, views, sampled, options.max_learnt_views);
    return learn_place_models(*all, source, options.localiser.components);
  }

  void set_localiser(Localiser localiser, const FeatureSource& source) {
    if (source) localiser.use_features(source, models->by_features);
    auto next = std::make_shared<const Localiser>(std::move(localiser));
    const std::lock_guard lock(mutex);
    current.swap(next);
  }
  [[nodiscard]] std::shared_ptr<const Localiser> localiser() const {
    const std::lock_guard lock(mutex);
    return current;
  }

  /// Returns the localiser of narrow pictures, made for the first one if all are not narrow.
  const SectorRecogniser& get_or_create_narrow() {
    const std::lock_guard lock(narrow_mutex);
    if (!narrow) {
      require_held();
      if (!narrow_file) {
        throw ContractError("memory", "without features for narrow pictures",
                            "one that was memorised with them (option narrow)");
      }
      const PictureSource pinhole{.kind = PictureKind::pinhole};
      narrow.emplace(*narrow_file, *memory, pinhole, models->sector);
      narrow_file.reset();
    }
    return *narrow;
  }

  [[nodiscard]] std::unique_ptr<ViewIndex> index() const {
    if (indexed) return indexed->index();
    return std::make_unique<HeldViewIndex>(*memory);
  }

  void require_held() const {
    if (!memory) throw ContractError("memory", "not held", "one that is held");
  }

  PlaceRecogniserOptions options;
  LengthUnit unit;
  std::optional<VisualMemory> memory;  // empty: not held
  std::optional<ReferenceAreas> areas;
  std::filesystem::path path;              // where not held
  std::unique_ptr<IndexedMemory> indexed;  // null: held
  ViewEncoder encoder;
  std::mutex narrow_mutex;                 // guards the next two
  std::optional<SectorRecogniser> narrow;  // set if pictures are narrow, or from the first such one
  std::optional<MemoryFile> narrow_file;   // until `narrow` is made from it
  std::shared_ptr<FeatureCache> features;  // null: the memory has none
  std::optional<LearntModels> models;      // learnt or loaded last
  mutable std::mutex mutex;                // of `current`
  std::shared_ptr<const Localiser> current;
};

PlaceRecogniser::PlaceRecogniser(const std::filesystem::path& memory,
                                 const PlaceRecogniserOptions& options) {
  const MemoryFile file = MemoryFile::open(memory, Access::read_only);
  auto index = options.areas ? nullptr : open_index_if_large(memory, file, options.max_held_views);
  implementation_ = index
                        ? std::make_unique<Implementation>(std::move(index), file, memory, options)
                        : std::make_unique<Implementation>(file, options);
}
PlaceRecogniser::PlaceRecogniser(const MemoryFile& file, const PlaceRecogniserOptions& options)
    : implementation_(std::make_unique<Implementation>(file, options)) {}
PlaceRecogniser::PlaceRecogniser(std::unique_ptr<IndexedMemory> index,
                                 const std::filesystem::path& memory,
                                 const PlaceRecogniserOptions& options)
    : implementation_(std::make_unique<Implementation>(
          std::move(index), MemoryFile::open(memory, Access::read_only), memory, options)) {}
PlaceRecogniser::~PlaceRecogniser() = default;
PlaceRecogniser::PlaceRecogniser(PlaceRecogniser&&) noexcept = default;
PlaceRecogniser& PlaceRecogniser::operator=(PlaceRecogniser&&) noexcept = default;

LengthUnit PlaceRecogniser::length_unit() const noexcept {
  return implementation_->unit;
}

Place PlaceRecogniser::localise(const Observation& observation,
                                std::span<const std::string> excluded_names) const {
  Implementation& own = *implementation_;
  const std::unique_ptr<ViewIndex> index = own.index();
  std::vector<ViewId> excluded;
  for (const std::string& name : excluded_names) {
    if (const auto view = index->find(name)) excluded.push_back(*view);
  }
  if (is_narrow_source(own.options) || observation.narrow_source) {
    return own.get_or_create_narrow().localise(observation, own.options.localiser.top, excluded);
  }
  const std::shared_ptr<const Localiser> localiser = own.localiser();
  ObservationQuery query(own.encoder, observation);
  const PackedSignature signature = query.signature(localiser->should_rank_by_features());
  const SearchMask mask{excluded, {}};
  Place place = localiser->localise(*index, signature, mask, query.features());
  if (own.areas) {
    place.areas =
        localise_hierarchically(*own.memory, *own.areas, signature, *own.options.areas, mask);
  }
  return place;
}

bool PlaceRecogniser::is_memory_held() const noexcept {
  return implementation_->memory.has_value();
}
std::size_t PlaceRecogniser::size() const {
  const Implementation& own = *implementation_;
  return own.memory ? own.memory->size() : own.indexed->size();
}
const ViewEncoder& PlaceRecogniser::encoder() const noexcept {
  return implementation_->encoder;
}

void PlaceRecogniser::append(const ReferenceInfo& info, const PackedSignature& signature) {
  implementation_->require_held();
  implementation_->memory->append(signature, info);
}
const VisualMemory& PlaceRecogniser::memory() const {
  implementation_->require_held();
  return *implementation_->memory;
}
const Localiser& PlaceRecogniser::localiser() const {
  implementation_->require_held();
  return *implementation_->current;
}

bool PlaceRecogniser::refresh() {
  Implementation& own = *implementation_;
  if (!own.indexed || !own.indexed->refresh()) return false;
  own.learn_from_index(MemoryFile::open(own.path, Access::read_only));
  return true;
}
std::uint64_t PlaceRecogniser::index_bytes() const {
  const Implementation& own = *implementation_;
  return own.indexed ? own.indexed->bytes() : 0;
}
SearchCounters PlaceRecogniser::search_counters() const {
  const Implementation& own = *implementation_;
  return own.indexed ? own.indexed->counters() : SearchCounters{};
}

}  // namespace panonav
