// Bytes of gradient features in a memory.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/signature/gradient_features.hpp"

namespace panonav {

namespace {

/// Marks the end of an entry with gradient features: after it comes their number of bytes.
constexpr std::array<std::uint8_t, 4> gradient_mark{'G', 'R', 'A', '2'};
/// Bit of a packed row that marks leading features.
constexpr unsigned leading_bit = 0x8000U;
constexpr std::size_t trailer_bytes = gradient_mark.size() + 4;

}  // namespace

std::vector<std::uint8_t> pack(const GradientFeatures& features, PanoramaShape shape,
                               const ElevationBand& elevations) {
  const double column_rad = 2.0 * std::numbers::pi / shape.columns;
  const double row_rad = (elevations.top_rad - elevations.bottom_rad) / shape.rows;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(features.corners.size() * GradientFeatures::packed_bytes);
  for (std::size_t i = 0; i < features.corners.size(); ++i) {
    const auto& corner = features.corners[i];
    const auto column = static_cast<unsigned>(std::lround(corner.azimuth_rad / column_rad));
    const auto row = static_cast<unsigned>(
                         std::lround((elevations.top_rad - corner.elevation_rad) / row_rad - 0.5)) |
                     (i < features.leading ? leading_bit : 0U);
    for (const unsigned value : {column, row}) {
      bytes.push_back(static_cast<std::uint8_t>(value & 255U));
      bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
    }
    const auto& histogram = features.histograms[i];
    for (std::size_t k = 0; k < histogram.size(); k += 2) {
      bytes.push_back(static_cast<std::uint8_t>(histogram[k] | histogram[k + 1] << 4U));
    }
  }
  return bytes;
}

GradientFeatures unpack_gradient_features(std::span<const std::uint8_t> bytes, PanoramaShape shape,
                                          const ElevationBand& elevations) {
  constexpr std::size_t size = GradientFeatures::packed_bytes;
  require(bytes.size() % size == 0 && bytes.size() <= size * GradientFeatures::max_count,
          "bytes of gradient features", static_cast<double>(bytes.size()),
          "68 for each, up to 800 of them");
  const double column_rad = 2.0 * std::numbers::pi / shape.columns;
  const double row_rad = (elevations.top_rad - elevations.bottom_rad) / shape.rows;
  GradientFeatures features;
  for (; !bytes.empty(); bytes = bytes.subspan(size)) {
    const int column = bytes[0] | bytes[1] << 8;
    const unsigned row_bytes = bytes[2] | static_cast<unsigned>(bytes[3]) << 8U;
    const int row = static_cast<int>(row_bytes & ~leading_bit);
    if ((row_bytes & leading_bit) != 0) {
      require(features.leading == features.corners.size(), "place of a leading gradient feature",
              static_cast<double>(features.corners.size()), "before all others");
      ++features.leading;
    }
    require(column < shape.columns, "column of a gradient feature", column,
            "one of the panorama's");
    require(row < shape.rows, "row of a gradient feature", row, "one of the panorama's");
    features.corners.push_back({static_cast<float>(column * column_rad),
                                static_cast<float>(elevations.top_rad - (row + 0.5) * row_rad)});
    auto& histogram = features.histograms.emplace_back();
    for (std::size_t k = 0; k < histogram.size(); k += 2) {
      const std::uint8_t both = bytes[4 + k / 2];
      histogram[k] = both & 15U;
      histogram[k + 1] = both >> 4U;
    }
  }
  return features;
}

std::vector<std::uint8_t> join_feature_bytes(const FeatureBytes& parts) {
  std::vector<std::uint8_t> bytes(parts.local.begin(), parts.local.end());
  if (parts.gradient.empty()) return bytes;
  bytes.insert(bytes.end(), parts.gradient.begin(), parts.gradient.end());
  for (unsigned shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>(parts.gradient.size() >> shift));
  }
  bytes.insert(bytes.end(), gradient_mark.begin(), gradient_mark.end());
  return bytes;
}

FeatureBytes split_feature_bytes(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < trailer_bytes ||
      !std::ranges::equal(bytes.last(gradient_mark.size()), gradient_mark)) {
    return {bytes, {}};
  }
  const std::size_t before = bytes.size() - trailer_bytes;
  std::size_t size = 0;
  for (std::size_t i = 0; i < 4; ++i) size |= std::size_t{bytes[before + i]} << (8 * i);
  if (size > before || size % GradientFeatures::packed_bytes != 0) return {bytes, {}};
  return {bytes.first(before - size), bytes.subspan(before - size, size)};
}

}  // namespace panonav
