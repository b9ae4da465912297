#include "panonav/signature/gradient_features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/sector_matching.hpp"
#include "support/patch_views.hpp"

namespace panonav::testing {
namespace {

constexpr PanoramaShape patch_shape{80, 360};

GradientFeatures features_of(std::uint64_t seed) {
  return extract_gradient_features(make_patch_view(seed)).value();
}

/// Compares a query with references, and verifies the one of largest bound.
SectorMatch match_one(const GradientFeatures& query, const GradientFeatures& reference) {
  NearestFeatures nearest(query);
  nearest.add(reference);
  for (std::uint64_t seed = 100; seed < 106; ++seed) nearest.add(features_of(seed));
  const auto pairs = nearest.weigh_pairs().front();
  const SectorMatch match = verify_sector(query, reference, pairs);
  EXPECT_LE(match.score, bound_score(query, reference, pairs));
  return match;
}

TEST(GradientFeatures, ATurnedViewHasTheTurnedFeatures) {
  const GradientFeatures here = features_of(1);
  EXPECT_GT(here.corners.size(), 100U);
  EXPECT_LE(here.corners.size(), std::size_t{GradientFeatures::max_count});
  const auto there = extract_gradient_features(rotate_columns(make_patch_view(1), 50)).value();
  ASSERT_EQ(there.corners.size(), here.corners.size());
  std::size_t found = 0;
  for (std::size_t i = 0; i < here.corners.size(); ++i) {
    for (std::size_t j = 0; j < there.corners.size(); ++j) {
      if (here.histograms[i] != there.histograms[j]) continue;
      const double turned_rad =
          angle_difference(here.corners[i].azimuth_rad, there.corners[j].azimuth_rad);
      if (std::abs(turned_rad - 50 * 2.0 * std::numbers::pi / 360) < 1e-5) ++found;
    }
  }
  EXPECT_EQ(found, here.corners.size());
  EXPECT_EQ(there.leading, here.leading);
  EXPECT_GT(here.leading, 50U);
  EXPECT_LT(here.leading, here.corners.size());
}

TEST(GradientFeatures, ASectorMatchesItsViewAtItsTurn) {
  const GradientFeatures view = features_of(2);
  const double width_rad = radians(70.0);
  for (const double azimuth_rad : {-3.0, -1.0, 0.4, 2.2}) {
    Camera camera;
    camera.image_size = {400, 300};
    camera.centre = {200.0, 150.0};
    camera.model = PinholeModel{.focal_length_px = focal_length_from_field_of_view(400, width_rad)};
    const Image picture = take_narrow_picture(make_patch_view(2), azimuth_rad, width_rad);
    const GradientFeatures query = extract_gradient_features(
        unwarp_sector(picture.view(), camera, patch_shape, patch_band).value());
    ASSERT_GT(query.corners.size(), 10U);
    const SectorMatch same = match_one(query, view);
    EXPECT_GT(same.verified, 10);
    EXPECT_NEAR(angle_difference(same.heading_rad, azimuth_rad), 0.0, radians(1.0));
    const SectorMatch other = match_one(query, features_of(3));
    EXPECT_LT(other.score, 0.25 * same.score);
  }
}

/// Sum of the weights of a query's pairs with a reference among other ones.
double sum_weights(const GradientFeatures& query, const GradientFeatures& reference) {
  NearestFeatures nearest(query);
  nearest.add(reference);
  for (std::uint64_t seed = 100; seed < 106; ++seed) nearest.add(features_of(seed));
  double sum = 0.0;
  const auto pairs = nearest.weigh_pairs();
  for (const SectorPair& pair : pairs.front()) sum += static_cast<double>(pair.weight);
  return sum;
}

/// Returns by which factor patches of three sizes match better than those of one, where all things
/// appear `enlarged` times as large as in the panorama.
double gain_of_three_sizes(double enlarged) {
  const Image picture = take_narrow_picture(make_patch_view(2), 0.0, radians(60.0));
  Camera camera;
  camera.image_size = {400, 300};
  camera.centre = {200.0, 150.0};
  const double focal_px = focal_length_from_field_of_view(400, radians(60.0));
  camera.model = PinholeModel{.focal_length_px = focal_px / enlarged};
  const GradientFeatures three = extract_gradient_features(
      unwarp_sector(picture.view(), camera, patch_shape, patch_band).value());
  std::size_t patches_of_first_size = 1;
  while (three.corners.at(patches_of_first_size) != three.corners.front()) ++patches_of_first_size;
  GradientFeatures one = three;
  one.corners.resize(patches_of_first_size);
  one.histograms.resize(patches_of_first_size);
  return sum_weights(three, features_of(2)) / sum_weights(one, features_of(2));
}

TEST(GradientFeatures, LargerPatchesMatchWhatAppearsLarger) {
  const double of_same_size = gain_of_three_sizes(1.0);
  EXPECT_GE(of_same_size, 1.0);
  EXPECT_GT(gain_of_three_sizes(std::numbers::sqrt2), of_same_size);
  EXPECT_GT(gain_of_three_sizes(1.0 / std::numbers::sqrt2), of_same_size);
}

TEST(GradientFeatures, MirroredTwiceIsTheSameAndOnceIsAnother) {
  const GradientFeatures view = features_of(4);
  EXPECT_EQ(mirror(mirror(view)), view);
  EXPECT_NE(mirror(view), view);
}

TEST(GradientFeatures, CutsKeepWhatTheSectorShows) {
  const GradientFeatures view = features_of(5);
  const GradientFeatures cut = cut_sector(view, 3.0, 1.0, {-0.2, 0.3});
  EXPECT_GT(cut.corners.size(), 5U);
  for (const auto& corner : cut.corners) {
    EXPECT_LE(std::abs(corner.azimuth_rad), 0.5F);
    EXPECT_LE(corner.elevation_rad, 0.3F);
    EXPECT_GE(corner.elevation_rad, -0.2F);
  }
  EXPECT_EQ(cut_sector(view, 0.0, 7.0, {-1.0, 1.0}).corners.size(), view.corners.size());
}

TEST(GradientFeatures, PackAndJoinAndBack) {
  const GradientFeatures view = features_of(6);
  const auto bytes = pack(view, patch_shape, patch_band);
  EXPECT_EQ(bytes.size(), view.corners.size() * GradientFeatures::packed_bytes);
  EXPECT_EQ(pack(unpack_gradient_features(bytes, patch_shape, patch_band), patch_shape, patch_band),
            bytes);
  EXPECT_EQ(unpack_gradient_features(bytes, patch_shape, patch_band).leading, view.leading);
  auto disordered = bytes;
  disordered[disordered.size() - GradientFeatures::packed_bytes + 3] |=
      0x80U;  // the last one leads
  EXPECT_THROW((void)unpack_gradient_features(disordered, patch_shape, patch_band), ContractError);
  const std::vector<std::uint8_t> local(72, 7);
  const auto joined = join_feature_bytes({local, bytes});
  const FeatureBytes parts = split_feature_bytes(joined);
  EXPECT_TRUE(std::ranges::equal(parts.local, local));
  EXPECT_TRUE(std::ranges::equal(parts.gradient, bytes));
  EXPECT_EQ(join_feature_bytes({local, {}}), local);
  EXPECT_TRUE(split_feature_bytes(local).gradient.empty());
  EXPECT_TRUE(split_feature_bytes(std::span(joined).last(20)).gradient.empty());  // cut short
  EXPECT_THROW((void)unpack_gradient_features(std::span(bytes).first(67), patch_shape, patch_band),
               ContractError);
  EXPECT_THROW((void)unpack_gradient_features(bytes, {80, 8}, patch_band), ContractError);
  EXPECT_THROW((void)unpack_gradient_features(bytes, {4, 360}, patch_band), ContractError);
}

}  // namespace
}  // namespace panonav::testing
