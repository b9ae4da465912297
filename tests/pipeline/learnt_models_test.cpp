#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/internal/learning_sample.hpp"
#include "panonav/pipeline/internal/learnt_models.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/localiser.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/comma_locale.hpp"
#include "support/temporary_folder.hpp"

namespace panonav {
namespace {

constexpr SignatureShape shape{8, 6};

/// Views on a grid whose signatures change smoothly with the place.
NewView view_at(int number, double x_m, double y_m) {
  NewView view;
  view.info = {"view_" + std::to_string(number), ReferencePose{x_m, y_m, 0.3}, {}};
  view.signature.shape = shape;
  Random random(7);
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const double a = random.uniform(0.3, 1.5);
    const double b = random.uniform(0.3, 1.5);
    view.signature.magnitudes.push_back(
        static_cast<std::uint8_t>(128.0 + 100.0 * std::sin(a * x_m + b * y_m + double(i))));
    view.signature.phases.push_back(
        static_cast<std::uint8_t>(128.0 + 100.0 * std::cos(b * x_m - a * y_m + double(i))));
  }
  return view;
}

class KeptModels : public ::testing::Test {
 protected:
  MemoryFile make_file(int views = 60) {
    MemoryHeader header;
    header.shape = shape;
    header.panorama_columns = 32;
    MemoryFile file = MemoryFile::create(path(), header);
    for (int i = 0; i < views; ++i) file.append(view_at(i, 0.5 * (i % 8), 0.5 * (i / 8)));
    return file;
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_.path() / "m.panonav"; }
  testing::TemporaryFolder folder_;
};

TEST_F(KeptModels, ComeBackFromTheFileToTheBit) {
  MemoryFile file = make_file();
  EXPECT_EQ(load_stored_models(file, file.load()), std::nullopt);
  learn_and_store_models(file);
  const VisualMemory memory = file.load();
  const auto kept = load_stored_models(MemoryFile::open(path(), Access::read_only), memory);
  ASSERT_TRUE(kept);
  EXPECT_EQ(*kept, learn_models(memory));
  EXPECT_TRUE(kept->place.learnt);
  EXPECT_TRUE(kept->position.learnt);
  ASSERT_TRUE(kept->observation);
  EXPECT_DOUBLE_EQ(kept->spacing_m, 0.5);
}

TEST_F(KeptModels, AreTheSameInAProgramWithDecimalCommas) {
  MemoryFile file = make_file();
  learn_and_store_models(file);
  const auto text = file.parameter("learnt models");
  ASSERT_TRUE(text);
  PANONAV_REQUIRE_COMMA_LOCALE(locale);
  EXPECT_EQ(load_stored_models(file, file.load()), learn_models(file.load()));
  file.set_parameter("learnt models", "");
  learn_and_store_models(file);
  EXPECT_EQ(file.parameter("learnt models"), text);
}

TEST_F(KeptModels, OfAStrangerHoldNoNumberThatDoesNotFit) {
  MemoryFile file = make_file();
  learn_and_store_models(file);
  const auto words = split_words(file.parameter("learnt models").value());
  for (const char* wrong : {"1e308", "0x1p+900", "1.5", "-", "99999999999"}) {
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i) {
      constexpr std::size_t number_of_views = 4;
      text += (i == number_of_views ? wrong : words[i]) + std::string(" ");
    }
    file.set_parameter("learnt models", text);
    EXPECT_EQ(load_stored_models(file), std::nullopt) << wrong;
  }
}

TEST_F(KeptModels, OfOtherViewsAreNotUsed) {
  MemoryFile file = make_file();
  learn_and_store_models(file);
  const auto outdated = [&] { return !load_stored_models(file, file.load()); };
  EXPECT_FALSE(outdated());
  const ViewId last = file.append(view_at(99, 9.0, 9.0));
  EXPECT_TRUE(outdated());
  learn_and_store_models(file);
  EXPECT_FALSE(outdated());
  file.set_pose(last, ReferencePose{9.0, 9.5, 0.3});
  EXPECT_TRUE(outdated());
  learn_and_store_models(file);
  file.remove(std::vector{last});
  EXPECT_TRUE(outdated());
  learn_and_store_models(file);
  EXPECT_EQ(load_stored_models(file, file.load()).value(), learn_models(file.load()));
  file.set_parameter("learnt models", "1 nonsense");
  EXPECT_TRUE(outdated());
}

TEST_F(KeptModels, BelongToTheFirstViewsInThreeDigits) {
  for (const auto& [views, learnt] :
       std::initializer_list<std::pair<std::size_t, std::size_t>>{{0, 0},
                                                                  {7, 7},
                                                                  {999, 999},
                                                                  {1000, 1000},
                                                                  {1009, 1000},
                                                                  {1010, 1010},
                                                                  {10099, 10000},
                                                                  {99999, 99900},
                                                                  {123456, 123000}}) {
    EXPECT_EQ(count_learnt_views(views), learnt);
  }
}

TEST_F(KeptModels, StayWhenOneMoreViewIsAdded) {
  const auto view = [](int i) { return view_at(i, 0.5 * (i % 32), 0.5 * (i / 32)); };
  MemoryFile file = make_file(1010);
  learn_and_store_models(file);
  const auto before = file.parameter("learnt models");
  for (int i = 1010; i < 1019; ++i) file.append(view(i));
  EXPECT_TRUE(load_stored_models(file, file.load()));
  learn_and_store_models(file);
  EXPECT_EQ(file.parameter("learnt models"), before);
  const ViewId last = file.append(view(1019));
  EXPECT_FALSE(load_stored_models(file, file.load())) << "now they belong to 1,020 views";
  learn_and_store_models(file);
  EXPECT_NE(file.parameter("learnt models"), before);
  EXPECT_EQ(load_stored_models(file, file.load()).value(), learn_models(file.load()));
  file.remove(std::array{last});
  learn_and_store_models(file);
  EXPECT_EQ(file.parameter("learnt models"), before) << "those of the same views are the same";
}

TEST_F(KeptModels, DoNotDependOnTheStepsInWhichTheMemoryGrew) {
  MemoryFile at_once = make_file(1007);
  learn_and_store_models(at_once);
  const auto path_in_steps = folder_.path() / "steps.panonav";
  MemoryFile in_steps = MemoryFile::create(path_in_steps, at_once.header());
  for (int i = 0; i < 1007; ++i) {
    in_steps.append(view_at(i, 0.5 * (i % 8), 0.5 * (i / 8)));
    if (i == 500 || i > 1003) learn_and_store_models(in_steps);
  }
  EXPECT_EQ(in_steps.parameter("learnt models"), at_once.parameter("learnt models"));
  ASSERT_TRUE(load_stored_models(at_once, at_once.load()));
  Tracker tracker(at_once);
  at_once.set_parameter("learnt models", "");
  EXPECT_EQ(Tracker(at_once).localiser().model(), tracker.localiser().model());
}

TEST_F(KeptModels, DoNotDependOnTheNumberOfThreads) {
  MemoryFile file = make_file(200);
  learn_and_store_models(file);
  const auto alone = file.parameter("learnt models");
  for (const int threads : {2, 3, 5}) {
    file.set_parameter("learnt models", "");
    Executor executor(threads);
    learn_and_store_models(file, executor);
    EXPECT_EQ(file.parameter("learnt models"), alone) << threads;
  }
  EXPECT_TRUE(load_stored_models(file).value().observation);  // guard
}

TEST_F(KeptModels, DependOnFloorsButNotOnNames) {
  MemoryFile file = make_file();
  learn_and_store_models(file);
  file.rename(ViewId{3}, "another name");
  EXPECT_TRUE(load_stored_models(file, file.load()));
  file.rename(ViewId{3}, "floor=attic/another name");
  EXPECT_FALSE(load_stored_models(file, file.load()));
}

TEST_F(KeptModels, OfALargeMemoryAreLearntFromWholeAreas) {
  constexpr int areas = 40;
  constexpr int views_per_area = 700;
  MemoryHeader header;
  header.shape = {1, 2};
  header.panorama_columns = 32;
  MemoryFile file = MemoryFile::create(path(), header);
  std::vector<NewView> views;
  for (int i = 0; i < areas * views_per_area; ++i) {
    NewView view;
    const double x_m = 10.0 * (i / views_per_area) + 0.3 * (i % 28) + 0.1;
    view.info = {std::to_string(i), ReferencePose{x_m, 0.3 * (i % views_per_area / 28), {}}, {}};
    view.signature = {header.shape, {1, 2}, {3, 4}};
    views.push_back(std::move(view));
  }
  file.append(views);
  file.append(NewView{{"beside", ReferencePose{0.2, 0.1, {}}, {}}, views[0].signature, {}, {}});
  const VisualMemory learnt = load_learnt_views(file, file.places());
  EXPECT_LE(learnt.size(), max_learnt_views);
  EXPECT_GT(learnt.size(), max_learnt_views - views_per_area);
  EXPECT_FALSE(learnt.find("beside")) << "learns from the first 28,000";
  std::vector<int> counts(areas);
  for (const ViewId view : learnt.views()) ++counts[(view.value - 1) / views_per_area];
  const auto whole = std::ranges::count(counts, views_per_area);
  EXPECT_EQ(whole, 28) << "of 700 views each, up to 20,000 views";
  EXPECT_EQ(std::ranges::count(counts, 0), areas - whole - 1) << "only the last one is cut";
  const VisualMemory all = file.load();
  const LearntViews held(all);
  EXPECT_TRUE(std::ranges::equal(held.memory().views(), learnt.views()));
}

TEST_F(KeptModels, AnswersAreThoseOfModelsLearntAnew) {
  MemoryFile file = make_file();
  const PlaceRecogniser relearnt(file);
  Tracker tracker_anew(file);
  learn_and_store_models(file);
  const PlaceRecogniser kept(file);
  Tracker tracker(file);
  EXPECT_EQ(kept.localiser().place_model(), relearnt.localiser().place_model());
  EXPECT_EQ(kept.localiser().position_model(), relearnt.localiser().position_model());
  EXPECT_EQ(tracker.localiser().model(), tracker_anew.localiser().model());
  for (int i = 0; i < 10; ++i) {
    const PackedSignature query = view_at(0, 0.37 * i, 0.21 * i).signature;
    const Place a = kept.localiser().localise(query);
    const Place b = relearnt.localiser().localise(query);
    EXPECT_EQ(a.known, b.known);
    ASSERT_EQ(a.matches.size(), b.matches.size());
    EXPECT_EQ(a.matches.front().view, b.matches.front().view);
    ASSERT_EQ(a.position.has_value(), b.position.has_value());
    if (a.position) {
      EXPECT_EQ(a.position->position(), b.position->position());
      EXPECT_EQ(a.position->radius_m, b.position->radius_m);
    }
    const MonteCarloEstimate c = tracker.observe(query);
    const MonteCarloEstimate d = tracker_anew.observe(query);
    EXPECT_EQ(c.spread_m, d.spread_m);
    EXPECT_EQ(c.pose, d.pose);
  }
}

TEST_F(KeptModels, ASmallMemoryKeepsWhatItHas) {
  MemoryFile file = make_file(3);
  learn_and_store_models(file);
  const auto kept = load_stored_models(file, file.load());
  ASSERT_TRUE(kept);
  EXPECT_FALSE(kept->place.learnt);
  EXPECT_FALSE(kept->observation);
  EXPECT_THROW(Tracker{file}, FileError);
}

TEST_F(KeptModels, ARecogniserNeedsViewsAndFittingOptions) {
  MemoryFile file = make_file(0);
  learn_and_store_models(file);
  EXPECT_THROW(PlaceRecogniser{file}, FileError);
  file.append(view_at(1, 0.0, 0.0));
  EXPECT_THROW(PlaceRecogniser(file, {.localiser = {.components = 7}}), ContractError);
  EXPECT_THROW(PlaceRecogniser(path().string() + "x"), FileError);
  const PlaceRecogniser recogniser(path());
  EXPECT_THROW(static_cast<void>(recogniser.localise(Image(31, 8))), ContractError);
  const Place place = recogniser.localise(Image(32, 8));
  EXPECT_EQ(place.matches.front().name, "view_1");
  EXPECT_TRUE(
      recogniser.localise(Image(32, 8), std::vector<std::string>{"view_1"}).matches.empty());
}

TEST_F(KeptModels, AViewThatSomebodyForgetsMeanwhileHasNoFeatures) {
  MemoryHeader header;
  header.shape = shape;
  header.panorama_columns = 32;
  header.elevations = ElevationBand{radians(-30.0), radians(30.0)};
  const LocalFeatures features{{8, 32}, *header.elevations, {{.column = 3, .row = 4}}};
  MemoryFile file = MemoryFile::create(path(), header);
  std::vector<ViewId> views;
  for (int i = 0; i < 60; ++i) {
    NewView view = view_at(i, 0.5 * (i % 8), 0.5 * (i / 8));
    view.features = pack(features);
    views.push_back(file.append(view));
  }
  learn_and_store_models(file);  // or the recogniser reads them all to learn
  const PlaceRecogniser recogniser(path());
  file.remove(views);
  int doubtful = 0;
  for (int i = 0; i < 200; ++i) {
    const PackedSignature query = view_at(0, 0.1 * i, 0.07 * i).signature;
    const auto found =
        recogniser.localiser().localise(query, {}, [&](Handedness) { return features; });
    doubtful += is_inconclusive(found.evidence) ? 1 : 0;
    EXPECT_FALSE(found.evidence.features);
  }
  EXPECT_GT(doubtful, 0);
}

}  // namespace
}  // namespace panonav
