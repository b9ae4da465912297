#include "panonav/panorama/hidden_values.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "support/test_cameras.hpp"

namespace panonav::testing {
namespace {

using Hidden = std::vector<std::uint8_t>;

// A view whose rows have power 1 / f^2, as natural pictures do.
Panorama natural_view(Random& random, int rows, int columns) {
  Panorama view(rows, columns, std::nullopt);
  for (int y = 0; y < rows; ++y) {
    for (int k = 1; k <= columns / 4; ++k) {
      const double a = random.normal(0.0, 0.15 / k);
      const double b = random.normal(0.0, 0.15 / k);
      for (int c = 0; c < columns; ++c) {
        const double angle = 2.0 * std::numbers::pi * k * c / columns;
        view.at(y, c) += static_cast<float>(a * std::cos(angle) + b * std::sin(angle));
      }
    }
    for (int c = 0; c < columns; ++c) view.at(y, c) += 0.5F;
  }
  return view;
}

// The same columns in every row.
Hidden sector(int rows, int columns, int first, int count) {
  Hidden hidden(static_cast<std::size_t>(rows) * columns);
  for (int y = 0; y < rows; ++y) {
    for (int i = 0; i < count; ++i) {
      hidden[static_cast<std::size_t>(y) * columns + (first + i) % columns] = 1;
    }
  }
  return hidden;
}

TEST(FillHiddenValues, DrawsTheStraightLineRoundTheCylinder) {
  // The gap of the first row runs over the seam, the second has two gaps, the third shows one
  // value, the fourth nothing.
  Panorama view(4, 6, std::nullopt, {9.0F, 9.0F, 4.0F, 5.0F, 1.0F, 9.0F,  //
                                     2.0F, 9.0F, 4.0F, 9.0F, 9.0F, 1.0F,  //
                                     9.0F, 9.0F, 7.0F, 9.0F, 9.0F, 9.0F,  //
                                     9.0F, 9.0F, 9.0F, 9.0F, 9.0F, 9.0F});
  const Hidden hidden{1, 1, 0, 0, 0, 1,  //
                      0, 1, 0, 1, 1, 0,  //
                      1, 1, 0, 1, 1, 1,  //
                      1, 1, 1, 1, 1, 1};
  fill_hidden_values(view, hidden);
  const float mean = (4.0F + 5.0F + 1.0F + 2.0F + 4.0F + 1.0F + 7.0F) / 7.0F;
  const std::vector<float> expected{2.5F, 3.25F, 4.0F, 5.0F, 1.0F, 1.75F,  //
                                    2.0F, 3.0F,  4.0F, 3.0F, 2.0F, 1.0F,   //
                                    7.0F, 7.0F,  7.0F, 7.0F, 7.0F, 7.0F,   //
                                    mean, mean,  mean, mean, mean, mean};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(view.values()[i], expected[i], 1e-5) << "value " << i;
  }
}

TEST(FillHiddenValues, NothingHiddenChangesNothingAndATurnOfBothIsATurnOfTheResult) {
  Random random(1);
  const Panorama view = natural_view(random, 5, 40);
  Panorama same = view;
  fill_hidden_values(same, Hidden(200, 0));
  EXPECT_EQ(same, view);
  Panorama filled = view;
  fill_hidden_values(filled, sector(5, 40, 30, 15));
  EXPECT_NE(filled, view);
  Panorama turned = rotate_columns(view, 13);
  fill_hidden_values(turned, sector(5, 40, 17, 15));
  EXPECT_EQ(turned, rotate_columns(filled, 13));
}

enum class Rule { line, black, mean_of_row };

void hide(Panorama& seen, const Hidden& hidden, Rule rule) {
  if (rule == Rule::line) {
    fill_hidden_values(seen, hidden);
    return;
  }
  for (int y = 0; y < seen.rows(); ++y) {
    double sum = 0.0;
    int count = 0;
    for (int c = 0; c < seen.columns(); ++c) {
      if (hidden[c] != 0) continue;
      sum += static_cast<double>(seen.at(y, c));
      ++count;
    }
    for (int c = 0; c < seen.columns(); ++c) {
      if (hidden[c] == 0) continue;
      seen.at(y, c) = rule == Rule::black ? 0.0F : static_cast<float>(sum / count);
    }
  }
}

// Effect of a sector that stays with the robot when it turns on the spot: the mean
// dissimilarity of a view and the same view turned (without the mask it would be 0), over that of
// two different views.
double disturbance(const std::vector<Panorama>& views, const Hidden& hidden, Rule rule,
                   const PreprocessingOptions& options) {
  const auto signature = [&](Panorama seen) {
    hide(seen, hidden, rule);
    return compute_signature(preprocess(std::move(seen), options));
  };
  double turned = 0.0;
  int turns = 0;
  double other = 0.0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const FourierSignature before = signature(views[i]);
    for (int turn = 1; turn < views[i].columns(); turn += 3) {
      turned += dissimilarity_l1(before, signature(rotate_columns(views[i], turn)));
      ++turns;
    }
    other += dissimilarity_l1(before, signature(views[(i + 1) % views.size()]));
  }
  return turned / turns / (other / static_cast<double>(views.size()));
}

TEST(FillHiddenValues, AMaskOnATurningRobotDisturbsLessThanBlackPaintOrTheRowsMean) {
  constexpr int rows = 6;
  constexpr int columns = 64;
  Random random(2);
  std::vector<Panorama> views;
  for (int i = 0; i < 30; ++i) views.push_back(natural_view(random, rows, columns));
  for (const PreprocessingOptions& options :
       {PreprocessingOptions{}, PreprocessingOptions{.remove_mean = false, .normalise_gain = false},
        PreprocessingOptions{.edge_channel = true}}) {
    for (const int width : {4, 10, 20}) {
      const Hidden hidden = sector(rows, columns, 25, width);
      const double line = disturbance(views, hidden, Rule::line, options);
      const double mean = disturbance(views, hidden, Rule::mean_of_row, options);
      const double black = disturbance(views, hidden, Rule::black, options);
      EXPECT_GT(line, 0.0);
      EXPECT_LT(line, mean) << width << " columns hidden";
      EXPECT_LT(line, black) << width << " columns hidden";
    }
  }
}

TEST(FindHiddenValues, AreThoseThatLookAtTheMask) {
  const Camera camera = mirror_camera();
  const Unwarper unwarper(camera, {.rows = 20, .columns = 120});
  // The robot is seen between azimuths 1.0 and 1.6.
  Image mask(camera.image_size.width, camera.image_size.height);
  for (int v = 0; v < mask.height(); ++v) {
    for (int u = 0; u < mask.width(); ++u) {
      const auto direction = unproject(camera, {u + 0.5, v + 0.5});
      const bool robot =
          direction && direction->azimuth_rad() > 1.0 && direction->azimuth_rad() < 1.6;
      mask.at(u, v) = robot ? 0 : 7;
    }
  }
  const Hidden hidden = find_hidden_values(mask.view(), unwarper);
  ASSERT_EQ(hidden.size(), 20U * 120U);
  const double column_rad = 2.0 * std::numbers::pi / 120.0;
  int inside = 0;
  for (int y = 1; y < 19; ++y) {
    for (int c = 0; c < 120; ++c) {
      const double azimuth = 2.0 * std::numbers::pi * c / 120.0;
      const bool is_hidden = hidden[static_cast<std::size_t>(y) * 120 + c] != 0;
      if (azimuth > 1.0 && azimuth < 1.6) {
        EXPECT_TRUE(is_hidden) << "row " << y << ", column " << c;
        ++inside;
      } else if (azimuth < 1.0 - 2.0 * column_rad || azimuth > 1.6 + 2.0 * column_rad) {
        EXPECT_FALSE(is_hidden) << "row " << y << ", column " << c;
      }
    }
  }
  EXPECT_GT(inside, 100);
  // Whatever the robot looks like, nothing of it is left.
  Image white = mask;
  for (auto& value : white.pixels()) value = value == 0 ? 0 : 255;
  Panorama view = unwarper.unwrap(white.view());
  fill_hidden_values(view, hidden);
  for (const float value : view.values()) ASSERT_GT(value, 0.995F);
}

TEST(FindHiddenValues, RefusesMasksThatDoNotFitOrHideEverything) {
  const Camera camera = mirror_camera();
  const Unwarper unwarper(camera, {.rows = 8, .columns = 32});
  for (const Image& mask : {Image(10, 10), Image(640, 480), Image(640, 480, 3)}) {
    EXPECT_THROW((void)find_hidden_values(mask.view(), unwarper), ContractError);
  }
  Panorama view(2, 8, std::nullopt);
  EXPECT_THROW(fill_hidden_values(view, Hidden(15, 0)), ContractError);
  EXPECT_THROW(fill_hidden_values(view, Hidden(16, 1)), ContractError);
}

}  // namespace
}  // namespace panonav::testing
