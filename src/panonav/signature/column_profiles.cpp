#include "panonav/signature/column_profiles.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/column_match.hpp"
#include "panonav/kernels/column_profiles.hpp"

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

// Finer components than this would need more columns.
constexpr int max_components = columns / 2;
static_assert(max_components == ProfileBlur::max_components);

// Number of columns of a quarter turn, both ends included; the others follow by symmetry.
constexpr std::size_t quarter_columns = columns / 4 + 1;
static_assert(quarter_columns <= kernels::profile_wave_stride);

/// One value for each component and each azimuth of a quarter turn.
using QuarterTurns = std::array<float, std::size_t{max_components} * kernels::profile_wave_stride>;
/// One value for each component and band.
using BandComponents = std::array<float, std::size_t{max_components} * bands>;
/// The reconstructed view, band by band.
using BandView = std::array<float, std::size_t{bands} * kernels::profile_view_stride>;

struct Waves {
  QuarterTurns cosines{}, sines{};
};

const Waves& cosine_and_sine_table() {
  static const Waves made = [] {
    Waves waves;
    for (std::size_t k = 0; k < max_components; ++k) {
      for (std::size_t c = 0; c < quarter_columns; ++c) {
        const double angle =
            2.0 * std::numbers::pi * static_cast<double>(k * c % columns) / columns;
        const std::size_t at = k * kernels::profile_wave_stride + c;
        waves.cosines[at] = static_cast<float>(std::cos(angle));
        waves.sines[at] = static_cast<float>(std::sin(angle));
      }
    }
    return waves;
  }();
  return made;
}

/// Components of the bands of a signature: means over bands of nearly equal numbers of rows.
class Bands {
 public:
  Bands(const PackedSignature& signature, int components,
        std::span<const std::uint8_t> allowed_rows)
      : components_(components) {
    const auto rows = static_cast<std::size_t>(signature.shape.rows);
    std::vector<std::uint32_t> used_rows;
    used_rows.reserve(rows);
    for (std::size_t y = 0; y < rows; ++y) {
      if (allowed_rows.empty() || allowed_rows[y] != 0)
        used_rows.push_back(static_cast<std::uint32_t>(y));
    }
    used_ = static_cast<int>(std::min<std::size_t>(bands, used_rows.size()));
    if (used_ < bands) {
      real_.fill(0.0F);
      imaginary_.fill(0.0F);
    }
    if (used_ == 0) return;
    const std::size_t size = static_cast<std::size_t>(components) * rows;
    kernels::average_bands(std::span(signature.magnitudes).first(size),
                           std::span(signature.phases).first(size), rows, used_rows, used_, real_,
                           imaginary_, kernels::chosen_instructions());
  }

  /// Components of the bands of a blurred view. `weights`: of each row, for each band.
  Bands(const PackedSignature& signature, std::span<const float> weights,
        std::span<const float> damping)
      : components_(std::min(signature.shape.components, max_components)),
        used_(std::min(bands, signature.shape.rows)) {
    const std::size_t size =
        static_cast<std::size_t>(components_) * static_cast<std::size_t>(signature.shape.rows);
    kernels::blur_bands(std::span(signature.magnitudes).first(size),
                        std::span(signature.phases).first(size), weights, damping, real_,
                        imaginary_, kernels::chosen_instructions());
  }

  [[nodiscard]] kernels::BandWaves waves() const noexcept {
    const Waves& table = cosine_and_sine_table();
    return {real_.data(),       imaginary_.data(), table.cosines.data(),
            table.sines.data(), components_,       used_};
  }

 private:
  int components_;
  int used_ = 0;
  BandComponents real_, imaginary_;  // 0 of bands that are not used
};

// Subtracts the mean of the whole view: views with fewer than `min_bands_for_shape` bands are
// compared by brightness.
void subtract_view_mean(BandView& view, int used) {
  const auto row = [&](int band) {
    return std::span(view).subspan(static_cast<std::size_t>(band) * kernels::profile_view_stride,
                                   columns);
  };
  float mean = 0.0F;
  for (int b = 0; b < used; ++b) {
    for (const float value : row(b)) mean += value / static_cast<float>(used * columns);
  }
  for (int b = 0; b < used; ++b) {
    for (float& value : row(b)) value -= mean;
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

/// Returns the rotation of the smallest cost.
int compute_rotation_costs(const ColumnProfiles& query, const ColumnProfiles& reference,
                           Costs& costs) {
  require_same_bands(query, reference);
  return kernels::match_columns(query.compared_values(), reference.values(), costs,
                                kernels::chosen_instructions());
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

ProfileBlur::ProfileBlur(int rows, const ElevationBand& elevations, double blur_rad)
    : weights_(static_cast<std::size_t>(rows) * std::size_t{bands}) {
  const std::vector<float> kernel =
      gaussian_weights(blur_rad * rows / (elevations.top_rad - elevations.bottom_rad));
  const int reach = static_cast<int>(kernel.size()) / 2;
  const int used = std::min(bands, rows);
  for (int band = 0; band < used; ++band) {
    const int first = band * rows / used;
    const int end = (band + 1) * rows / used;
    for (int y = first; y < end; ++y) {
      for (int d = -reach; d <= reach; ++d) {
        const int from = std::clamp(y + d, 0, rows - 1);
        weights_[static_cast<std::size_t>(from * bands + band)] +=
            kernel[static_cast<std::size_t>(d + reach)] / static_cast<float>(end - first);
      }
    }
  }
  for (std::size_t k = 0; k < damping_.size(); ++k) {
    const double deviations = static_cast<double>(k) * blur_rad;
    damping_[k] = static_cast<float>(std::exp(-0.5 * deviations * deviations));
  }
}

ColumnProfiles::ColumnProfiles(const PackedSignature& signature, int components,
                               std::span<const std::uint8_t> allowed_rows) {
  // Texts are made only for errors: a search makes the profiles of thousands of views.
  if (components < 0 || components > signature.shape.components) {
    throw ContractError("components", components,
                        "0 (all) or 1 .. " + to_text(signature.shape.components));
  }
  const auto rows = static_cast<std::size_t>(signature.shape.rows);
  if (!allowed_rows.empty() && allowed_rows.size() != rows) {
    throw ContractError("allowed rows", static_cast<double>(allowed_rows.size()),
                        to_text(signature.shape.rows));
  }
  if (components == 0) components = signature.shape.components;
  fill(Bands(signature, std::min(components, max_components), allowed_rows).waves());
}

ColumnProfiles::ColumnProfiles(const PackedSignature& signature, const ProfileBlur& blur) {
  const auto rows = static_cast<int>(blur.weights_.size()) / bands;
  if (signature.shape.rows != rows)
    throw ContractError("rows of a blurred view", signature.shape.rows, to_text(rows));
  fill(Bands(signature, blur.weights_, blur.damping_).waves());
}

void ColumnProfiles::fill(const kernels::BandWaves& waves) {
  values_.fill(mean_byte);
  compared_values_.fill(mean_byte);
  const kernels::Instructions instructions = kernels::chosen_instructions();
  used_bands_ = waves.bands;
  BandView view;
  kernels::reconstruct_bands(waves, view, instructions);
  const bool has_shape = used_bands_ >= min_bands_for_shape;
  if (has_shape) {
    kernels::subtract_column_means(view, used_bands_, instructions);
  } else {
    subtract_view_mean(view, used_bands_);
  }
  const kernels::ColumnContrast contrast{has_shape, mean_contrast_share, bytes_per_contrast};
  if (!kernels::quantise_columns(view, used_bands_, contrast, values_, instructions)) return;
  for (std::size_t b = 0; b < static_cast<std::size_t>(used_bands_); ++b) {
    for (std::size_t c = 0; c < query_columns; ++c) {
      compared_values_[c * bands + b] = values_[b * columns + c * (columns / query_columns)];
    }
  }
}

ColumnMatch match_columns(const ColumnProfiles& query, const ColumnProfiles& reference) {
  Costs costs;
  const int best = compute_rotation_costs(query, reference, costs);
  return make_column_match(query, costs, static_cast<std::size_t>(best));
}

std::array<ColumnMatch, 2> find_two_best_column_matches(const ColumnProfiles& query,
                                                        const ColumnProfiles& reference) {
  constexpr std::size_t min_separation = (columns + 5) / 6;
  Costs costs;
  const auto best = static_cast<std::size_t>(compute_rotation_costs(query, reference, costs));
  std::array<std::uint16_t, 2 * columns> twice;
  std::ranges::copy(costs, std::ranges::copy(costs, twice.begin()).out);
  // Packs each cost with its rotation in the low bits, so that one minimum gives both (and the
  // smallest rotation of equal costs).
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
  std::array<std::uint16_t, query_columns> sums;
  kernels::column_sums_near_turn(query.values(), reference.values(), (nearest + columns) % columns,
                                 sums, kernels::chosen_instructions());
  std::array<double, query_columns> distances{};
  const double scale = static_cast<double>(bytes_per_contrast) * std::max(1, query.used_bands());
  for (std::size_t c = 0; c < query_columns; ++c) distances[c] = sums[c] / scale;
  return distances;
}

}  // namespace panonav
