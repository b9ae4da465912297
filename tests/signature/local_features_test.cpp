#include "panonav/signature/local_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/random_views.hpp"

namespace panonav::testing {
namespace {

constexpr ElevationBand band{-0.5, 0.6};

// Grey patches of 5 rows x 9 columns: many corners, each with surroundings of its own.
Panorama patches(std::uint64_t seed, int rows = 80, int columns = 360,
                 std::optional<ElevationBand> elevations = band) {
  Random random(seed);
  const Panorama small = random_panorama(random, (rows + 4) / 5, columns / 9);
  Panorama view(rows, columns, elevations);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) view.at(y, x) = small.at(y / 5, x / 9);
  }
  return view;
}

TEST(LocalFeatures, ATurnedViewHasTheTurnedFeatures) {
  const Panorama view = patches(1);
  const LocalFeatures here = extract_features(view).value();
  EXPECT_GT(here.features.size(), 60U);
  EXPECT_LE(here.features.size(), 256U);
  for (const int turned : {1, 100, 359}) {
    const LocalFeatures there = extract_features(rotate_columns(view, turned)).value();
    auto expected = here.features;
    for (LocalFeatures::Feature& feature : expected) {
      feature.column = static_cast<std::uint16_t>((feature.column + 360 - turned) % 360);
    }
    std::ranges::sort(expected, {}, [](const auto& f) { return std::pair(f.row, f.column); });
    EXPECT_EQ(there.features, expected);
    const LocalFeatures::Match match = match_features(there, here);
    EXPECT_EQ(match.verified, static_cast<int>(here.features.size()));
    EXPECT_NEAR(angle_difference(match.heading_rad, turned * 2.0 * std::numbers::pi / 360.0), 0.0,
                radians(3.4));
  }
}

TEST(LocalFeatures, OfUnrelatedViewsFewAreVerifiedEitherWay) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const LocalFeatures a = extract_features(patches(seed)).value();
    const LocalFeatures b = extract_features(patches(seed + 100)).value();
    const LocalFeatures::Match match = match_features(a, b);
    EXPECT_LT(match.verified, static_cast<int>(a.features.size()) / 4);
    EXPECT_NEAR(match.verified, match_features(b, a).verified, 1);
    EXPECT_EQ(match_features(a, b, match.verified - 1).verified, match.verified);
    EXPECT_EQ(match_features(a, b, match.verified - 1).heading_rad, match.heading_rad);
    EXPECT_EQ(match_features(a, b, match.verified).verified, 0);
  }
}

TEST(LocalFeatures, LightChangesNone) {
  const Panorama view = patches(3);
  Panorama darker = view;
  for (float& value : darker.values()) value = 0.5F * value + 0.1F;
  const LocalFeatures here = extract_features(view).value();
  EXPECT_GT(match_features(extract_features(darker).value(), here).verified,
            static_cast<int>(0.9 * static_cast<double>(here.features.size())));
}

TEST(LocalFeatures, AreNotThereWithoutElevationsStructureOrRows) {
  EXPECT_FALSE(extract_features(patches(1, 80, 360, std::nullopt)));
  const LocalFeatures none = extract_features(Panorama(80, 360, band)).value();
  EXPECT_TRUE(none.features.empty());
  const LocalFeatures some = extract_features(patches(1)).value();
  EXPECT_EQ(match_features(none, some).verified, 0);
  EXPECT_EQ(match_features(some, none).verified, 0);
  EXPECT_EQ(match_features(none, none).verified, 0);
  for (const int rows : {1, 6, 7, 20}) {
    const LocalFeatures low = extract_features(patches(2, rows)).value();
    EXPECT_TRUE(rows > 6 || low.features.empty());
    for (const auto& feature : low.features) EXPECT_LT(feature.row, rows - 3);
  }
  const auto unmasked =
      extract_features(patches(1), {.masked_rows_top = 30, .masked_rows_bottom = 20}).value();
  EXPECT_FALSE(unmasked.features.empty());
  for (const auto& feature : unmasked.features) {
    EXPECT_GE(feature.row, 30);
    EXPECT_LT(feature.row, 60);
  }
  EXPECT_NO_THROW((void)extract_features(patches(1, 9, 36)));
  EXPECT_THROW((void)match_features(some, extract_features(patches(1, 20)).value()), ContractError);
}

TEST(LocalFeatures, ComeBackFromTheirBytes) {
  const LocalFeatures view = extract_features(patches(5)).value();
  auto bytes = pack(view);
  EXPECT_EQ(bytes.size(), view.features.size() * LocalFeatures::packed_bytes);
  EXPECT_LT(bytes.size(), 20'000U);
  EXPECT_EQ(unpack_features(bytes, view.shape, view.elevations), view);
  EXPECT_THROW((void)unpack_features(std::span(bytes).first(35), view.shape, band), ContractError);
  EXPECT_THROW((void)unpack_features(bytes, {80, 8}, band), ContractError);
  EXPECT_THROW((void)unpack_features(bytes, {4, 360}, band), ContractError);
  bytes.resize(257 * LocalFeatures::packed_bytes);
  EXPECT_THROW((void)unpack_features(bytes, view.shape, band), ContractError);
}

}  // namespace
}  // namespace panonav::testing
