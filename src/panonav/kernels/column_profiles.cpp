#include "panonav/kernels/column_profiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

namespace {

void require_view(std::size_t values, int bands) {
  constexpr auto view_size = static_cast<std::size_t>(profile_view_stride * matched_bands);
  require(values == view_size, "values of the view", static_cast<double>(values),
          "16 bands with their stride");
  require(bands >= 0 && bands <= matched_bands, "bands", bands, "0 to 16");
}

/// Tables of `BandsJob`: each byte twice as a float, and the directions of the packed phases.
struct ByteTables {
  std::array<std::array<float, 2>, 256> magnitudes{}, directions{};
};

const ByteTables& byte_tables() {
  static const ByteTables made = [] {
    const auto cosine = [](std::size_t phase) {
      return static_cast<float>(std::cos(std::numbers::pi * static_cast<double>(phase) / 128.0));
    };
    ByteTables tables;
    for (std::size_t i = 0; i < 256; ++i) {
      tables.magnitudes[i].fill(static_cast<float>(i));
      tables.directions[i] = {cosine(i), cosine((i + 192) % 256)};
    }
    return tables;
  }();
  return made;
}

/// Makes a job of all rows and bands. `band_components`: room for results.
BandsJob make_bands_job(std::span<const std::uint8_t> magnitudes,
                        std::span<const std::uint8_t> phases, std::size_t rows,
                        std::size_t band_components) {
  require(rows > 0 && !magnitudes.empty() && magnitudes.size() % rows == 0 &&
              phases.size() == magnitudes.size(),
          "bytes of a signature", static_cast<double>(magnitudes.size()),
          "as many magnitudes as phases, in whole components");
  const std::size_t components = magnitudes.size() / rows;
  require(band_components >= components * std::size_t{matched_bands}, "components of bands",
          static_cast<double>(band_components), "16 for each component");
  const ByteTables& tables = byte_tables();
  return {.magnitudes = magnitudes.data(),
          .phases = phases.data(),
          .used_rows = nullptr,
          .magnitude_pairs = tables.magnitudes.front().data(),
          .directions = tables.directions.front().data(),
          .rows = rows,
          .used_count = rows,
          .components = static_cast<int>(components),
          .bands = matched_bands};
}

}  // namespace

void average_bands(std::span<const std::uint8_t> magnitudes, std::span<const std::uint8_t> phases,
                   std::size_t rows, std::span<const std::uint32_t> used_rows, int bands,
                   std::span<float> real, std::span<float> imaginary, Instructions instructions) {
  BandsJob job = make_bands_job(magnitudes, phases, rows, std::min(real.size(), imaginary.size()));
  require(
      bands >= 1 && bands <= matched_bands && static_cast<std::size_t>(bands) <= used_rows.size(),
      "bands", bands, "1 to 16, and at most one for each used row");
  require(std::ranges::all_of(used_rows, [&](std::uint32_t row) { return row < rows; }),
          "used rows", static_cast<double>(used_rows.size()), "rows of the signature");
  job.used_rows = used_rows.data();
  job.used_count = used_rows.size();
  job.bands = bands;
  with_body<ColumnProfilesBody>(
      instructions, [&](auto body) { body.average_bands(job, real.data(), imaginary.data()); });
}

void blur_bands(std::span<const std::uint8_t> magnitudes, std::span<const std::uint8_t> phases,
                std::span<const float> weights, std::span<const float> damping,
                std::span<float> real, std::span<float> imaginary, Instructions instructions) {
  constexpr std::size_t bands = matched_bands;
  require(weights.size() % bands == 0, "weights of rows", static_cast<double>(weights.size()),
          "16 for each row");
  const BandsJob job = make_bands_job(magnitudes, phases, weights.size() / bands,
                                      std::min(real.size(), imaginary.size()));
  require(damping.size() >= static_cast<std::size_t>(job.components), "dampings",
          static_cast<double>(damping.size()), "one for each component");
  with_body<ColumnProfilesBody>(instructions, [&](auto body) {
    body.blur_bands(job, weights.data(), damping.data(), real.data(), imaginary.data());
  });
}

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
