#include "experiments/baselines/rivals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"

namespace panonav {
namespace {

// Smooth random views: harmonics up to 6 with random phases, every row its own.
Panorama random_view(std::uint64_t seed, int rows = 6, int columns = 64) {
  Random random(seed);
  Panorama view(rows, columns, std::nullopt);
  for (int y = 0; y < rows; ++y) {
    for (int c = 0; c < columns; ++c) view.at(y, c) = 0.5F;
    for (int k = 1; k <= 6; ++k) {
      const double amplitude = random.uniform(0.0, 0.2) / k;
      const double phase = random.uniform(-3.0, 3.0);
      for (int c = 0; c < columns; ++c) {
        view.at(y, c) += static_cast<float>(amplitude * std::cos(k * view.azimuth_rad(c) + phase));
      }
    }
  }
  return view;
}

// In colour: the grey view in red, its complement in green, and one blue of 20 all over.
RivalView in_colour(const Panorama& view, std::uint64_t seed) {
  const int blue = static_cast<int>(12 * (seed % 20));
  Image colour(view.columns(), view.rows(), 3);
  for (int y = 0; y < view.rows(); ++y) {
    for (int c = 0; c < view.columns(); ++c) {
      const double value = 255.0 * std::clamp(view.at(y, c), 0.0F, 1.0F);
      colour.at(c, y, 0) = static_cast<std::uint8_t>(value);
      colour.at(c, y, 1) = static_cast<std::uint8_t>(255.0 - value);
      colour.at(c, y, 2) = static_cast<std::uint8_t>(blue);
    }
  }
  return {view, colour};
}

RivalView random_rival_view(std::uint64_t seed) {
  return in_colour(random_view(seed), seed);
}

std::vector<std::unique_ptr<RivalRecogniser>> all_recognisers() {
  std::vector<std::unique_ptr<RivalRecogniser>> list;
  list.push_back(fourier_signature_recogniser(15));
  list.push_back(grey_histogram_recogniser(64));
  list.push_back(colour_histogram_recogniser(32));
  list.push_back(eigenimage_recogniser(15));
  list.push_back(zero_phase_recogniser());
  list.push_back(pixels_over_all_turns_recogniser());
  list.push_back(patch_normalised_recogniser());
  return list;
}

TEST(RivalRecogniser, EveryRivalFindsAMemorisedViewAfterAnyTurn) {
  std::vector<RivalView> references;
  for (std::uint64_t seed = 0; seed < 20; ++seed) references.push_back(random_rival_view(seed));
  for (const auto& recogniser : all_recognisers()) {
    recogniser->memorise(references);
    EXPECT_GT(recogniser->bytes_per_view(), 0.0) << recogniser->name();
    Random random(7);
    for (std::size_t i = 0; i < references.size(); ++i) {
      const int turn = static_cast<int>(random.index(64));
      const RivalView turned = in_colour(turn_columns(references[i].panorama, turn), i);
      EXPECT_EQ(recogniser->nearest(turned), i) << recogniser->name();
    }
  }
}

TEST(PixelsOverAllTurns, AgreesWithTryingEveryTurn) {
  std::vector<RivalView> references;
  for (std::uint64_t seed = 0; seed < 12; ++seed) references.push_back({random_view(seed)});
  const auto recogniser = pixels_over_all_turns_recogniser();
  recogniser->memorise(references);
  for (std::uint64_t seed = 100; seed < 110; ++seed) {
    const Panorama query = random_view(seed);
    std::size_t best = 0;
    double smallest = 1e30;
    for (std::size_t i = 0; i < references.size(); ++i) {
      for (int turn = 0; turn < query.columns(); ++turn) {
        const Panorama turned = turn_columns(references[i].panorama, turn);
        double sum = 0.0;
        for (std::size_t p = 0; p < query.values().size(); ++p) {
          const double d = query.values()[p] - turned.values()[p];
          sum += d * d;
        }
        if (sum < smallest) {
          smallest = sum;
          best = i;
        }
      }
    }
    EXPECT_EQ(recogniser->nearest({query}), best) << "seed " << seed;
  }
}

// Rooms that differ in their colours alone: a grey histogram cannot tell them apart.
TEST(ColourHistogram, TellsColoursApartThatAreOneGrey) {
  const Panorama grey = random_view(3);
  std::vector<RivalView> references;
  for (std::uint64_t seed = 0; seed < 5; ++seed) references.push_back(in_colour(grey, seed));
  const auto recogniser = colour_histogram_recogniser(32);
  recogniser->memorise(references);
  for (std::size_t i = 0; i < references.size(); ++i) {
    EXPECT_EQ(recogniser->nearest(references[i]), i);
  }
}

TEST(ColourHistogram, RefusesViewsWithoutColour) {
  const auto recogniser = colour_histogram_recogniser();
  EXPECT_THROW(recogniser->memorise({{random_view(1)}}), ContractError);
}

}  // namespace
}  // namespace panonav
