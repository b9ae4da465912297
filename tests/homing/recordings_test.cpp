// Home vectors on real recordings.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "support/recordings.hpp"

namespace panonav::testing {
namespace {

std::vector<HomingView> views_of(const Recording& recording, int components) {
  std::vector<HomingView> views;
  for (const Panorama& panorama : recording.views) {
    views.push_back(homing_view(compute_signature(preprocess(panorama, {}), components)));
  }
  return views;
}

// The camera looks along the direction of travel, so the view 20 pictures later lies ahead.
TEST(HomingOnRecordings, SussexRouteLeadsAlongTheWay) {
  const auto recording = sussex_route();
  PANONAV_REQUIRE_DATA(recording, "sussex_route");
  const auto views = views_of(*recording, 15);
  ASSERT_EQ(views.size(), 455U);
  std::vector<double> directions;
  for (std::size_t i = 0; i + 20 < views.size(); ++i) {
    directions.push_back(home_vector(views[i + 20], views[i]).direction_rad());
  }
  const auto mean = circular_mean(directions);
  ASSERT_TRUE(mean.has_value());
  EXPECT_NEAR(mean->direction_rad, 0.0, radians(10.0));
  EXPECT_GE(mean->resultant_length, 0.95);
}

// All pairs of the 10 cm grid up to 30 cm, whose headings differ by any number of columns.
TEST(HomingOnRecordings, GantryViewsPointHome) {
  const auto recording = gantry_plants();
  PANONAV_REQUIRE_DATA(recording, "gantry_plants");
  constexpr int columns = 90;
  const auto views = views_of(*recording, 15);
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Random random(seed);
    double sum = 0.0;
    int pairs = 0;
    for (std::size_t h = 0; h < views.size(); ++h) {
      for (std::size_t c = 0; c < views.size(); ++c) {
        const Point2 home = recording->poses[h]->position();
        const Point2 here = recording->poses[c]->position();
        if (h == c || distance(home, here) > 0.301) continue;
        const double turned_rad =
            2.0 * std::numbers::pi * static_cast<double>(random.index(columns)) / columns;
        const HomeVector found = home_vector(views[h], rotate(views[c], turned_rad));
        const double truth = std::atan2(home.y_m - here.y_m, home.x_m - here.x_m);
        sum += std::cos(found.direction_rad() + turned_rad - truth);
        ++pairs;
      }
    }
    ASSERT_GT(pairs, 3000);
    EXPECT_GE(sum / pairs, 0.77);
  }
}

}  // namespace
}  // namespace panonav::testing
