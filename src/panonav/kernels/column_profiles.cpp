#include "panonav/kernels/column_profiles.hpp"

#include <cstddef>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

namespace {

void require_view(std::size_t values, int bands) {
  constexpr auto view_size = static_cast<std::size_t>(profile_view_stride * matched_bands);
  require(values == view_size, "values of the view", static_cast<double>(values),
          to_text(static_cast<double>(view_size)));
  require(bands >= 0 && bands <= matched_bands, "bands", bands, "0 to 16");
}

}  // namespace

void reconstruct_bands(const BandWaves& waves, std::span<float> view, Instructions instructions) {
  require_view(view.size(), waves.bands);
  with_body<ColumnProfilesBody>(instructions,
                                [&](auto body) { body.reconstruct_bands(waves, view.data()); });
}

void subtract_column_means(std::span<float> view, int bands, Instructions instructions) {
  require_view(view.size(), bands);
  with_body<ColumnProfilesBody>(instructions,
                                [&](auto body) { body.subtract_column_means(view.data(), bands); });
}

bool quantise_columns(std::span<const float> view, int bands, const ColumnContrast& contrast,
                      std::span<std::uint8_t> values, Instructions instructions) {
  require_view(view.size(), bands);
  require(values.size() == static_cast<std::size_t>(matched_reference_columns * matched_bands),
          "bytes of the columns", static_cast<double>(values.size()), "2048");
  return with_body<ColumnProfilesBody>(instructions, [&](auto body) {
    return body.quantise_columns(view.data(), bands, contrast, values.data());
  });
}

}  // namespace panonav::kernels
