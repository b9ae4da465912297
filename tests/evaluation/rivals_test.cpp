#include "panonav/evaluation/rivals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

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

std::vector<std::unique_ptr<PlaceRecogniser>> all_recognisers() {
  std::vector<std::unique_ptr<PlaceRecogniser>> list;
  list.push_back(fourier_signature_recogniser(15));
  list.push_back(grey_histogram_recogniser(64));
  list.push_back(eigenimage_recogniser(15));
  list.push_back(zero_phase_recogniser());
  list.push_back(pixels_over_all_turns_recogniser());
  return list;
}

TEST(PlaceRecogniser, EveryRivalFindsAMemorisedViewAfterAnyTurn) {
  std::vector<Panorama> references;
  for (std::uint64_t seed = 0; seed < 20; ++seed) references.push_back(random_view(seed));
  for (const auto& recogniser : all_recognisers()) {
    recogniser->memorise(references);
    EXPECT_GT(recogniser->bytes_per_view(), 0.0) << recogniser->name();
    Random random(7);
    for (std::size_t i = 0; i < references.size(); ++i) {
      const int turn = static_cast<int>(random.index(64));
      EXPECT_EQ(recogniser->nearest(turn_columns(references[i], turn)), i) << recogniser->name();
    }
  }
}

TEST(PixelsOverAllTurns, AgreesWithTryingEveryTurn) {
  std::vector<Panorama> references;
  for (std::uint64_t seed = 0; seed < 12; ++seed) references.push_back(random_view(seed));
  const auto recogniser = pixels_over_all_turns_recogniser();
  recogniser->memorise(references);
  for (std::uint64_t seed = 100; seed < 110; ++seed) {
    const Panorama query = random_view(seed);
    std::size_t best = 0;
    double smallest = 1e30;
    for (std::size_t i = 0; i < references.size(); ++i) {
      for (int turn = 0; turn < query.columns(); ++turn) {
        const Panorama turned = turn_columns(references[i], turn);
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
    EXPECT_EQ(recogniser->nearest(query), best) << "seed " << seed;
  }
}

}  // namespace
}  // namespace panonav
