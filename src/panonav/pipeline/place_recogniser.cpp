#include "panonav/pipeline/place_recogniser.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/pipeline/internal/asked_view.hpp"
#include "panonav/pipeline/learnt_models.hpp"

namespace panonav {

namespace {

VisualMemory views_of(const MemoryFile& file) {
  VisualMemory memory = file.load();
  if (memory.empty()) {
    throw FileError(file.path().string(), "holds no view; memorise a recording first");
  }
  return memory;
}

/// Those of the views that are in the file now, each read when it is first asked for, by a handle
/// of its own: the caller's is not needed afterwards.
FeatureSource kept_features(const MemoryFile& file, const VisualMemory& memory) {
  struct Kept {
    Kept(const MemoryFile& others, ViewId last_view)
        : file(others.reopen(Access::read_only)), last(last_view) {}
    MemoryFile file;
    ViewId last;
    FeatureSource read = features_in(file);
    std::map<ViewId, std::optional<LocalFeatures>> views;
    std::mutex mutex;
  };
  const auto kept = std::make_shared<Kept>(file, std::ranges::max(memory.views()));
  if (!kept->read) return {};
  return [kept](ViewId view) -> std::optional<LocalFeatures> {
    if (kept->last < view) return std::nullopt;
    const std::scoped_lock lock(kept->mutex);
    const auto found = kept->views.find(view);
    if (found != kept->views.end()) return found->second;
    std::optional<LocalFeatures> features;
    try {
      features = kept->read(view);
    } catch (const ContractError&) {  // forgotten since by somebody else
    }
    return kept->views.emplace(view, std::move(features)).first->second;
  };
}

bool features_tell_more(const VisualMemory& memory, const FeatureSource& features, int components) {
  const ColumnRanking ranking(memory, components);
  return try_features(ranking, NeighbourSupport(ranking), features).tell_more();
}

Localiser localiser_for(const MemoryFile& file, const VisualMemory& memory,
                        const LocaliserOptions& options) {
  const int most = memory.shape().components;
  if (options.components > most) {
    throw ContractError("components", options.components,
                        "1 to " + std::to_string(most) + ", the memory's");
  }
  // What is kept was learnt over all components.
  const auto models = options.components == 0 ? kept_models(file, memory) : std::nullopt;
  Localiser localiser =
      models ? Localiser(memory, models->place, models->position, options, models->spacing_m)
             : Localiser(memory, options);
  if (const FeatureSource features = kept_features(file, memory)) {
    const bool rank =
        models ? models->by_features : features_tell_more(memory, features, options.components);
    localiser.use_features(features, rank);
  }
  return localiser;
}

}  // namespace

struct PlaceRecogniser::Implementation {
  Implementation(const MemoryFile& file, const PlaceRecogniserOptions& options)
      : memory(views_of(file)),
        encoder(file.header(), options.source.value_or(file.header().source)),
        localiser(localiser_for(file, memory, options.localiser)),
        accuracy(options.areas) {
    if (accuracy) areas.emplace(memory);
  }

  VisualMemory memory;
  ViewEncoder encoder;
  Localiser localiser;
  std::optional<WantedAccuracy> accuracy;
  std::optional<ReferenceAreas> areas;
};

PlaceRecogniser::PlaceRecogniser(const std::filesystem::path& memory,
                                 const PlaceRecogniserOptions& options)
    : PlaceRecogniser(MemoryFile::open(memory, Access::read_only), options) {}
PlaceRecogniser::PlaceRecogniser(const MemoryFile& file, const PlaceRecogniserOptions& options)
    : implementation_(std::make_unique<Implementation>(file, options)) {}
PlaceRecogniser::~PlaceRecogniser() = default;
PlaceRecogniser::PlaceRecogniser(PlaceRecogniser&&) noexcept = default;
PlaceRecogniser& PlaceRecogniser::operator=(PlaceRecogniser&&) noexcept = default;

Place PlaceRecogniser::localise(const Observation& observation,
                                std::span<const std::string> excluded_names) const {
  const auto& [memory, encoder, localiser, accuracy, areas] = std::as_const(*implementation_);
  AskedView asked(encoder, observation);
  const PackedSignature query = asked.query(localiser.ranks_by_features());
  std::vector<ViewId> excluded;
  for (const std::string& name : excluded_names) {
    if (const auto view = memory.find(name)) excluded.push_back(*view);
  }
  const SearchMask mask{excluded, {}};
  Place place = place_of(localiser.localise(query, mask, asked.features()), memory);
  if (accuracy) place.areas = localise_hierarchically(memory, *areas, query, *accuracy, mask);
  return place;
}

Place place_of(const Localisation& found, const VisualMemory& memory) {
  Place place{.known_probability = found.known_probability,
              .known = found.known,
              .heading_rad = found.heading_rad,
              .components = found.components,
              .bytes_read = found.bytes_read};
  for (const LocalisedMatch& match : found.matches) {
    place.matches.push_back(
        {memory.info(match.view).name, match.view, match.dissimilarity, match.column_difference,
         match.verified_features,
         match.compass ? std::optional(match.compass->heading_rad) : std::nullopt});
  }
  if (found.position) {
    const auto& [position, radius_m, shares] = *found.position;
    place.position = PlacePosition{position.x_m, position.y_m, radius_m};
  }
  return place;
}

void PlaceRecogniser::append(const ReferenceInfo& info, const PackedSignature& signature) {
  implementation_->memory.append(signature, info);
}

const VisualMemory& PlaceRecogniser::memory() const noexcept {
  return implementation_->memory;
}
const ViewEncoder& PlaceRecogniser::encoder() const noexcept {
  return implementation_->encoder;
}
const Localiser& PlaceRecogniser::localiser() const noexcept {
  return implementation_->localiser;
}

}  // namespace panonav
