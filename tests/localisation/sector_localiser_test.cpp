#include "panonav/localisation/sector_localiser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "support/patch_views.hpp"

namespace panonav::testing {
namespace {

/// A memory of rooms 10 m apart, each with a view of its own; headings differ.
struct SectorRooms {
  explicit SectorRooms(int count) : memory({1, 2}, 1.0F, patch_band) {
    for (int i = 0; i < count; ++i) {
      views.push_back(
          extract_gradient_features(make_patch_view(static_cast<std::uint64_t>(i))).value());
      const PackedSignature none{.shape = {1, 2}, .magnitudes = {0, 0}, .phases = {0, 0}};
      memory.append(none, {"room " + std::to_string(i), ReferencePose{10.0 * i, 1.0, 0.3 * i}, {}});
    }
  }
  [[nodiscard]] GradientSource source() const {
    return [this](ViewId view) {
      return std::optional(views[view.value - memory.views().front().value]);
    };
  }
  VisualMemory memory;
  std::vector<GradientFeatures> views;
};

SectorQuery look_into_room(std::uint64_t seed, double azimuth_rad, bool has_known_tilt = true) {
  const double width_rad = radians(70.0);
  Camera camera;
  camera.image_size = {400, 300};
  camera.centre = {200.0, 150.0};
  camera.model = PinholeModel{.focal_length_px = focal_length_from_field_of_view(400, width_rad)};
  const Image picture = take_narrow_picture(make_patch_view(seed), azimuth_rad, width_rad);
  const SectorView sector = unwarp_sector(picture.view(), camera, {80, 360}, patch_band).value();
  return {extract_gradient_features(sector), 0.0, shown_width(std::span(&sector, 1)),
          has_known_tilt};
}

TEST(SectorLocaliser, FindsTheRoomAndTheHeading) {
  const SectorRooms rooms(10);
  const SectorLocaliser localiser(rooms.memory, rooms.source());
  for (const bool has_known_tilt : {true, false}) {
    for (int i = 0; i < 10; i += 3) {
      const double azimuth_rad = 0.7 * i - 2.0;
      const Place place = localiser.localise(
          look_into_room(static_cast<std::uint64_t>(i), azimuth_rad, has_known_tilt), 3);
      ASSERT_EQ(place.matches.size(), 3U);
      EXPECT_EQ(place.matches.front().name, "room " + std::to_string(i));
      EXPECT_TRUE(place.known);
      EXPECT_GT(place.probability, 0.9);
      ASSERT_TRUE(place.position);
      EXPECT_NEAR(place.position->x_m, 10.0 * i, 0.05);  // rooms beside it count a little
      EXPECT_NEAR(angle_difference(*place.heading_rad, 0.3 * i + azimuth_rad), 0.0, radians(1.5));
    }
  }
}

TEST(SectorLocaliser, AnotherRoomIsUnknown) {
  const SectorRooms rooms(10);
  const SectorLocaliser localiser(rooms.memory, rooms.source());
  for (std::uint64_t seed = 20; seed < 24; ++seed) {
    const Place place = localiser.localise(look_into_room(seed, 0.5), 3);
    EXPECT_FALSE(place.known) << place.known_probability;
    EXPECT_FALSE(place.position);
  }
  // The own room, left out, is another room, too.
  const ViewId own = rooms.memory.views()[3];
  EXPECT_FALSE(localiser.localise(look_into_room(3, 0.5), 3, std::span(&own, 1)).known);
}

TEST(SectorLocaliser, TheFirstMatchesAreThoseOfAnExhaustiveSearch) {
  const SectorRooms rooms(12);
  const SectorLocaliser localiser(rooms.memory, rooms.source());
  const SectorQuery query = look_into_room(7, 1.1);
  const Place all = localiser.localise(query, 12);
  NearestFeatures nearest(query.features);
  for (const GradientFeatures& view : rooms.views) nearest.add(view);
  const auto pairs = nearest.weigh_pairs();
  std::vector<std::pair<double, std::string>> expected;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    expected.emplace_back(-verify_sector(query.features, rooms.views[i], pairs[i]).score,
                          "room " + std::to_string(i));
  }
  std::ranges::stable_sort(expected, {}, [](const auto& e) { return e.first; });
  ASSERT_EQ(all.matches.size(), expected.size());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(all.matches[i].name, expected[i].second);
}

TEST(SectorLocaliser, NeedsFeatures) {
  const SectorRooms rooms(2);
  EXPECT_THROW(SectorLocaliser(rooms.memory, [](ViewId) { return std::nullopt; }), ContractError);
  // A memory of two views has too few to learn from, but answers.
  const SectorLocaliser localiser(rooms.memory, rooms.source());
  EXPECT_FALSE(localiser.model().learnt);
  EXPECT_EQ(localiser.localise(look_into_room(1, 0.2), 1).matches.front().name, "room 1");
}

}  // namespace
}  // namespace panonav::testing
