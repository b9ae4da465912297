#include "panonav/relative_pose/relative_tilt.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {
namespace {

constexpr ElevationBand band{radians(-30.0), radians(40.0)};

// A world of blobs on the sphere, seen by a robot of this heading and tilt.
class Blobs {
 public:
  explicit Blobs(std::uint64_t seed) {
    Random random(seed);
    for (int i = 0; i < 60; ++i) {
      blobs_.push_back({random.uniform(-std::numbers::pi, std::numbers::pi),
                        random.uniform(radians(-50.0), radians(60.0)), random.uniform(-0.5, 0.5),
                        random.uniform(radians(6.0), radians(25.0))});
    }
  }
  [[nodiscard]] HomingView seen(double heading_rad, const Tilt& tilt) const {
    const auto [sr, cr] = std::pair(std::sin(tilt.roll_rad), std::cos(tilt.roll_rad));
    const auto [sp, cp] = std::pair(std::sin(tilt.pitch_rad), std::cos(tilt.pitch_rad));
    Panorama view(40, 256, band);
    for (int y = 0; y < 40; ++y) {
      for (int c = 0; c < 256; ++c) {
        const double e = view.elevation_rad(y);
        const double a = view.azimuth_rad(c);
        const double x = std::cos(e) * std::cos(a);
        const double y1 = cr * std::cos(e) * std::sin(a) - sr * std::sin(e);
        const double z1 = sr * std::cos(e) * std::sin(a) + cr * std::sin(e);
        view.at(y, c) = static_cast<float>(
            at(std::atan2(y1, cp * x + sp * z1) + heading_rad, std::asin(cp * z1 - sp * x)));
      }
    }
    return homing_view(compute_signature(view, 20));
  }

 private:
  struct Blob {
    double azimuth_rad, elevation_rad, height, size_rad;
  };
  [[nodiscard]] double at(double azimuth_rad, double elevation_rad) const {
    double sum = 0.5;
    for (const Blob& blob : blobs_) {
      const double cosine = std::sin(elevation_rad) * std::sin(blob.elevation_rad) +
                            std::cos(elevation_rad) * std::cos(blob.elevation_rad) *
                                std::cos(azimuth_rad - blob.azimuth_rad);
      sum += blob.height * std::exp((cosine - 1.0) / (blob.size_rad * blob.size_rad));
    }
    return sum;
  }
  std::vector<Blob> blobs_;
};

TEST(RelativeTilt, IsFoundWhateverTheHeading) {
  Random random(9);
  double largest_error = 0.0;
  for (std::uint64_t i = 0; i < 12; ++i) {
    const Blobs blobs(i);
    const Tilt tilt{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1)};
    const double heading = random.uniform(-std::numbers::pi, std::numbers::pi);
    const HomingView home = blobs.seen(0.0, {});
    const HomingView current = blobs.seen(heading, tilt);
    // The heading of home against the current view, off by some degrees.
    const Tilt found = relative_tilt(home, current, -heading + radians(4.0));
    largest_error = std::max({largest_error, std::abs(found.roll_rad - tilt.roll_rad),
                              std::abs(found.pitch_rad - tilt.pitch_rad)});
    // The remaining difference.
    const HomingView level = rotate(level_view(current, found), -heading);
    double before = 0.0;
    double after = 0.0;
    const HomingView same = rotate(current, -heading);
    for (int k = 1; k < 10; ++k) {
      for (int y = 4; y < 36; ++y) {
        before += std::abs(same.a(y, k) - home.a(y, k)) + std::abs(same.b(y, k) - home.b(y, k));
        after += std::abs(level.a(y, k) - home.a(y, k)) + std::abs(level.b(y, k) - home.b(y, k));
      }
    }
    EXPECT_LT(after, 0.35 * before) << i;
  }
  EXPECT_LT(degrees(largest_error), 0.6);
}

TEST(RelativeTilt, ViewsAlikeAreNotTilted) {
  const Blobs blobs(3);
  const HomingView view = blobs.seen(0.0, {0.05, 0.0});
  const Tilt tilt = relative_tilt(view, view, 0.0);
  EXPECT_NEAR(tilt.roll_rad, 0.0, 1e-6);
  EXPECT_NEAR(tilt.pitch_rad, 0.0, 1e-6);
}

TEST(RelativeTilt, NothingIsKnownWithoutElevations) {
  const Blobs blobs(3);
  const HomingView seen = blobs.seen(0.0, {0.05, 0.0});
  const auto flat = [](const HomingView& view) {
    std::vector<float> a;
    std::vector<float> b;
    for (int k = 0; k < view.components(); ++k) {
      a.insert(a.end(), view.cosines(k).begin(), view.cosines(k).end());
      b.insert(b.end(), view.sines(k).begin(), view.sines(k).end());
    }
    return HomingView(view.rows(), view.components(), a, b);
  };
  EXPECT_EQ(relative_tilt(flat(blobs.seen(0.0, {})), flat(seen), 0.0), Tilt{});
}

}  // namespace
}  // namespace panonav
