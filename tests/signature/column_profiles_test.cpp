#include "panonav/signature/column_profiles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

/// A smooth picture around the robot: waves of the first `waves` frequencies in every row,
/// neighbouring rows alike.
Panorama smooth_view(std::uint64_t seed, int rows = 40, int columns = 256, int waves = 12) {
  Random random(seed);
  Panorama view(rows, columns, std::nullopt);
  for (int k = 0; k < waves; ++k) {
    for (int wave = 0; wave < 3; ++wave) {
      const double phase = random.uniform(-std::numbers::pi, std::numbers::pi);
      const double vertical = random.uniform(0.05, 0.5);
      const double shift = random.uniform(0.0, 6.0);
      const double amplitude = 0.05 * random.normal();
      for (int y = 0; y < rows; ++y) {
        for (int c = 0; c < columns; ++c) {
          view.at(y, c) += static_cast<float>(
              amplitude * std::cos(k * 2.0 * std::numbers::pi * c / columns + phase) *
              std::cos(vertical * y + shift));
        }
      }
    }
  }
  return view;
}

PackedSignature packed(const Panorama& view) {
  return pack(compute_signature(view), 0.4F);
}

Panorama changed(Panorama view, float gain, float offset) {
  for (float& value : view.values()) value = gain * value + offset;
  return view;
}

/// A tenth of the columns, from `first` on, in one colour.
Panorama hidden(Panorama view, int first, float colour) {
  for (int y = 0; y < view.rows(); ++y) {
    for (int i = 0; i < view.columns() / 10; ++i) view.at(y, (first + i) % view.columns()) = colour;
  }
  return view;
}

double difference(const Panorama& query, const Panorama& reference) {
  return match_columns(ColumnProfiles(packed(query)), ColumnProfiles(packed(reference))).difference;
}

TEST(ColumnProfiles, AreThoseOfTheBandLimitedView) {
  const Panorama view = smooth_view(1);
  const ColumnProfiles profiles(packed(view));
  ASSERT_EQ(profiles.used_bands(), 16);
  // By the definition, from the picture itself: it has no wave beyond the signature's.
  constexpr std::size_t columns = ColumnProfiles::columns;
  std::vector<std::vector<double>> bands(16, std::vector<double>(columns));
  for (std::size_t b = 0; b < 16; ++b) {
    const std::size_t first = b * 40 / 16;
    const std::size_t end = (b + 1) * 40 / 16;
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t y = first; y < end; ++y) {
        bands[b][c] += view.at(static_cast<int>(y), static_cast<int>(2 * c)) /
                       static_cast<double>(end - first);
      }
    }
  }
  std::vector<double> contrast(columns);
  double all = 0.0;
  for (std::size_t c = 0; c < columns; ++c) {
    double mean = 0.0;
    for (std::size_t b = 0; b < 16; ++b) mean += bands[b][c] / 16.0;
    for (std::size_t b = 0; b < 16; ++b) {
      bands[b][c] -= mean;
      contrast[c] += bands[b][c] * bands[b][c] / 16.0;
    }
    all += contrast[c] / columns;
  }
  double sum = 0.0;
  double error = 0.0;
  for (std::size_t b = 0; b < 16; ++b) {
    for (std::size_t c = 0; c < columns; ++c) {
      const double expected = 40.0 * bands[b][c] / (std::sqrt(contrast[c]) + 0.2 * std::sqrt(all));
      const double found = profiles.values()[b * columns + c] - 128.0;
      EXPECT_NEAR(found, std::clamp(expected, -127.0, 127.0),
                  8.0);  // phases and magnitudes are bytes
      error += std::abs(found - expected);
      sum += std::abs(expected);
    }
  }
  EXPECT_GT(sum / (16.0 * columns), 10.0);
  EXPECT_LT(error, 0.05 * sum);
}

TEST(ColumnProfiles, DoNotChangeWithGainAndOffset) {
  const Panorama view = smooth_view(2);
  const double other = difference(smooth_view(3), view);
  // The rest is the rounding of smaller magnitudes to bytes.
  EXPECT_LT(difference(changed(view, 0.7F, 0.0F), view), 0.3 * other);
  EXPECT_LT(difference(changed(view, 0.7F, 0.1F), view), 0.3 * other);
}

TEST(ColumnMatch, OfTheSameViewTurnedIsZeroAndTellsTheTurn) {
  const Panorama view = smooth_view(4);
  for (const int turned : {0, 2, 64, 128, 130, 254}) {  // whole columns of the profiles
    const ColumnMatch match = match_columns(ColumnProfiles(packed(rotate_columns(view, turned))),
                                            ColumnProfiles(packed(view)));
    EXPECT_LT(match.difference, 0.1);
    EXPECT_NEAR(
        angle_difference(match.heading_rad, 2.0 * std::numbers::pi * turned / view.columns()), 0.0,
        1e-9);
  }
  const ColumnProfiles same(packed(view));
  EXPECT_EQ(match_columns(same, same).difference, 0.0);
}

TEST(ColumnMatch, AHiddenTenthRaisesTheDifferenceByLittle) {
  int checked = 0;
  for (std::uint64_t seed = 10; seed < 20; ++seed) {
    const Panorama view = smooth_view(seed);
    const double other = difference(smooth_view(seed + 100), view);
    for (const float colour : {-0.5F, 0.0F, 0.5F}) {
      const Panorama spoilt = hidden(rotate_columns(view, 50), 17 * static_cast<int>(seed), colour);
      const ColumnMatch match =
          match_columns(ColumnProfiles(packed(spoilt)), ColumnProfiles(packed(view)));
      EXPECT_LT(match.difference, 0.75 * other) << "seed " << seed << " colour " << colour;
      EXPECT_NEAR(angle_difference(match.heading_rad, 2.0 * std::numbers::pi * 50 / 256), 0.0,
                  radians(3.0));
      ++checked;
    }
  }
  EXPECT_EQ(checked, 30);
}

TEST(ColumnMatch, IsTheLeastOverAllTurns) {
  const ColumnProfiles query(packed(smooth_view(5)));
  const ColumnProfiles reference(packed(smooth_view(6)));
  double min_difference = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < 128; ++s) {
    double sum = 0.0;
    for (std::size_t c = 0; c < 32; ++c) {
      int l1 = 0;
      for (std::size_t b = 0; b < 16; ++b) {
        l1 += std::abs(query.values()[b * 128 + 4 * c] -
                       reference.values()[b * 128 + (4 * c + s) % 128]);
      }
      sum += std::sqrt(l1 / 40.0 / 16.0) / 32.0;
    }
    min_difference = std::min(min_difference, sum);
  }
  EXPECT_NEAR(match_columns(query, reference).difference, min_difference, 1e-3);
}

double mean_of_roots(std::span<const double> distances) {
  double sum = 0.0;
  for (const double distance : distances) sum += std::sqrt(distance);
  return sum / static_cast<double>(distances.size());
}

constexpr double turn_step_rad = 2.0 * std::numbers::pi / ColumnProfiles::columns;

TEST(ColumnDistances, NearTheMatchedTurnTheirRootsAreAtMostTheDifference) {
  int below = 0;
  for (std::uint64_t seed = 30; seed < 40; ++seed) {
    const ColumnProfiles query(packed(smooth_view(seed)));
    const ColumnProfiles reference(packed(smooth_view(seed + 100)));
    const ColumnMatch match = match_columns(query, reference);
    const double mean =
        mean_of_roots(column_distances_at_heading(query, reference, match.heading_rad));
    EXPECT_GT(mean, 0.0);
    EXPECT_LE(mean, match.difference + 1e-3) << "seed " << seed;  // roots are rounded to bytes
    below += mean < match.difference - 1e-3;
  }
  EXPECT_GT(below, 0) << "columns may take the turn beside the nearest one";
}

TEST(ColumnDistances, AreTheLeastOfThreeTurnsColumnByColumn) {
  const ColumnProfiles query(packed(smooth_view(5)));
  const ColumnProfiles reference(packed(smooth_view(6)));
  for (const int nearest : {0, 1, 63, 64, 90, 127}) {
    // Any heading less than half a step away, on any lap.
    for (const double heading_rad : {nearest * turn_step_rad, (nearest + 0.4) * turn_step_rad,
                                     (nearest - 0.4) * turn_step_rad - 2.0 * std::numbers::pi}) {
      const auto distances = column_distances_at_heading(query, reference, heading_rad);
      for (std::size_t c = 0; c < distances.size(); ++c) {
        double min_difference = std::numeric_limits<double>::infinity();
        for (int turn = nearest - 1; turn <= nearest + 1; ++turn) {
          const std::size_t at = (4 * c + static_cast<std::size_t>(turn + 128)) % 128;
          int l1 = 0;
          for (std::size_t b = 0; b < 16; ++b) {
            l1 += std::abs(query.values()[b * 128 + 4 * c] - reference.values()[b * 128 + at]);
          }
          min_difference = std::min(min_difference, l1 / 40.0 / 16.0);
        }
        EXPECT_NEAR(distances[c], min_difference, 1e-12) << "turn " << nearest << " column " << c;
      }
    }
  }
}

TEST(ColumnDistances, OfTheSameViewTurnedByWholeStepsAreZero) {
  const PackedSignature view = packed(smooth_view(4));
  const ColumnProfiles reference(view);
  for (const int turned : {0, 1, 31, 64, 127}) {
    // A step is two units of a packed phase, so nothing is rounded but the values of the profiles.
    PackedSignature query = view;
    for (std::size_t i = 0; i < query.phases.size(); ++i) {
      const auto k = static_cast<int>(i) / view.shape.rows;
      query.phases[i] = static_cast<std::uint8_t>(query.phases[i] + 2 * k * turned);
    }
    const ColumnProfiles profiles(query);
    // One band of 16 that is rounded the other way.
    constexpr double rounding = 1.0 / (40.0 * 16.0) + 1e-12;
    for (const double off : {0.0, 0.9, -0.9}) {
      const auto distances =
          column_distances_at_heading(profiles, reference, (turned + off) * turn_step_rad);
      for (const double distance : distances) EXPECT_LE(distance, rounding) << turned << " " << off;
      EXPECT_GE(std::ranges::count(distances, 0.0), 28);
    }
    const auto elsewhere =
        column_distances_at_heading(profiles, reference, (turned + 8) * turn_step_rad);
    EXPECT_GT(std::ranges::max(elsewhere), 0.1);
  }
  for (const double distance : column_distances_at_heading(reference, reference, 0.0)) {
    EXPECT_EQ(distance, 0.0);
  }
}

TEST(ColumnProfiles, MaskedRowsDoNotCount) {
  Panorama view = smooth_view(7);
  std::vector<std::uint8_t> allowed(40, 1);
  for (int y = 0; y < 10; ++y) allowed[y] = 0;
  const ColumnProfiles clean(packed(view), 0, allowed);
  for (int y = 0; y < 10; ++y) {
    for (int c = 0; c < view.columns(); ++c) view.at(y, c) = 0.1F * static_cast<float>(c % 7);
  }
  EXPECT_EQ(ColumnProfiles(packed(view), 0, allowed), clean);
  EXPECT_NE(ColumnProfiles(packed(view)), clean);
}

TEST(ColumnProfiles, OfFewRowsCompareBrightness) {
  for (const int rows : {1, 2, 3, 5}) {
    const Panorama view = smooth_view(8, rows);
    const ColumnProfiles profiles(packed(view));
    EXPECT_EQ(profiles.used_bands(), rows);
    const ColumnMatch same =
        match_columns(ColumnProfiles(packed(rotate_columns(view, 20))), profiles);
    EXPECT_NEAR(angle_difference(same.heading_rad, 2.0 * std::numbers::pi * 20 / 256), 0.0, 1e-9);
    EXPECT_LT(same.difference, difference(smooth_view(9, rows), view));
  }
}

TEST(ColumnProfiles, OfAViewWithoutStructureAreFlat) {
  const Panorama grey(16, 64, std::nullopt, std::vector<float>(16 * 64, 0.5F));
  const ColumnProfiles profiles(packed(grey));
  EXPECT_TRUE(std::ranges::all_of(profiles.values(), [](std::uint8_t v) { return v == 128; }));
  EXPECT_EQ(match_columns(profiles, profiles).heading_rad, 0.0);
}

TEST(ColumnProfiles, RefuseBadInput) {
  const PackedSignature signature = packed(smooth_view(1));
  EXPECT_THROW(ColumnProfiles(signature, 16), ContractError);
  EXPECT_THROW(ColumnProfiles(signature, -1), ContractError);
  EXPECT_THROW(ColumnProfiles(signature, 0, std::vector<std::uint8_t>(3, 1)), ContractError);
  EXPECT_THROW(
      (void)match_columns(ColumnProfiles(signature), ColumnProfiles(packed(smooth_view(1, 5)))),
      ContractError);
  EXPECT_THROW((void)column_distances_at_heading(ColumnProfiles(signature),
                                                 ColumnProfiles(packed(smooth_view(1, 5))), 0.0),
               ContractError);
}

TEST(MatchColumnsTwice, FindsTheSecondTurnOnTheOtherSide) {
  // A view that is nearly the same when turned round, as in a corridor.
  Panorama view = smooth_view(5);
  const int half = view.columns() / 2;
  for (int y = 0; y < view.rows(); ++y) {
    for (int c = 0; c < half; ++c) {
      view.at(y, c + half) = 0.95F * view.at(y, c) + 0.05F * view.at(y, c + half);
    }
  }
  const ColumnProfiles profiles(packed(view));
  const auto [best, other] = find_two_best_column_matches(profiles, profiles);
  const ColumnMatch alone = match_columns(profiles, profiles);
  EXPECT_EQ(best.difference, alone.difference);
  EXPECT_EQ(best.heading_rad, alone.heading_rad);
  EXPECT_NEAR(std::abs(other.heading_rad), std::numbers::pi, 1e-9);
  EXPECT_GT(other.difference, best.difference);

  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto [nearest, farther] = find_two_best_column_matches(
        ColumnProfiles(packed(smooth_view(seed))), ColumnProfiles(packed(smooth_view(seed + 50))));
    EXPECT_GE(farther.difference, nearest.difference);
    EXPECT_GE(std::abs(angle_difference(farther.heading_rad, nearest.heading_rad)),
              std::numbers::pi / 3 - 1e-9);
  }
}

}  // namespace
}  // namespace panonav
