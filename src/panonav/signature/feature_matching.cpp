#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/feature_match.hpp"
#include "panonav/signature/local_features.hpp"

namespace panonav {

namespace {

// Bearings of the columns and rows of a panorama.
struct BearingTables {
  BearingTables(PanoramaShape shape, ElevationBand elevations) {
    const double column_rad = 2.0 * std::numbers::pi / shape.columns;
    for (int column = 0; column < shape.columns; ++column) {
      const double azimuth = column_rad * column;
      azimuths.push_back(azimuth);
      sines.push_back(static_cast<float>(std::sin(azimuth)));
      cosines.push_back(static_cast<float>(std::cos(azimuth)));
    }
    const double row_rad = (elevations.top_rad - elevations.bottom_rad) / shape.rows;
    for (int row = 0; row < shape.rows; ++row)
      tangents.push_back(static_cast<float>(std::tan(elevations.top_rad - (row + 0.5) * row_rad)));
  }
  std::vector<double> azimuths;                 // one per column
  std::vector<float> sines, cosines, tangents;  // one per column, tangents one per row
};

// Bearings and descriptors of a view's features, as a structure of arrays.
struct Bearings {
  Bearings(const LocalFeatures& view, const BearingTables& tables) {
    const std::size_t count = view.features.size();
    for (auto* const numbers : {&sines, &cosines, &tangents}) numbers->reserve(count);
    azimuths.reserve(count);
    descriptor_words.reserve(4 * count);
    for (const LocalFeatures::Feature& feature : view.features) {
      require(feature.column < view.shape.columns && feature.row < view.shape.rows,
              "column of a local feature", feature.column, "within the panorama, as its row");
      azimuths.push_back(tables.azimuths[feature.column]);
      sines.push_back(tables.sines[feature.column]);
      cosines.push_back(tables.cosines[feature.column]);
      tangents.push_back(tables.tangents[feature.row]);
      descriptor_words.insert(descriptor_words.end(), feature.bits.begin(), feature.bits.end());
    }
  }
  std::vector<double> azimuths;
  std::vector<float> sines, cosines, tangents;
  std::vector<std::uint64_t> descriptor_words;
};

// Features that are each other's nearest, sorted by azimuth in the query minus azimuth in the
// reference: the pairs that a rotation brings within a right angle of each other are contiguous.
// The list is stored twice, so that ranges across the wrap are contiguous, too.
class MutualMatches {
 public:
  struct Window {
    int turn, begin, count;
  };

  MutualMatches(const Bearings& query, const Bearings& reference,
                std::span<const std::uint16_t> nearest_of_query,
                std::span<const std::uint16_t> nearest_of_reference) {
    struct Pair {
      double azimuth_rad;
      std::size_t query, reference;
    };
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < nearest_of_query.size() && !nearest_of_reference.empty(); ++i) {
      const std::size_t j = nearest_of_query[i];
      if (nearest_of_reference[j] == i)
        pairs.push_back({query.azimuths[i] - reference.azimuths[j], i, j});
    }
    for (Pair& pair : pairs) {
      if (pair.azimuth_rad < 0.0) pair.azimuth_rad += 2.0 * std::numbers::pi;
    }
    std::ranges::sort(pairs, {}, [](const Pair& p) { return std::pair(p.azimuth_rad, p.query); });
    for (const double period_offset_rad : {0.0, 2.0 * std::numbers::pi}) {
      for (const auto& [azimuth_rad, i, j] : pairs) {
        azimuths_.push_back(azimuth_rad + period_offset_rad);
        const float numbers[numbers_per_match] = {
            query.sines[i],
            query.cosines[i],
            query.tangents[i],
            reference.sines[j],
            reference.cosines[j],
            reference.tangents[j],
            query.sines[i] * reference.cosines[j] - query.cosines[i] * reference.sines[j],
            query.cosines[i] * reference.cosines[j] + query.sines[i] * reference.sines[j]};
        for (std::size_t n = 0; n < numbers_per_match; ++n) values_[n].push_back(numbers[n]);
      }
    }
  }

  [[nodiscard]] std::size_t size() const { return azimuths_.size() / 2; }

  /// Returns the range of matches whose features a rotation by `turn` steps brings within a right
  /// angle of each other; 0 <= turn * step_rad < 2 pi.
  [[nodiscard]] Window select_within_right_angle(int turn, double step_rad) const {
    constexpr double right_angle = 0.5 * std::numbers::pi;
    double from = -turn * step_rad - right_angle;
    while (from < 0.0) from += 2.0 * std::numbers::pi;
    const auto begin = std::ranges::upper_bound(azimuths_, from);
    const auto end = std::lower_bound(begin, azimuths_.end(), from + 2.0 * right_angle);
    return {turn, static_cast<int>(begin - azimuths_.begin()), static_cast<int>(end - begin)};
  }

  [[nodiscard]] kernels::MatchedBearings bearings(int begin, int count) const {
    const auto at = [&](std::size_t n) { return values_[n].data() + begin; };
    return {
        at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), static_cast<std::size_t>(count)};
  }

 private:
  static constexpr std::size_t numbers_per_match = 8;
  std::vector<double> azimuths_;
  std::array<std::vector<float>, numbers_per_match> values_;  // in the order of MatchedBearings
};

constexpr int rotation_steps = 128;
constexpr double tolerance_rad = radians(2.0);
// Largest accepted ratio of the distance between the views to the distance of a feature from either
// view.
constexpr float max_ratio = 2.0F;

struct AngleTable {
  std::array<float, rotation_steps> sines, cosines;
};
// Tabulates cosines and sines of the multiples of `step`.
AngleTable make_angle_table(double step) {
  AngleTable table{};
  for (std::size_t i = 0; i < table.sines.size(); ++i) {
    table.sines[i] = static_cast<float>(std::sin(step * static_cast<double>(i)));
    table.cosines[i] = static_cast<float>(std::cos(step * static_cast<double>(i)));
  }
  return table;
}

}  // namespace

LocalFeatures::Match match_features(const LocalFeatures& query, const LocalFeatures& reference,
                                    int more_than) {
  if (query.shape != reference.shape || query.elevations != reference.elevations) {
    throw ContractError("local features", "of another panorama", "of one shape and band");
  }
  const BearingTables tables(query.shape, query.elevations);
  const Bearings query_bearings(query, tables);
  const Bearings reference_bearings(reference, tables);
  const std::size_t count = query.features.size();
  std::vector<std::uint16_t> nearest_of_query(count);
  std::vector<std::uint16_t> nearest_of_reference(reference.features.size());
  const kernels::Instructions instructions = kernels::chosen_instructions();
  kernels::nearest_descriptors(query_bearings.descriptor_words, reference_bearings.descriptor_words,
                               nearest_of_query, nearest_of_reference, instructions);
  const MutualMatches matched(query_bearings, reference_bearings, nearest_of_query,
                              nearest_of_reference);
  if (static_cast<std::int64_t>(matched.size()) <= more_than) return {};

  static const AngleTable full_angles = make_angle_table(2.0 * std::numbers::pi / rotation_steps);
  static const AngleTable half_angles = make_angle_table(std::numbers::pi / rotation_steps);
  static const kernels::MotionHypotheses hypotheses = [] {
    kernels::MotionHypotheses made{};
    for (int d = 0; d < kernels::motion_axes; ++d) {
      made.cosine[d] = static_cast<float>(std::cos(std::numbers::pi * d / kernels::motion_axes));
      made.sine[d] = static_cast<float>(std::sin(std::numbers::pi * d / kernels::motion_axes));
    }
    made.tolerance_sine = static_cast<float>(std::sin(tolerance_rad));
    made.tolerance_cosine = static_cast<float>(std::cos(tolerance_rad));
    made.max_ratio = max_ratio;
    return made;
  }();
  // A rotation can explain at most the features that it brings within a right angle of each other.
  std::array<MutualMatches::Window, rotation_steps> windows;
  for (std::size_t t = 0; t < rotation_steps; ++t) {
    windows[t] = matched.select_within_right_angle(static_cast<int>(t),
                                                   2.0 * std::numbers::pi / rotation_steps);
  }
  std::ranges::sort(windows, [](const auto& a, const auto& b) {  // the best come first
    return std::pair(-a.count, a.turn) < std::pair(-b.count, b.turn);
  });

  LocalFeatures::Match match;
  std::array<std::int32_t, 2 * std::size_t{kernels::motion_axes}> explained{};
  for (const auto& [turn, begin, bound] : windows) {
    if (bound <= std::max(match.verified, more_than)) break;
    const auto t = static_cast<std::size_t>(turn);
    kernels::count_explained(matched.bearings(begin, bound),
                             {full_angles.sines[t], full_angles.cosines[t], half_angles.sines[t],
                              half_angles.cosines[t]},
                             hypotheses, explained, instructions);
    const std::int32_t max_explained = *std::ranges::max_element(explained);
    if (max_explained > std::max(match.verified, more_than)) {
      match.verified = max_explained;
      match.heading_rad = wrap_angle(2.0 * std::numbers::pi * turn / rotation_steps);
    }
  }
  return match;
}

}  // namespace panonav
