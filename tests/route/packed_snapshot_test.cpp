// Packed snapshots: laws of packing, refused bytes, and what packing costs on real recordings.

#include "panonav/route/packed_snapshot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "support/random_views.hpp"
#include "support/recordings.hpp"

namespace panonav::testing {
namespace {

// Amplitudes that fall with the frequency, as those of pictures do.
HomingView random_view(Random& random, const SnapshotShape& shape) {
  std::vector<float> a;
  std::vector<float> b;
  for (int k = 0; k < shape.components; ++k) {
    for (int y = 0; y < shape.rows; ++y) {
      a.push_back(static_cast<float>(random.normal() / (1.0 + k)));
      b.push_back(k == 0 ? 0.0F : static_cast<float>(random.normal() / (1.0 + k)));
    }
  }
  return {shape.rows, shape.components, std::move(a), std::move(b),
          ElevationBand{radians(-30.0), radians(40.0)}};
}

HomingView pack_and_unpack(const HomingView& view, const SnapshotShape& shape = {}) {
  return unpack_snapshot(pack_snapshot(view, shape), shape, view.elevations());
}

// Expects each coefficient within half a step, or saturated at the outermost step.
void expect_within_half_a_step(float unpacked, float value, float step, int bits) {
  const auto outermost = static_cast<float>(std::exp2(bits - 1) - 0.5) * step;
  const float nearest = std::clamp(value, -outermost, outermost);
  EXPECT_NEAR(unpacked, nearest, 0.5F * step * 1.001F);
}

TEST(PackedSnapshot, UnpacksWithinHalfAStepUnlessSaturated) {
  for (const int bits : {3, 4, 5, 8}) {
    const SnapshotShape shape{.rows = 5, .components = 7, .bits = bits};
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      SCOPED_TRACE("bits " + std::to_string(bits) + ", seed " + std::to_string(seed));
      Random random(seed);
      const HomingView view = random_view(random, shape);
      const auto bytes = pack_snapshot(view, shape);
      ASSERT_EQ(bytes.size(), shape.bytes());
      const auto steps = snapshot_steps(bytes, shape);
      const HomingView unpacked = unpack_snapshot(bytes, shape, view.elevations());
      EXPECT_EQ(unpacked.elevations(), view.elevations());
      for (int k = 0; k < shape.components; ++k) {
        const float step = steps[static_cast<std::size_t>(k)];
        EXPECT_GT(step, 0.0F);
        for (int y = 0; y < shape.rows; ++y) {
          expect_within_half_a_step(unpacked.a(y, k), view.a(y, k), step, bits);
          if (k > 0) expect_within_half_a_step(unpacked.b(y, k), view.b(y, k), step, bits);
        }
      }
    }
  }
}

TEST(PackedSnapshot, TakesFortyEightBytesByDefault) {
  EXPECT_EQ(SnapshotShape{}.bytes(), 48U);
  EXPECT_EQ((SnapshotShape{.rows = 1, .components = 8, .bits = 8}.bytes()), 5U + 15U);
}

// A rotation changes the phase of component k by k times the rotation, as of any view.
TEST(PackedSnapshot, RotatesAsTheViewDoes) {
  const SnapshotShape shape;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const HomingView view = random_view(random, shape);
    const double turn_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
    const HomingView turned = pack_and_unpack(rotate(view, turn_rad));
    const HomeVector vector = home_vector(pack_and_unpack(view), turned);
    EXPECT_NEAR(wrap_angle(vector.heading_rad + turn_rad), 0.0, radians(1.5));
    EXPECT_LT(image_difference(view, turned), 0.02);
  }
}

TEST(PackedSnapshot, OfAViewWithoutStructureIsZero) {
  const SnapshotShape shape;
  const std::vector<float> none(48);
  const HomingView view(8, 6, none, none);
  EXPECT_EQ(pack_snapshot(view, shape), std::vector<std::uint8_t>(48));
  EXPECT_EQ(pack_and_unpack(view), view);
}

TEST(PackedSnapshot, RefusesBytesThatAreNotWritten) {
  const SnapshotShape shape{.rows = 3, .components = 3, .bits = 3};  // 45 of 48 bits are used
  Random random(1);
  const auto bytes = pack_snapshot(random_view(random, shape), shape);
  EXPECT_NO_THROW((void)unpack_snapshot(bytes, shape, {}));
  const auto expect_refused = [&](std::vector<std::uint8_t> changed) {
    EXPECT_THROW((void)unpack_snapshot(changed, shape, {}), ContractError);
  };
  expect_refused({bytes.begin(), bytes.end() - 1});
  auto changed = bytes;
  changed.back() |= 0x80;  // an unused bit after the codes
  expect_refused(changed);
  changed = bytes;
  changed[2] |= 0xF0;  // the ratio of a fourth component
  expect_refused(changed);
  changed = bytes;
  changed[1] = 0x11, changed[2] = 0x01;  // no component has the largest deviation
  expect_refused(changed);
  changed = bytes;
  changed[0] = 0;  // codes without a scale
  expect_refused(changed);
  EXPECT_THROW((void)unpack_snapshot(bytes, {.bits = 9}, {}), OptionError);
  EXPECT_THROW((void)pack_snapshot(random_view(random, {}), shape), ContractError);
}

// Reducing is linear, so that it may be done before or after the transform.
TEST(ReducedView, HasTheRowsOfTheResampledPanorama) {
  Random random(3);
  const Panorama fine = random_panorama(random, 12, 64);
  Panorama coarse(4, 64, std::nullopt);
  for (int y = 0; y < 12; ++y) {
    for (int c = 0; c < 64; ++c) coarse.at(y / 3, c) += fine.at(y, c) / 3.0F;
  }
  const HomingView reduced = reduce_view(homing_view(compute_signature(fine, 15)), 4, 6);
  const HomingView expected = homing_view(compute_signature(coarse, 6));
  ASSERT_EQ(reduced.rows(), 4);
  ASSERT_EQ(reduced.components(), 6);
  for (int k = 0; k < 6; ++k) {
    for (int y = 0; y < 4; ++y) {
      EXPECT_NEAR(reduced.a(y, k), expected.a(y, k), 1e-5);
      EXPECT_NEAR(reduced.b(y, k), expected.b(y, k), 1e-5);
    }
  }
  // Rows that do not divide: the mean over all rows stays.
  const HomingView five = reduce_view(homing_view(compute_signature(fine, 15)), 5, 6);
  const HomingView one = reduce_view(homing_view(compute_signature(fine, 15)), 1, 6);
  for (int k = 0; k < 6; ++k) {
    float sum = 0.0F;
    for (const float a : five.cosines(k)) sum += a / 5.0F;
    EXPECT_NEAR(sum, one.a(0, k), 1e-5);
  }
  EXPECT_THROW((void)reduce_view(one, 2, 6), ContractError);
  EXPECT_THROW((void)reduce_view(one, 1, 7), ContractError);
}

struct HomewardLoss {
  double unpacked = 0.0;  // mean homeward component of snapshots as floats
  double packed = 0.0;
  int pairs = 0;
};

HomewardLoss measure_loss(const Recording& recording, double max_distance_m) {
  const SnapshotShape shape;
  HomewardLoss loss;
  std::vector<HomingView> views;
  for (const Panorama& panorama : recording.views) {
    views.push_back(homing_view(compute_signature(preprocess(panorama, {}), shape.components)));
  }
  for (std::size_t h = 0; h < views.size(); ++h) {
    const HomingView snapshot = pack_and_unpack(views[h], shape);
    for (std::size_t c = 0; c < views.size(); ++c) {
      const auto& home = *recording.poses[h];
      const auto& here = *recording.poses[c];
      if (h == c || distance(home.position(), here.position()) > max_distance_m) continue;
      const double true_rad =
          std::atan2(home.y_m - here.y_m, home.x_m - here.x_m) - here.heading_rad.value();
      loss.unpacked += std::cos(home_vector(views[h], views[c]).direction_rad() - true_rad);
      loss.packed += std::cos(home_vector(snapshot, views[c]).direction_rad() - true_rad);
      ++loss.pairs;
    }
  }
  loss.unpacked /= loss.pairs;
  loss.packed /= loss.pairs;
  return loss;
}

void expect_small_loss(const Recording& recording, double max_distance_m, int min_pairs,
                       double min_unpacked) {
  const HomewardLoss loss = measure_loss(recording, max_distance_m);
  ::testing::Test::RecordProperty("unpacked", std::to_string(loss.unpacked));
  ::testing::Test::RecordProperty("packed", std::to_string(loss.packed));
  ASSERT_GT(loss.pairs, min_pairs);
  EXPECT_GT(loss.unpacked, min_unpacked);
  EXPECT_GT(loss.packed, loss.unpacked - 0.02);
}

TEST(PackedSnapshot, OfPlantsLosesAtMostAFiftiethOfTheHomewardComponent) {
  const auto recording = gantry_plants({.rows = 8, .columns = 90});
  PANONAV_REQUIRE_DATA(recording, "gantry_plants");
  expect_small_loss(*recording, 0.501, 5000, 0.65);
}

TEST(PackedSnapshot, OfRoomsLosesAtMostAFiftiethOfTheHomewardComponent) {
  const auto recording = sparse_rooms({.rows = 8, .columns = 512});
  PANONAV_REQUIRE_DATA(recording, "ciirc_b670");
  expect_small_loss(*recording, 3.0, 100, 0.7);
}

}  // namespace
}  // namespace panonav::testing
