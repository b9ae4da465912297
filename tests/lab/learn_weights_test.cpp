#include "lab/m04/learn_weights.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "support/remembered_worlds.hpp"

namespace panonav::lab {
using namespace testing;
namespace {

// A grid of signatures of which only component `telling` depends on the position; the others are
// noise of the same size.
VisualMemory memory_with_one_telling_component(std::size_t telling, std::uint64_t seed) {
  constexpr int rows = 12;
  constexpr int components = 5;
  constexpr int side = 9;
  Random random(seed);
  // One linear field per row: magnitude = base + gradient . position.
  std::vector<Point2> gradients;
  for (int y = 0; y < rows; ++y) gradients.push_back({random.normal(), random.normal()});
  std::vector<FourierSignature> signatures;
  std::vector<std::optional<ReferencePose>> poses;
  for (int i = 0; i < side * side; ++i) {
    const Point2 p{0.5 * (i % side), 0.5 * (i / side)};
    std::vector<float> magnitudes;
    for (std::size_t k = 0; k < components; ++k) {
      for (const Point2& gradient : gradients) {
        const double value =
            k == telling ? gradient.x_m * p.x_m + gradient.y_m * p.y_m : random.uniform(-1.0, 1.0);
        magnitudes.push_back(static_cast<float>(20.0 + value));
      }
    }
    signatures.emplace_back(SignatureShape{rows, components}, magnitudes,
                            std::vector<float>(magnitudes.size()), std::nullopt);
    poses.push_back(ReferencePose{p.x_m, p.y_m, std::nullopt});
  }
  return make_memory(signatures, poses);
}

TEST(ComponentWeights, FindTheComponentThatTellsPositions) {
  for (const std::size_t telling : {std::size_t{0}, std::size_t{3}}) {
    const auto learnt = learn_component_weights(memory_with_one_telling_component(telling, 5));
    ASSERT_TRUE(learnt);
    ASSERT_EQ(learnt->weights.size(), 5U);
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_GE(learnt->weights[k], 0.0);
      if (k != telling) {
        EXPECT_GT(learnt->weights[telling], 5.0 * learnt->weights[k]) << k;
      }
    }
    EXPECT_NEAR(std::accumulate(learnt->weights.begin(), learnt->weights.end(), 0.0), 5.0, 1e-9);
    EXPECT_GT(learnt->margin, 1.2 * learnt->margin_of_equal_weights);
  }
}

// Share of (query, neighbour within a step, view beyond two steps that looks most alike) in which
// the neighbour comes first, and the mean over deviation of the margin, in another room.
double margin_elsewhere(const RememberedRoom& place, std::span<const double> weights) {
  std::vector<FourierSignature> views;
  for (const ViewId view : place.memory.views()) views.push_back(place.memory.signature(view));
  std::vector<double> margins;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<double> to_near;
    std::vector<double> to_far;
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (i == j) continue;
      const double steps = distance(place.grid[i], place.grid[j]) / place.step_m;
      const double value = dissimilarity_weighted(views[i], views[j], weights);
      if (steps < 1.1) to_near.push_back(value);
      if (steps > 1.9) to_far.push_back(value);
    }
    if (to_near.empty() || to_far.empty()) continue;
    const double near =
        std::accumulate(to_near.begin(), to_near.end(), 0.0) / static_cast<double>(to_near.size());
    margins.push_back(*std::ranges::min_element(to_far) / near - 1.0);
  }
  EXPECT_GT(margins.size(), 20U);
  const auto n = static_cast<double>(margins.size());
  const double mean = std::accumulate(margins.begin(), margins.end(), 0.0) / n;
  double square = 0.0;
  for (const double margin : margins) square += (margin - mean) * (margin - mean) / n;
  return mean / std::sqrt(square);
}

TEST(ComponentWeights, LearntInSomeRoomsSeparateBetterInOthers) {
  double equal = 0.0;
  double weighted = 0.0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const RememberedRoom here(300 + seed, {}, 0.4, 0.02);
    const RememberedRoom elsewhere(400 + seed, {}, 0.4, 0.02);
    const auto learnt = learn_component_weights(here.memory);
    ASSERT_TRUE(learnt);
    EXPECT_GE(learnt->margin, learnt->margin_of_equal_weights);
    equal += margin_elsewhere(elsewhere, std::vector<double>(learnt->weights.size(), 1.0));
    weighted += margin_elsewhere(elsewhere, learnt->weights);
  }
  EXPECT_GT(weighted, equal);
}

TEST(ComponentWeights, SameSeedSameBits) {
  const RememberedRoom place(31, {}, 0.4);
  const auto a = learn_component_weights(place.memory, 40, 3);
  const auto b = learn_component_weights(place.memory, 40, 3);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->weights, b->weights);
}

TEST(ComponentWeights, NoAnswerWithoutEnoughPosedViews) {
  VisualMemory memory({4, 3}, 1.0F, std::nullopt);
  EXPECT_FALSE(learn_component_weights(memory));
  Random random(1);
  for (int i = 0; i < 40; ++i) {
    std::vector<float> magnitudes(12);
    for (float& m : magnitudes) m = static_cast<float>(random.uniform());
    const FourierSignature view({4, 3}, magnitudes, std::vector<float>(12), std::nullopt);
    memory.append(view, {"view " + std::to_string(i), std::nullopt, std::nullopt});
  }
  EXPECT_FALSE(learn_component_weights(memory));
  // All at one place: there is no spacing.
  for (const ViewId view : memory.views()) memory.set_pose(view, ReferencePose{1.0, 2.0, {}});
  EXPECT_FALSE(learn_component_weights(memory));
  EXPECT_THROW((void)learn_component_weights(memory, 3), ContractError);
}

}  // namespace
}  // namespace panonav::lab
