#include "panonav/pipeline/place_recogniser.hpp"

#include <utility>

#include "panonav/core/error.hpp"
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

Localiser localiser_for(const MemoryFile& file, const VisualMemory& memory,
                        const LocaliserOptions& options) {
  const int most = memory.shape().components;
  if (options.components > most) {
    throw ContractError("components", options.components,
                        "1 to " + std::to_string(most) + ", the memory's");
  }
  // What is kept was learnt over all components.
  if (options.components == 0) {
    if (const auto models = kept_models(file, memory)) {
      return {memory, models->place, models->position, options, models->spacing_m};
    }
  }
  return Localiser(memory, options);
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
    : implementation_(std::make_unique<const Implementation>(file, options)) {}
PlaceRecogniser::~PlaceRecogniser() = default;
PlaceRecogniser::PlaceRecogniser(PlaceRecogniser&&) noexcept = default;
PlaceRecogniser& PlaceRecogniser::operator=(PlaceRecogniser&&) noexcept = default;

Place PlaceRecogniser::localise(const Observation& observation,
                                std::span<const std::string> excluded_names) const {
  const auto& [memory, encoder, localiser, accuracy, areas] = *implementation_;
  const PackedSignature query = encoder.packed(observation);
  std::vector<ViewId> excluded;
  for (const std::string& name : excluded_names) {
    if (const auto view = memory.find(name)) excluded.push_back(*view);
  }
  const SearchMask mask{excluded, {}};
  const Localisation found = localiser.localise(query, mask);
  Place place{.known = found.known,
              .heading_rad = found.heading_rad,
              .components = found.components,
              .bytes_read = found.bytes_read};
  for (const LocalisedMatch& match : found.matches) {
    place.matches.push_back(
        {memory.info(match.view).name, match.view, match.dissimilarity, match.column_difference,
         match.compass ? std::optional(match.compass->heading_rad) : std::nullopt});
  }
  if (found.position) {
    const auto& [position, radius_m, shares] = *found.position;
    place.position = PlacePosition{position.x_m, position.y_m, radius_m};
  }
  if (accuracy) place.areas = localise_hierarchically(memory, *areas, query, *accuracy, mask);
  return place;
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
