#include "panonav/panorama/preprocessing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

Panorama random_panorama(Random& random, int rows, int columns) {
  Panorama panorama(rows, columns, std::nullopt);
  for (float& value : panorama.values()) value = static_cast<float>(random.uniform());
  return panorama;
}

double largest_difference(const Panorama& a, const Panorama& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.values().size(); ++i) {
    largest = std::max(largest, std::abs(static_cast<double>(a.values()[i]) - b.values()[i]));
  }
  return largest;
}

TEST(Preprocess, EveryCombinationIsIndifferentToATurn) {
  Random random(1);
  int combinations = 0;
  for (int bits = 0; bits < 16; ++bits) {
    const PreprocessingOptions options{.masked_rows_top = (bits & 1) != 0 ? 2 : 0,
                                       .masked_rows_bottom = (bits & 1) != 0 ? 1 : 0,
                                       .edge_channel = (bits & 2) != 0,
                                       .remove_mean = (bits & 4) != 0,
                                       .normalise_gain = (bits & 8) != 0};
    const Panorama view = random_panorama(random, 9, 50);
    const Panorama plain = preprocess(view, options);
    EXPECT_EQ(plain == view, bits == 0);
    for (const int turned : {1, 17, 49}) {
      EXPECT_LT(largest_difference(preprocess(rotate_columns(view, turned), options),
                                   rotate_columns(plain, turned)),
                1e-6);
      EXPECT_GT(largest_difference(preprocess(rotate_columns(view, turned), options), plain),
                0.01);  // guard
    }
    ++combinations;
  }
  EXPECT_EQ(combinations, 16);
}

TEST(Preprocess, MeanAndGainAreOnByDefault) {
  const PreprocessingOptions options;
  EXPECT_TRUE(options.remove_mean && options.normalise_gain);
  EXPECT_TRUE(!options.edge_channel && options.masked_rows_top == 0 &&
              options.masked_rows_bottom == 0);
}

TEST(Preprocess, GainAndMeanCancelLight) {
  Random random(2);
  const Panorama view = random_panorama(random, 8, 40);
  Panorama brighter = view;
  for (float& value : brighter.values()) value = 0.6F * value;
  const PreprocessingOptions gain{.remove_mean = false, .normalise_gain = true};
  EXPECT_LT(largest_difference(preprocess(view, gain), preprocess(brighter, gain)), 1e-6);
  for (float& value : brighter.values()) value += 0.3F;
  EXPECT_GT(largest_difference(preprocess(view, gain), preprocess(brighter, gain)), 0.01);
  const PreprocessingOptions both{.remove_mean = true, .normalise_gain = true};
  EXPECT_LT(largest_difference(preprocess(view, both), preprocess(brighter, both)), 1e-6);
}

TEST(Preprocess, ReachesTheMomentsItPromises) {
  Random random(3);
  const Panorama view = random_panorama(random, 8, 40);
  const Panorama result = preprocess(
      view,
      {.masked_rows_top = 1, .masked_rows_bottom = 2, .remove_mean = true, .normalise_gain = true});
  double sum = 0.0;
  double squares = 0.0;
  for (int y = 0; y < 8; ++y) {
    for (const float value : result.row(y)) {
      if (y < 1 || y >= 6) {
        EXPECT_EQ(value, 0.0F);
      }
      sum += value;
      squares += static_cast<double>(value) * value;
    }
  }
  EXPECT_NEAR(sum / 200, 0.0, 1e-6);
  EXPECT_NEAR(std::sqrt(squares / 200), 0.25, 1e-6);
}

TEST(Preprocess, LeavesAViewOfOneColourAlone) {
  const Panorama flat(3, 8, std::nullopt, std::vector<float>(24, 0.4F));
  EXPECT_EQ(preprocess(flat, {.remove_mean = false, .normalise_gain = true}), flat);
}

TEST(Preprocess, EdgesAreTheLengthOfTheGradient) {
  // A ramp down the rows and a step across the columns.
  Panorama view(5, 8, std::nullopt);
  for (int y = 0; y < 5; ++y) {
    for (int c = 0; c < 8; ++c)
      view.at(y, c) = 0.1F * static_cast<float>(y) + (c < 4 ? 0.0F : 0.3F);
  }
  const Panorama edges =
      preprocess(view, {.edge_channel = true, .remove_mean = false, .normalise_gain = false});
  for (int y = 1; y < 4; ++y) {
    EXPECT_NEAR(edges.at(y, 1), 0.1F, 1e-6);
    EXPECT_NEAR(edges.at(y, 3), std::hypot(0.1F, 0.15F), 1e-6);
    EXPECT_NEAR(edges.at(y, 4), std::hypot(0.1F, 0.15F), 1e-6);
    EXPECT_NEAR(edges.at(y, 0), std::hypot(0.1F, 0.15F), 1e-6);  // across the seam
  }
  EXPECT_NEAR(edges.at(0, 1), 0.05F, 1e-6);  // one-sided at the upper edge
}

TEST(Preprocess, OptionsNameTheirFaults) {
  Random random(4);
  const Panorama view = random_panorama(random, 4, 8);
  EXPECT_THROW(static_cast<void>(preprocess(view, {.masked_rows_top = -1})), OptionError);
  EXPECT_THROW(static_cast<void>(preprocess(view, {.masked_rows_top = 2, .masked_rows_bottom = 2})),
               ContractError);
  EXPECT_NO_THROW(
      static_cast<void>(preprocess(view, {.masked_rows_top = 2, .masked_rows_bottom = 1})));
}

}  // namespace
}  // namespace panonav
