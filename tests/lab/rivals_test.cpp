#include "lab/baselines/rivals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "lab/elsewhere/experiments.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "support/landmark_pictures.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::lab {
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
  list.push_back(make_fourier_signature_recogniser(15));
  list.push_back(make_grey_histogram_recogniser(64));
  list.push_back(make_colour_histogram_recogniser(32));
  list.push_back(make_eigenimage_recogniser(15));
  list.push_back(make_zero_phase_recogniser());
  list.push_back(make_pixels_over_all_rotations_recogniser());
  list.push_back(make_patch_normalised_recogniser());
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
      const RivalView turned = in_colour(rotate_columns(references[i].panorama, turn), i);
      EXPECT_EQ(recogniser->nearest(turned), i) << recogniser->name();
    }
  }
}

TEST(PixelsOverAllTurns, AgreesWithTryingEveryTurn) {
  std::vector<RivalView> references;
  for (std::uint64_t seed = 0; seed < 12; ++seed) references.push_back({random_view(seed)});
  const auto recogniser = make_pixels_over_all_rotations_recogniser();
  recogniser->memorise(references);
  for (std::uint64_t seed = 100; seed < 110; ++seed) {
    const Panorama query = random_view(seed);
    std::size_t best = 0;
    double smallest = 1e30;
    for (std::size_t i = 0; i < references.size(); ++i) {
      for (int turn = 0; turn < query.columns(); ++turn) {
        const Panorama turned = rotate_columns(references[i].panorama, turn);
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
  const auto recogniser = make_colour_histogram_recogniser(32);
  recogniser->memorise(references);
  for (std::size_t i = 0; i < references.size(); ++i) {
    EXPECT_EQ(recogniser->nearest(references[i]), i);
  }
}

TEST(ColourHistogram, RefusesViewsWithoutColour) {
  const auto recogniser = make_colour_histogram_recogniser();
  EXPECT_THROW(recogniser->memorise({{random_view(1)}}), ContractError);
}

/// Returns the reference `after` places behind the query's own.
class NextOne final : public RivalRecogniser {
 public:
  explicit NextOne(std::size_t after) : after_(after) {}
  [[nodiscard]] std::string name() const override { return "plus " + std::to_string(after_); }
  void memorise(const std::vector<RivalView>& references) override { references_ = references; }
  [[nodiscard]] std::size_t nearest(const RivalView& query,
                                    std::optional<std::size_t> left_out) const override {
    // Panorama and picture are turned alike, and are those of the view that is left out.
    EXPECT_EQ(query.picture, to_picture(query.panorama));
    std::vector<float> query_values(query.panorama.values().begin(), query.panorama.values().end());
    const auto& own = references_.at(left_out.value()).panorama.values();
    std::vector<float> there(own.begin(), own.end());
    std::ranges::sort(query_values);
    std::ranges::sort(there);
    EXPECT_EQ(query_values, there);
    return (*left_out + after_) % references_.size();
  }
  [[nodiscard]] double bytes_per_view() const override { return 7.0; }

 private:
  std::size_t after_;
  std::vector<RivalView> references_;
};

// One protocol for all: each picture of a line of places, turned, is asked of the others.
TEST(LeaveOneOut, RivalsOfTheCallerAnswerTheSameQueriesInTheSameRun) {
  const testing::TemporaryFolder folder;
  std::vector<Pose2> line;
  for (int i = 0; i < 10; ++i) line.push_back({0.4 * i, 0.0, 0.0});
  testing::write_dataset(folder / "line", testing::landmark_world(3), line);
  const ReproductionOptions options = default_options("elsewhere");
  std::vector<std::unique_ptr<RivalRecogniser>> rivals;
  rivals.push_back(std::make_unique<NextOne>(1));
  rivals.push_back(std::make_unique<NextOne>(3));
  Executor executor(2);
  Reproduction result{.out = folder.path()};
  ElsewhereExperiments{{options, executor, result}}.reproduce_leave_one_out(folder / "line",
                                                                            std::move(rivals));
  const auto row = [&](const std::string& id) {
    const auto found = std::ranges::find(result.rows, "elsewhere.line." + id, &ResultRow::id);
    EXPECT_NE(found, result.rows.end()) << id;
    return found == result.rows.end() ? ResultRow{} : *found;
  };
  // All but the last have the next one beside them.
  EXPECT_DOUBLE_EQ(row("plus_1.near").ours, 0.9);
  EXPECT_DOUBLE_EQ(row("plus_3.near").ours, 0.0);
  EXPECT_DOUBLE_EQ(row("plus_1.bytes").ours, 7.0);
  EXPECT_GE(row("near").ours, 0.8);
  EXPECT_TRUE(row("near").over.ends_with("plus 1 27, plus 3 0")) << row("near").over;
  EXPECT_EQ(row("known").over, "of 30");
  EXPECT_FALSE(std::filesystem::exists(folder / "line.panonav"));
}

}  // namespace
}  // namespace panonav::lab
