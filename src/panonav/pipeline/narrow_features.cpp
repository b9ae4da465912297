#include "panonav/pipeline/narrow_features.hpp"

#include <optional>
#include <string>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/signature/gradient_features.hpp"

namespace panonav {

namespace {

/// Parameter of memories whose views have gradient features, and its value.
constexpr std::string_view narrow_parameter = "narrow_features";
constexpr std::string_view gradient_version = "gradient 1";

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
      return unpack_gradient_features(parts.gradient, {header.shape.rows, header.panorama_columns},
                                      *header.elevations);
    } catch (const ContractError& error) {
      throw FileError(file.path().string(), "is damaged: " + std::string(error.what()));
    }
  };
}

std::vector<std::uint8_t> pack_features(const ViewEncoder& encoder, const Panorama& panorama,
                                        bool narrow) {
  const auto local = pack(encoder.features(panorama).value());
  if (!narrow) return local;
  const MemoryHeader& header = encoder.header();
  const auto gradient = extract_gradient_features(panorama, header.preprocessing).value();
  return join_feature_bytes(
      {local, pack(gradient, {panorama.rows(), panorama.columns()}, *header.elevations)});
}

}  // namespace panonav
