#include "panonav/pipeline/learnt_models.hpp"

#include <cmath>
#include <concepts>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/localisation/neighbour_support.hpp"
#include "panonav/memory/floors.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"
#include "panonav/storage/checksum.hpp"

namespace panonav {

namespace {

constexpr const char* parameter_name = "learnt models";
/// Version of the learning method; raised when its results change, so that older models are
/// ignored.
constexpr std::string_view learning_version = "6";

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

/// Returns a hash of the views, their signatures and their poses.
std::string compute_fingerprint(const VisualMemory& memory) {
  RecordBytes scratch;
  std::uint64_t hash = checksum({}, memory.shape().size());
  for (const ViewId view : memory.views()) {
    scratch.clear();
    scratch.add(std::int64_t{view.value});
    if (const auto& pose = memory.info(view).pose) {
      if (const auto floor = floor_of(memory.info(view).name); !floor.empty()) scratch.add(floor);
      scratch.add(pose->x_m);
      scratch.add(pose->y_m);
      if (pose->heading_rad) scratch.add(*pose->heading_rad);
    }
    const PackedSignature signature = memory.packed(view);
    hash = checksum(scratch.bytes(), hash);
    hash = checksum(signature.magnitudes, hash);
    hash = checksum(signature.phases, hash);
  }
  return to_hex_digits(hash);
}

/// Reads stored models; nullopt if there are none, or if they were not learnt from the views of
/// `memory` (null: not checked).
std::optional<LearntModels> read_models(const MemoryFile& file, const VisualMemory* memory) {
  const auto text = file.parameter(parameter_name);
  if (!text) return std::nullopt;
  const Reader reader(*text);
  if (reader.word() != learning_version) return std::nullopt;
  const std::string views = reader.word();
  if (memory != nullptr && views != compute_fingerprint(*memory)) return std::nullopt;
  LearntModels models;
  visit_members(models.place, reader);
  visit_members(models.position, reader);
  reader(models.spacing_m);
  reader(models.by_features);
  bool has_observation = false;
  reader(has_observation);
  if (has_observation) visit_members(models.observation.emplace(), reader);
  if (!reader.ok()) return std::nullopt;
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
      return unpack_features(*bytes, shape, band);
    } catch (const ContractError& error) {
      throw FileError(file.path().string(), "is damaged: " + std::string(error.what()));
    }
  };
}

LearntModels learn_place_models(const VisualMemory& memory, const FeatureSource& features,
                                int components) {
  const ColumnRanking ranking(memory, components);
  const NeighbourSupport support(ranking);
  return {learn_place_model(ranking), learn_position_model(ranking), support.spacing_m(),
          std::nullopt,
          features && evaluate_features(ranking, support, features).is_significantly_better()};
}

LearntModels learn_models(const VisualMemory& memory, const FeatureSource& features) {
  LearntModels models = learn_place_models(memory, features, 0);
  try {
    models.observation = learn_observation_model(ColumnRanking(memory));
  } catch (const ContractError&) {  // nothing to learn from
  }
  return models;
}

void learn_and_store_models(MemoryFile& file) {
  const VisualMemory memory = file.load();
  if (memory.empty() || load_stored_models(file, memory)) return;
  const LearntModels models = learn_models(memory, make_feature_source(file));
  Writer writer;
  writer.word(learning_version);
  writer.word(compute_fingerprint(memory));
  visit_members(models.place, writer);
  visit_members(models.position, writer);
  writer(models.spacing_m);
  writer(models.by_features);
  writer(models.observation.has_value());
  if (models.observation) visit_members(*models.observation, writer);
  file.set_parameter(parameter_name, writer.text());
}

std::optional<LearntModels> load_stored_models(const MemoryFile& file, const VisualMemory& memory) {
  return read_models(file, &memory);
}

std::optional<LearntModels> load_stored_models(const MemoryFile& file) {
  return read_models(file, nullptr);
}

}  // namespace panonav
