#include "panonav/signature/column_profiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/column_match.hpp"

namespace panonav {

namespace {

constexpr int columns = ColumnProfiles::columns;
constexpr int bands = ColumnProfiles::bands;
static_assert(columns == kernels::matched_reference_columns && bands == kernels::matched_bands);
constexpr std::uint8_t mean_byte = 128;  // byte of a value as high as the column's mean
// Byte steps for a deviation of one column contrast; 127 / 40 = 3.2 contrasts fit, and larger
// deviations are rare.
constexpr float bytes_per_contrast = 40.0F;
// Share of the mean contrast of all columns that is added to a column's own contrast before
// dividing, so that the noise of a blank wall is not amplified.
constexpr float mean_contrast_share = 0.2F;
// Smallest number of bands for which columns are compared by shape, without their means.
constexpr int min_bands_for_shape = 4;

// The reconstructed view, band by band; loops are vectorised over the columns of a band.
using BandView = std::array<std::array<float, columns>, bands>;

// Finer components than this would need more columns.
constexpr int max_components = columns / 2;

// Number of columns of a quarter turn, both ends included; the others follow by symmetry. The
// padded number is a multiple of 4, for whole vectors.
constexpr std::size_t quarter_columns = columns / 4 + 1;
constexpr std::size_t padded_quarter_columns = (quarter_columns + 3) / 4 * 4;
using QuarterTurn = std::array<float, padded_quarter_columns>;

struct Waves {
  std::array<QuarterTurn, max_components> cosines, sines;
};

const Waves& cosine_and_sine_table() {
  static const Waves made = [] {
    Waves waves{};
    for (std::size_t k = 0; k < max_components; ++k) {
      for (std::size_t c = 0; c < quarter_columns; ++c) {
        const double angle =
            2.0 * std::numbers::pi * static_cast<double>(k * c % columns) / columns;
        waves.cosines[k][c] = static_cast<float>(std::cos(angle));
        waves.sines[k][c] = static_cast<float>(std::sin(angle));
      }
    }
    return waves;
  }();
  return made;
}

// Reconstructs the view from the allowed rows, averaged in bands of nearly equal numbers of rows.
// Returns the number of bands.
int reconstruct_bands(const PackedSignature& signature, int components,
                      std::span<const std::uint8_t> allowed_rows, BandView& view) {
  const auto rows = static_cast<std::size_t>(signature.shape.rows);
  std::vector<std::size_t> used_rows;
  for (std::size_t y = 0; y < rows; ++y) {
    if (allowed_rows.empty() || allowed_rows[y] != 0) used_rows.push_back(y);
  }
  const std::size_t used = std::min<std::size_t>(bands, used_rows.size());
  static const std::array<float, 256> cosines = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
      table[i] = static_cast<float>(std::cos(std::numbers::pi * static_cast<double>(i) / 128.0));
    }
    return table;
  }();
  for (std::size_t band = 0; band < used; ++band) {
    // Sums over even and over odd components.
    std::array<QuarterTurn, 2> cosine_sums{};
    std::array<QuarterTurn, 2> sine_sums{};
    const std::size_t first = band * used_rows.size() / used;
    const std::size_t end = (band + 1) * used_rows.size() / used;
    for (int k = 0; k < components; ++k) {
      float real = 0.0F;
      float imaginary = 0.0F;
      for (std::size_t i = first; i < end; ++i) {
        const std::size_t at = static_cast<std::size_t>(k) * rows + used_rows[i];
        const auto magnitude = static_cast<float>(signature.magnitudes[at]);
        real += magnitude * cosines[signature.phases[at]];
        imaginary += magnitude * cosines[static_cast<std::uint8_t>(signature.phases[at] - 64)];
      }
      // I(phi) = a_0 / 2 + sum_k a_k cos(k phi) + b_k sin(k phi) [S06 eq. 10].
      const float scale = (k == 0 ? 0.5F : 1.0F) / static_cast<float>(end - first);
      real *= scale;
      imaginary *= scale;
      const auto& cosine = cosine_and_sine_table().cosines[k];
      const auto& sine = cosine_and_sine_table().sines[k];
      auto& cosine_sum = cosine_sums[k % 2];
      auto& sine_sum = sine_sums[k % 2];
      for (std::size_t c = 0; c < padded_quarter_columns; ++c) {
        cosine_sum[c] += real * cosine[c];
        sine_sum[c] += imaginary * sine[c];
      }
    }
    // cos k(pi +- x) = +-cos kx and sin k(pi +- x) = +-sin kx, the sign also being that of (-1)^k.
    auto& values = view[band];
    for (std::size_t c = 0; c < quarter_columns; ++c) {
      const float cosines_ahead = cosine_sums[0][c] + cosine_sums[1][c];
      const float cosines_behind = cosine_sums[0][c] - cosine_sums[1][c];
      const float sines_ahead = sine_sums[0][c] + sine_sums[1][c];
      const float sines_behind = sine_sums[0][c] - sine_sums[1][c];
      values[c] = cosines_ahead - sines_ahead;
      values[(columns - c) % columns] = cosines_ahead + sines_ahead;
      values[columns / 2 - c] = cosines_behind + sines_behind;
      values[columns / 2 + c] = cosines_behind - sines_behind;
    }
  }
  return static_cast<int>(used);
}

void subtract_column_means(BandView& view, std::size_t used) {
  std::array<float, columns> means{};
  for (std::size_t b = 0; b < used; ++b) {
    for (std::size_t c = 0; c < columns; ++c) means[c] += view[b][c];
  }
  for (float& mean : means) mean /= static_cast<float>(used);
  for (std::size_t b = 0; b < used; ++b) {
    for (std::size_t c = 0; c < columns; ++c) view[b][c] -= means[c];
  }
}

// Subtracts the mean of the whole view: views with fewer than `min_bands_for_shape` bands are
// compared by brightness.
void subtract_view_mean(BandView& view, std::size_t used) {
  float mean = 0.0F;
  for (std::size_t b = 0; b < used; ++b) {
    for (const float value : view[b]) mean += value / static_cast<float>(used * columns);
  }
  for (std::size_t b = 0; b < used; ++b) {
    for (float& value : view[b]) value -= mean;
  }
}

constexpr int query_columns = ColumnProfiles::compared_columns;
static_assert(query_columns == kernels::matched_query_columns);

void require_same_bands(const ColumnProfiles& query, const ColumnProfiles& reference) {
  if (query.used_bands() == reference.used_bands()) return;
  throw ContractError("bands of the query", query.used_bands(),
                      to_text(reference.used_bands()) + ", as of the reference");
}

using Costs = std::array<std::uint16_t, columns>;

Costs compute_rotation_costs(const ColumnProfiles& query, const ColumnProfiles& reference) {
  require_same_bands(query, reference);
  Costs costs{};
  kernels::match_columns(query.compared_values(), reference.values(), costs,
                         kernels::chosen_instructions());
  return costs;
}

ColumnMatch make_column_match(const ColumnProfiles& query, const Costs& costs, std::size_t turn) {
  // The kernel sums 16 times the square root of each column's sum of byte differences.
  const double scale =
      16.0 * query_columns *
      std::sqrt(static_cast<double>(bytes_per_contrast) * std::max(1, query.used_bands()));
  return {static_cast<double>(costs[turn]) / scale,
          wrap_angle(2.0 * std::numbers::pi * static_cast<double>(turn) / columns)};
}

}  // namespace

ColumnProfiles::ColumnProfiles(const PackedSignature& signature, int components,
                               std::span<const std::uint8_t> allowed_rows)
    : values_(static_cast<std::size_t>(columns * bands), mean_byte),
      compared_values_(static_cast<std::size_t>(query_columns * bands), mean_byte) {
  require(components >= 0 && components <= signature.shape.components, "components", components,
          "0 (all) or 1 .. " + to_text(signature.shape.components));
  require(
      allowed_rows.empty() || allowed_rows.size() == static_cast<std::size_t>(signature.shape.rows),
      "allowed rows", static_cast<double>(allowed_rows.size()), to_text(signature.shape.rows));
  if (components == 0) components = signature.shape.components;
  components = std::min(components, max_components);

  BandView view;
  used_bands_ = reconstruct_bands(signature, components, allowed_rows, view);
  const auto used = static_cast<std::size_t>(used_bands_);
  const bool has_shape = used_bands_ >= min_bands_for_shape;
  if (has_shape) {
    subtract_column_means(view, used);
  } else {
    subtract_view_mean(view, used);
  }
  std::array<float, columns> contrasts{};
  float mean_contrast = 0.0F;
  for (std::size_t b = 0; b < used; ++b) {
    for (std::size_t c = 0; c < columns; ++c) contrasts[c] += view[b][c] * view[b][c];
  }
  for (float& contrast : contrasts) {
    contrast /= static_cast<float>(used);
    mean_contrast += contrast / columns;
  }
  mean_contrast = std::sqrt(mean_contrast);
  if (!(mean_contrast > 0.0F)) return;  // nothing to see
  for (float& contrast : contrasts) {
    contrast =
        has_shape ? std::sqrt(contrast) + mean_contrast_share * mean_contrast : mean_contrast;
  }
  for (std::size_t b = 0; b < used; ++b) {
    for (std::size_t c = 0; c < columns; ++c) {
      const float value =
          std::clamp(bytes_per_contrast * view[b][c] / contrasts[c], -127.0F, 127.0F);
      values_[b * columns + c] =
          static_cast<std::uint8_t>(static_cast<int>(value + (mean_byte + 0.5F)));
    }
    for (std::size_t c = 0; c < query_columns; ++c) {
      compared_values_[c * bands + b] = values_[b * columns + c * (columns / query_columns)];
    }
  }
}

ColumnMatch match_columns(const ColumnProfiles& query, const ColumnProfiles& reference) {
  const auto costs = compute_rotation_costs(query, reference);
  const auto best = std::ranges::min_element(costs) - costs.begin();
  return make_column_match(query, costs, static_cast<std::size_t>(best));
}

std::array<ColumnMatch, 2> find_two_best_column_matches(const ColumnProfiles& query,
                                                        const ColumnProfiles& reference) {
  constexpr std::size_t min_separation = (columns + 5) / 6;
  const auto costs = compute_rotation_costs(query, reference);
  // Packs each cost with its rotation in the low bits, so that one minimum gives both (and the
  // smallest rotation of equal costs).
  std::uint32_t min_cost = ~0U;
  for (std::uint32_t turn = 0; turn < columns; ++turn) {
    min_cost = std::min(min_cost, static_cast<std::uint32_t>(costs[turn]) * columns + turn);
  }
  const std::size_t best = min_cost % columns;
  std::array<std::uint16_t, 2 * columns> twice;
  std::ranges::copy(costs, std::ranges::copy(costs, twice.begin()).out);
  std::uint32_t min_other_cost = ~0U;
  for (std::uint32_t turn = min_separation; turn <= columns - min_separation; ++turn) {
    min_other_cost =
        std::min(min_other_cost, static_cast<std::uint32_t>(twice[best + turn]) * columns + turn);
  }
  const std::size_t other = (best + min_other_cost % columns) % columns;
  return {make_column_match(query, costs, best), make_column_match(query, costs, other)};
}

std::array<double, ColumnProfiles::compared_columns> column_distances_at_heading(
    const ColumnProfiles& query, const ColumnProfiles& reference, double heading_rad) {
  require_same_bands(query, reference);
  const auto nearest =
      static_cast<int>(std::lround(wrap_angle(heading_rad) * columns / (2.0 * std::numbers::pi)));
  std::array<int, query_columns> min_sums{};
  for (int turn = nearest - 1; turn <= nearest + 1; ++turn) {
    const auto shift = static_cast<std::size_t>((turn + 2 * columns) % columns);
    std::array<int, query_columns> sums{};
    for (std::size_t b = 0; b < bands; ++b) {
      const std::uint8_t* const query_band = query.values().data() + b * columns;
      const std::uint8_t* const reference_band = reference.values().data() + b * columns;
      for (std::size_t c = 0; c < query_columns; ++c) {
        const std::size_t at = c * (columns / query_columns);
        sums[c] += std::abs(query_band[at] - reference_band[(at + shift) % columns]);
      }
    }
    for (std::size_t c = 0; c < query_columns; ++c) {
      min_sums[c] = turn == nearest - 1 ? sums[c] : std::min(min_sums[c], sums[c]);
    }
  }
  std::array<double, query_columns> distances{};
  const double scale = static_cast<double>(bytes_per_contrast) * std::max(1, query.used_bands());
  for (std::size_t c = 0; c < query_columns; ++c) distances[c] = min_sums[c] / scale;
  return distances;
}

}  // namespace panonav
