// Real views: 196 one-bit panoramas of 90 x 7 on a 10 cm grid, robot always facing the same way.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

constexpr int components = 15;

struct View {
  Point2 position;
  Panorama panorama;
  FourierSignature signature;
};

class Gantry : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto folder = real_data("gantry_plants");
    PANONAV_REQUIRE_DATA(folder, "gantry_plants");
    std::ifstream poses(*folder / "poses.csv");
    std::string line;
    std::getline(poses, line);
    ASSERT_EQ(line, "file,x_m,y_m,heading_deg");
    while (std::getline(poses, line)) {
      std::istringstream fields(line);
      std::string file, x, y;
      std::getline(fields, file, ',');
      std::getline(fields, x, ',');
      std::getline(fields, y, ',');
      const Image image = read_image(*folder / file);
      Panorama panorama = panorama_from_picture(
          image.view(), {.direction = ColumnDirection::clockwise, .forward_column = 0.5});
      FourierSignature signature = compute_signature(panorama, components);
      views_.push_back({{std::stod(x), std::stod(y)}, std::move(panorama), std::move(signature)});
    }
    ASSERT_EQ(views_.size(), 196U);
  }

  struct Nearest {
    int within_15_cm = 0;
    double worst_m = 0.0;
  };

  /// Finds for each view the least dissimilar one of all others.
  template <class Dissimilarity>
  [[nodiscard]] Nearest find_nearest(Dissimilarity dissimilarity) const {
    Nearest result;
    for (std::size_t query = 0; query < views_.size(); ++query) {
      double min_dissimilarity = std::numeric_limits<double>::infinity();
      std::size_t best = query;
      for (std::size_t other = 0; other < views_.size(); ++other) {
        if (other == query) continue;
        const double value = dissimilarity(query, other);
        if (value < min_dissimilarity) {
          min_dissimilarity = value;
          best = other;
        }
      }
      // Positions are multiples of 10 cm: 1e-6 is for their rounding.
      const double error_m = distance(views_[query].position, views_[best].position);
      EXPECT_GT(error_m, 0.05);
      result.within_15_cm += error_m <= 0.15 + 1e-6;
      result.worst_m = std::max(result.worst_m, error_m);
    }
    return result;
  }

  static void expect_good(const Nearest& nearest) {
    EXPECT_GE(nearest.within_15_cm, 192) << "of 196";
    EXPECT_LE(nearest.worst_m, 0.20 + 1e-6);
  }

  std::vector<View> views_;
};

TEST_F(Gantry, NearestViewIsANeighbour) {
  expect_good(find_nearest([&](std::size_t a, std::size_t b) {
    return dissimilarity_l1(views_[a].signature, views_[b].signature);
  }));
}

TEST_F(Gantry, NearestPackedViewIsANeighbourHoweverTheRobotTurned) {
  float full_scale = 0.0F;
  for (const View& view : views_)
    full_scale = std::max(full_scale, std::ranges::max(view.signature.magnitudes()));
  std::vector<PackedSignature> references;
  for (const View& view : views_) references.push_back(pack(view.signature, full_scale));
  expect_good(find_nearest([&](std::size_t a, std::size_t b) {
    return static_cast<double>(dissimilarity_packed(references[a], references[b]));
  }));

  Random random(1);
  std::vector<PackedSignature> packed_queries;
  std::vector<FourierSignature> queries;
  for (const View& view : views_) {
    const int columns_turned = 1 + static_cast<int>(random.index(89));
    queries.push_back(compute_signature(rotate_columns(view.panorama, columns_turned), components));
    packed_queries.push_back(pack(queries.back(), full_scale));
  }
  expect_good(find_nearest([&](std::size_t a, std::size_t b) {
    return dissimilarity_l1(queries[a], views_[b].signature);
  }));
  expect_good(find_nearest([&](std::size_t a, std::size_t b) {
    return static_cast<double>(dissimilarity_packed(packed_queries[a], references[b]));
  }));
}

TEST_F(Gantry, PreprocessingKeepsWhatMatters) {
  const PreprocessingOptions options{.remove_mean = true, .normalise_gain = true};
  for (View& view : views_)
    view.signature = compute_signature(preprocess(view.panorama, options), components);
  expect_good(find_nearest([&](std::size_t a, std::size_t b) {
    return dissimilarity_l1(views_[a].signature, views_[b].signature);
  }));
}

TEST_F(Gantry, CompassBetweenNeighboursIsRightToAFractionOfAColumn) {
  // Columns are 4 degrees wide. The robot always faced the same way, so every reading is an error.
  for (const bool packed : {false, true}) {
    std::vector<double> errors_deg;
    for (const View& a : views_) {
      for (const View& b : views_) {
        if (&a == &b || distance(a.position, b.position) > 0.10 + 1e-6) continue;
        const auto reading = packed ? compass(pack(a.signature, 2.0F), pack(b.signature, 2.0F))
                                    : compass(a.signature, b.signature);
        ASSERT_TRUE(reading);
        errors_deg.push_back(std::abs(degrees(reading->heading_rad)));
      }
    }
    ASSERT_GT(errors_deg.size(), 600U);
    const double median_deg = median(errors_deg);
    const double max_deg = quantile(errors_deg, 0.95);
    EXPECT_LE(median_deg, 1.7) << (packed ? "packed" : "float");
    EXPECT_LE(max_deg, 5.0) << (packed ? "packed" : "float");
    RecordProperty(packed ? "packed_median_deg" : "median_deg", std::to_string(median_deg));
    RecordProperty(packed ? "packed_95_percent_deg" : "95_percent_deg", std::to_string(max_deg));
  }
}

TEST_F(Gantry, CompassReadsTheTurnOfTheRobot) {
  Random random(2);
  std::vector<double> errors_deg;
  for (const View& a : views_) {
    const int columns_turned = 1 + static_cast<int>(random.index(89));
    const FourierSignature query =
        compute_signature(rotate_columns(a.panorama, columns_turned), components);
    const double turned_rad = 2.0 * std::numbers::pi * columns_turned / 90;
    for (const View& b : views_) {
      if (&a == &b || distance(a.position, b.position) > 0.10 + 1e-6) continue;
      const auto reading = compass(query, b.signature);
      ASSERT_TRUE(reading);
      errors_deg.push_back(std::abs(degrees(angle_difference(reading->heading_rad, turned_rad))));
    }
  }
  ASSERT_GT(errors_deg.size(), 600U);
  EXPECT_LE(median(errors_deg), 1.7);
  EXPECT_LE(quantile(errors_deg, 0.95), 5.0);
}

}  // namespace
}  // namespace panonav::testing
