#include "panonav/localisation/internal/query_restoration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/relative_tilt.hpp"

namespace panonav {

namespace {

/// Number of matches with which the camera is estimated.
constexpr std::size_t compared_match_count = 5;
/// Compared deviations, in steps of the square root of 2: from a quarter of a column of
/// `ColumnProfiles` to two of them.
constexpr std::array<double, 7> compared_blurs_rad{radians(0.7), radians(1.0), radians(1.4),
                                                   radians(2.0), radians(2.8), radians(4.0),
                                                   radians(5.6)};

/// Returns the view with adjacent rows averaged, as long as at least `min_rows` remain: enough for
/// a tilt, in a fraction of the time.
HomingView average_rows(const HomingView& view) {
  constexpr int min_rows = 40;
  int step = view.rows() / min_rows;
  while (step > 1 && view.rows() % step != 0) --step;
  if (step <= 1) return view;
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < view.components(); ++k) {
    for (int y = 0; y < view.rows(); y += step) {
      float a = 0.0F;
      float b = 0.0F;
      for (int i = 0; i < step; ++i) {
        a += view.a(y + i, k);
        b += view.b(y + i, k);
      }
      cosines.push_back(a / static_cast<float>(step));
      sines.push_back(b / static_cast<float>(step));
    }
  }
  return {view.rows() / step, view.components(), std::move(cosines), std::move(sines),
          view.elevations()};
}

/// A restoration and how well a match then agrees with the query.
struct Attempt {
  std::optional<RestoredQuery> query;
  double difference = 1.0;  ///< of the columns of that match
  bool is_significant = false;
};

/// True if significantly more columns agree better with the match than without the restoration, at
/// the 5 % level by the sign test: the gain must not come from few columns.
bool is_significantly_better(const ColumnProfiles& query, const ColumnProfiles& match,
                             double heading_rad, const ColumnProfiles& restored_query,
                             const ColumnProfiles& restored_match, double restored_heading_rad) {
  // 22 or more of 32 fair coins show heads with a probability of 2.5 %, 21 or more with 5.5 %.
  constexpr int min_better_columns = 22;
  const auto before = column_distances_at_heading(query, match, heading_rad);
  const auto after =
      column_distances_at_heading(restored_query, restored_match, restored_heading_rad);
  int better = 0;
  for (std::size_t c = 0; c < before.size(); ++c) better += after[c] < before[c] ? 1 : 0;
  return better >= min_better_columns;
}

void try_tilts(const RestoredQuery& query, const VisualMemory& memory,
               std::span<const RankedMatch> ranked, Attempt& best) {
  const HomingView current =
      homing_view(unpack(query.signature, memory.full_scale(), memory.elevations()));
  const TiltEstimator estimator(average_rows(current));
  const Panorama tilted = synthesise(current);
  const ColumnProfiles profiles(query.signature);
  for (const RankedMatch& match : ranked) {
    const HomingView home = average_rows(homing_view(memory, match.match.view));
    const Tilt tilt = estimator.tilt_from(home, -match.columns.heading_rad);
    PackedSignature level = pack(
        compute_signature(level_panorama(tilted, tilt), current.components()), memory.full_scale());
    const ColumnProfiles levelled(level);
    const ColumnProfiles reference(memory.packed(match.match.view));
    const ColumnMatch found = match_columns(levelled, reference);
    if (found.difference >= best.difference) continue;
    best = {RestoredQuery{std::move(level), tilt, query.blur_rad}, found.difference,
            is_significantly_better(profiles, reference, match.columns.heading_rad, levelled,
                                    reference, found.heading_rad)};
  }
}

void try_blurs(const RestoredQuery& query, const VisualMemory& memory,
               std::span<const RankedMatch> ranked, Attempt& best) {
  const ColumnProfiles profiles(query.signature);
  std::vector<PackedSignature> sharp;
  for (const RankedMatch& match : ranked) sharp.push_back(memory.packed(match.match.view));
  for (const double blur_rad : compared_blurs_rad) {
    const ProfileBlur blur(memory.shape().rows, *memory.elevations(), blur_rad);
    for (std::size_t i = 0; i < ranked.size(); ++i) {
      const ColumnProfiles blurred(sharp[i], blur);
      const ColumnMatch found = match_columns(profiles, blurred);
      if (found.difference >= best.difference) continue;
      best = {
          RestoredQuery{query.signature, query.tilt, blur_rad}, found.difference,
          is_significantly_better(profiles, ColumnProfiles(sharp[i]), ranked[i].columns.heading_rad,
                                  profiles, blurred, found.heading_rad)};
    }
  }
}

}  // namespace

std::vector<RestoredQuery> restore_query(const RestoredQuery& query, const VisualMemory& memory,
                                         std::span<const RankedMatch> ranked) {
  constexpr int min_components = 2;
  if (!memory.elevations() || query.signature.shape.components < min_components || ranked.empty())
    return {};
  Attempt level;
  for (const RankedMatch& match : ranked)
    level.difference = std::min(level.difference, match.columns.difference);
  Attempt blurred{.difference = level.difference};
  const auto compared = ranked.first(std::min(compared_match_count, ranked.size()));
  if (query.tilt == Tilt{}) try_tilts(query, memory, compared, level);
  if (query.blur_rad == 0.0) try_blurs(query, memory, compared, blurred);
  if (blurred.difference < level.difference) std::swap(level, blurred);
  std::vector<RestoredQuery> restored;
  for (Attempt* const attempt : {&level, &blurred}) {
    if (attempt->is_significant) restored.push_back(*std::move(attempt->query));
  }
  return restored;
}

PackedSignature blur(const PackedSignature& view, double blur_rad, const ElevationBand& band) {
  const int rows = view.shape.rows;
  const std::vector<float> kernel =
      gaussian_weights(blur_rad * rows / (band.top_rad - band.bottom_rad));
  const int reach = static_cast<int>(kernel.size()) / 2;
  static const std::array<float, 256> cosines = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i)
      table[i] = static_cast<float>(std::cos(std::numbers::pi * static_cast<double>(i) / 128.0));
    return table;
  }();
  PackedSignature blurred = view;
  std::vector<float> real(static_cast<std::size_t>(rows));
  std::vector<float> imaginary(static_cast<std::size_t>(rows));
  for (int k = 0; k < view.shape.components; ++k) {
    const auto first = static_cast<std::size_t>(k) * static_cast<std::size_t>(rows);
    for (std::size_t y = 0; y < real.size(); ++y) {
      const auto magnitude = static_cast<float>(view.magnitudes[first + y]);
      const std::uint8_t phase = view.phases[first + y];
      real[y] = magnitude * cosines[phase];
      imaginary[y] = magnitude * cosines[static_cast<std::uint8_t>(phase - 64)];
    }
    const auto damping = static_cast<float>(std::exp(-0.5 * k * k * blur_rad * blur_rad));
    for (int y = 0; y < rows; ++y) {
      float a = 0.0F;
      float b = 0.0F;
      for (int d = -reach; d <= reach; ++d) {
        const auto from = static_cast<std::size_t>(std::clamp(y + d, 0, rows - 1));
        a += kernel[static_cast<std::size_t>(d + reach)] * real[from];
        b += kernel[static_cast<std::size_t>(d + reach)] * imaginary[from];
      }
      const auto at = first + static_cast<std::size_t>(y);
      const auto magnitude = std::lround(damping * std::hypot(a, b));
      blurred.magnitudes[at] = static_cast<std::uint8_t>(std::min(magnitude, 255L));
      blurred.phases[at] =
          magnitude == 0 ? 0
                         : static_cast<std::uint8_t>(
                               std::lround(std::atan2(b, a) * 128.0F / std::numbers::pi_v<float>));
    }
  }
  return blurred;
}

LocalFeatures level_features(LocalFeatures features, const Tilt& tilt) {
  const double column_rad = 2.0 * std::numbers::pi / features.shape.columns;
  const double row_rad =
      (features.elevations.top_rad - features.elevations.bottom_rad) / features.shape.rows;
  std::vector<LocalFeatures::Feature> level;
  for (LocalFeatures::Feature feature : features.features) {
    const auto seen = Direction3::from_angles(
        feature.column * column_rad, features.elevations.top_rad - (feature.row + 0.5) * row_rad);
    const Direction3 level_seen = level_direction(seen, tilt);
    const auto row = static_cast<int>(
        std::floor((features.elevations.top_rad - level_seen.elevation_rad()) / row_rad));
    if (row < 0 || row >= features.shape.rows) continue;
    const auto column = static_cast<int>(std::lround(level_seen.azimuth_rad() / column_rad));
    feature.row = static_cast<std::uint16_t>(row);
    feature.column =
        static_cast<std::uint16_t>((column + features.shape.columns) % features.shape.columns);
    level.push_back(feature);
  }
  features.features = std::move(level);
  return features;
}

}  // namespace panonav
