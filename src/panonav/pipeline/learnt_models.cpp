#include "panonav/pipeline/learnt_models.hpp"

#include <array>
#include <cmath>
#include <concepts>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/internal/learning_sample.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/signature/gradient_features.hpp"
#include "panonav/storage/checksum.hpp"

namespace panonav {

namespace {

constexpr const char* parameter_name = "learnt models";
/// Version of the learning method; raised when its results change, so that older models are
/// ignored.
constexpr std::string_view learning_version = "8";

// Visits the members of each model in the order in which they are stored.
template <class Model, class Visit>
requires std::same_as<std::remove_const_t<Model>, PlaceModel>
void visit_members(Model& m, const Visit& visit) {
  visit(m.threshold), visit(m.learnt), visit(m.sampled_views), visit(m.neighbouring_difference);
  visit(m.arbitrary_difference), visit(m.mirrored_difference), visit(m.nearest_view_difference);
}
template <class Model, class Visit>
requires std::same_as<std::remove_const_t<Model>, PositionModel>
void visit_members(Model& m, const Visit& visit) {
  visit(m.learnt), visit(m.components), visit(m.sampled_views), visit(m.neighbourhood_m);
  visit(m.exponent), visit(m.difference_unit), visit(m.spacing_m), visit(m.ambiguous_from);
  visit(m.ambiguous_radius_m), visit(m.median_error_m), visit(m.error95_m);
  visit(m.area_error_ratio), visit(m.line_error_m);
  for (auto& change : m.changes) {
    visit(change.distance_m), visit(change.squared_difference);
    visit(change.small_squared_difference);
  }
}
template <class Model, class Visit>
requires std::same_as<std::remove_const_t<Model>, ObservationModel>
void visit_members(Model& m, const Visit& visit) {
  visit(m.spacing_m), visit(m.far_difference), visit(m.range_m), visit(m.sharpness);
  visit(m.heading_width_rad), visit(m.explained_difference), visit(m.neighbouring_difference);
  visit(m.sampled_views);
}

template <class Model, class Visit>
requires std::same_as<std::remove_const_t<Model>, SectorModel>
void visit_members(Model& m, const Visit& visit) {
  visit(m.learnt), visit(m.share_exponent);
  for (auto& radius_m : m.radius_m) visit(radius_m);
}

/// Writes words separated by blanks, doubles with all their bits.
class Writer {
 public:
  void operator()(double value) const { text_ += to_hex_text(value) + " "; }
  void operator()(int value) const { text_ += std::to_string(value) + " "; }
  void operator()(bool value) const { text_ += value ? "yes " : "no "; }
  void operator()(const std::optional<double>& value) const {
    if (value) {
      (*this)(*value);
    } else {
      text_ += "- ";
    }
  }
  [[nodiscard]] const std::string& text() const { return text_; }
  void word(std::string_view word) { text_ += std::string(word) + " "; }

 private:
  mutable std::string text_;
};

/// Reads models word by word; `ok` is false from the first wrong word on.
class Reader {
 public:
  explicit Reader(const std::string& text) : words_(split_words(text)) {}

  [[nodiscard]] std::string word() const {
    if (next_ < words_.size()) return words_[next_++];
    ok_ = false;
    return {};
  }
  void operator()(double& value) const { value = number(word()); }
  void operator()(int& value) const { ok_ = read_number(word(), value) && ok_; }
  void operator()(bool& value) const {
    const std::string read = word();
    value = read == "yes";
    ok_ = ok_ && (value || read == "no");
  }
  void operator()(std::optional<double>& value) const {
    const std::string read = word();
    value = read == "-" ? std::nullopt : std::optional(number(read));
  }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  [[nodiscard]] double number(const std::string& word) const {
    double value = 0.0;
    if (!read_hex_number(word, value) || !std::isfinite(value)) ok_ = false;
    return value;
  }
  std::vector<std::string> words_;
  mutable std::size_t next_ = 0;
  mutable bool ok_ = true;
};

/// Fingerprint of the views from which models are learnt: their ids, floors and poses. Signatures
/// are left out, as that of an id never changes.
class Fingerprint {
 public:
  explicit Fingerprint(SignatureShape shape) : hash_(checksum({}, shape.size())) {}
  void add(ViewId view, std::string_view floor, const std::optional<ReferencePose>& pose) {
    record_.clear();
    record_.add(std::int64_t{view.value});
    if (pose) {
      if (!floor.empty()) record_.add(floor);
      record_.add(pose->x_m);
      record_.add(pose->y_m);
      if (pose->heading_rad) record_.add(*pose->heading_rad);
    }
    hash_ = checksum(record_.bytes(), hash_);
  }
  [[nodiscard]] std::string text() const { return to_hex_digits(hash_); }

 private:
  RecordBytes record_;
  std::uint64_t hash_;
};

std::string compute_fingerprint(const VisualMemory& memory) {
  Fingerprint fingerprint(memory.shape());
  for (const ViewId view : memory.views().first(count_learnt_views(memory.size()))) {
    const ReferenceInfo& info = memory.info(view);
    fingerprint.add(view, floor_of(info.name), info.pose);
  }
  return fingerprint.text();
}

std::string compute_fingerprint(SignatureShape shape,
                                std::span<const MemoryFile::ViewPlace> places) {
  Fingerprint fingerprint(shape);
  for (const auto& place : places.first(count_learnt_views(places.size()))) {
    fingerprint.add(place.view, place.floor, place.pose);
  }
  return fingerprint.text();
}

/// Reads stored models; nullopt if there are none, or if they were learnt from views of another
/// fingerprint (nullopt: not checked).
std::optional<LearntModels> read_models(const MemoryFile& file,
                                        const std::optional<std::string>& fingerprint) {
  const auto text = file.parameter(parameter_name);
  if (!text) return std::nullopt;
  const Reader reader(*text);
  if (reader.word() != learning_version) return std::nullopt;
  const std::string views = reader.word();
  if (fingerprint && views != *fingerprint) return std::nullopt;
  LearntModels models;
  visit_members(models.place, reader);
  visit_members(models.position, reader);
  reader(models.spacing_m);
  reader(models.by_features);
  bool has_observation = false;
  reader(has_observation);
  if (has_observation) visit_members(models.observation.emplace(), reader);
  bool has_sector = false;
  reader(has_sector);
  if (has_sector) visit_members(models.sector.emplace(), reader);
  if (!reader.ok()) return std::nullopt;
  return models;
}

/// Learns all models but the observation model from the views of the ranking.
LearntModels learn_from(const ColumnRanking& ranking, const FeatureSource& features) {
  const NeighbourSupport support(ranking);
  return {.place = learn_place_model(ranking),
          .position = learn_position_model(ranking),
          .spacing_m = support.spacing_m(),
          .by_features =
              features && evaluate_features(ranking, support, features).is_significantly_better()};
}

/// Returns a source that keeps the features of up to 250 views, about 4 MB, so that few are read
/// twice; empty if `source` is.
FeatureSource keep_read_features(const FeatureSource& source) {
  if (!source) return {};
  using Kept = std::map<ViewId, std::optional<LocalFeatures>>;
  return [source, kept = std::make_shared<Kept>()](ViewId view) {
    constexpr std::size_t max_kept = 250;
    const auto found = kept->find(view);
    if (found != kept->end()) return found->second;
    if (kept->size() == max_kept) kept->clear();
    return kept->emplace(view, source(view)).first->second;
  };
}

LearntModels learn_all_from(const VisualMemory& memory, const FeatureSource& features,
                            const GradientSource& narrow_features, Executor& executor) {
  constexpr std::size_t max_cached_profiles = 4000;  // 11 MB
  const ColumnRanking ranking(memory, 0, max_cached_profiles);
  LearntModels models;
  const auto learn_places = [&] {
    models.place = learn_place_model(ranking);
    try {
      models.observation = learn_observation_model_with_places(ranking, models.place);
    } catch (const ContractError&) {  // nothing to learn from
    }
  };
  const auto learn_positions = [&] { models.position = learn_position_model(ranking); };
  // The only one that reads the file, which one thread at a time may do.
  const auto learn_support = [&] {
    const NeighbourSupport support(ranking);
    models.spacing_m = support.spacing_m();
    models.by_features =
        features &&
        evaluate_features(ranking, support, keep_read_features(features)).is_significantly_better();
    if (!narrow_features) return;
    try {
      models.sector = SectorLocaliser(memory, narrow_features).model();
    } catch (const ContractError&) {  // no view has corners
    }
  };
  const std::array<std::function<void()>, 3> parts{learn_places, learn_positions, learn_support};
  executor.for_each_chunk(parts.size(), 1,
                          [&](std::size_t part, std::size_t, std::size_t) { parts[part](); });
  return models;
}

}  // namespace

FeatureSource make_feature_source(const MemoryFile& file) {
  const MemoryHeader& header = file.header();
  if (!header.elevations || !file.has_features()) return {};
  return [&file, shape = PanoramaShape{header.shape.rows, header.panorama_columns},
          band = *header.elevations](ViewId view) -> std::optional<LocalFeatures> {
    const auto bytes = file.features(view);
    if (!bytes) return std::nullopt;
    try {
      return unpack_features(split_feature_bytes(*bytes).local, shape, band);
    } catch (const ContractError& error) {
      throw FileError(file.path().string(), "is damaged: " + std::string(error.what()));
    }
  };
}

LearntModels learn_place_models(const VisualMemory& memory, const FeatureSource& features,
                                int components) {
  const LearntViews learnt(memory);
  return learn_from(ColumnRanking(learnt.memory(), components), features);
}

ObservationModel learn_tracking_model(const VisualMemory& memory, const LearningOptions& options) {
  const LearntViews learnt(memory);
  return learn_observation_model(ColumnRanking(learnt.memory()), options);
}

LearntModels learn_models(const VisualMemory& memory, const FeatureSource& features,
                          const GradientSource& narrow_features) {
  const LearntViews learnt(memory);
  Executor alone;
  return learn_all_from(learnt.memory(), features, narrow_features, alone);
}

void learn_and_store_models(MemoryFile& file) {
  Executor alone;
  learn_and_store_models(file, alone);
}

void learn_and_store_models(MemoryFile& file, Executor& executor) {
  const std::vector<MemoryFile::ViewPlace> places = file.places();
  if (places.empty()) return;
  const std::string fingerprint = compute_fingerprint(file.header().shape, places);
  if (read_models(file, fingerprint)) return;
  const GradientSource narrow_features =
      has_narrow_features(file) ? make_gradient_source(file) : GradientSource{};
  const LearntModels models = learn_all_from(load_learnt_views(file, places),
                                             make_feature_source(file), narrow_features, executor);
  Writer writer;
  writer.word(learning_version);
  writer.word(fingerprint);
  visit_members(models.place, writer);
  visit_members(models.position, writer);
  writer(models.spacing_m);
  writer(models.by_features);
  writer(models.observation.has_value());
  if (models.observation) visit_members(*models.observation, writer);
  writer(models.sector.has_value());
  if (models.sector) visit_members(*models.sector, writer);
  file.set_parameter(parameter_name, writer.text());
}

std::optional<LearntModels> load_stored_models(const MemoryFile& file, const VisualMemory& memory) {
  return read_models(file, compute_fingerprint(memory));
}

std::optional<LearntModels> load_stored_models(const MemoryFile& file) {
  return read_models(file, std::nullopt);
}

}  // namespace panonav
