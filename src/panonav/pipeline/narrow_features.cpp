#include "panonav/pipeline/narrow_features.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "panonav/core/error.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/signature/gradient_features.hpp"
#include "panonav/signature/local_features.hpp"

namespace panonav {

namespace {

/// Parameter of memories whose views have gradient features, and its value.
constexpr std::string_view narrow_parameter = "narrow_features";
constexpr std::string_view gradient_version = "gradient 2";

}  // namespace

bool has_narrow_features(const MemoryFile& file) {
  return file.header().elevations && file.parameter(narrow_parameter) == gradient_version;
}

void set_narrow_features(MemoryFile& file) {
  file.set_parameter(narrow_parameter, gradient_version);
}

void require_narrow_features(const MemoryFile& file) {
  if (has_narrow_features(file)) return;
  throw FileError(
      file.path().string(),
      "stores no features for narrow pictures; memorise its views again with the option "
      "narrow");
}

GradientSource make_gradient_source(const MemoryFile& file) {
  require_narrow_features(file);
  return [&file](ViewId view) -> std::optional<GradientFeatures> {
    const auto bytes = file.features(view);
    if (!bytes) return std::nullopt;
    const MemoryHeader& header = file.header();
    const auto parts = split_feature_bytes(*bytes);
    if (parts.gradient.empty()) return std::nullopt;
    try {
      return unpack_gradient_features(
          parts.gradient, find_gradient_shape({header.shape.rows, header.panorama_columns}),
          *header.elevations);
    } catch (const ContractError& error) {
      throw FileError(file.path().string(), "is damaged: " + std::string(error.what()));
    }
  };
}

MemoryHeader refine_header(const MemoryHeader& header) {
  MemoryHeader fine = header;
  const PanoramaShape shape = find_gradient_shape({header.shape.rows, header.panorama_columns});
  const int times = shape.rows / header.shape.rows;
  if (times > 1 && !fine.picture_shape && fine.source.kind == PictureKind::panorama) {
    fine.picture_shape = PanoramaShape{header.shape.rows, header.panorama_columns};
  }
  fine.shape.rows = shape.rows;
  fine.panorama_columns = shape.columns;
  fine.preprocessing.masked_rows_top *= times;
  fine.preprocessing.masked_rows_bottom *= times;
  return fine;
}

FeatureEncoder::FeatureEncoder(const MemoryHeader& header, const PictureSource& source, bool narrow)
    : header_(header) {
  if (narrow) fine_.emplace(refine_header(header), source);
}

std::vector<std::uint8_t> FeatureEncoder::packed(const Observation& observation,
                                                 const Panorama& panorama) const {
  const auto local = pack(extract_features(panorama, header_.preprocessing).value());
  if (!fine_) return local;
  const MemoryHeader& header = fine_->header();
  const PanoramaShape shape{header.shape.rows, header.panorama_columns};
  const auto enlarge = [&] {
    const Image picture = to_picture(panorama);
    return panorama_from_picture(picture.view(),
                                 {.forward_column = picture_forward_column(panorama.columns()),
                                  .elevations = panorama.elevations()},
                                 shape);
  };
  const Panorama fine = std::holds_alternative<Panorama>(observation.picture)
                            ? enlarge()
                            : fine_->panorama(observation);
  const auto gradient = extract_gradient_features(fine, header.preprocessing).value();
  return join_feature_bytes({local, pack(gradient, shape, *header.elevations)});
}

}  // namespace panonav
