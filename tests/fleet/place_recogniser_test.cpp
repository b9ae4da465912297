#include "panonav/pipeline/place_recogniser.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/memory/view_index.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav_fleet/place_search.hpp"
#include "support/landmark_pictures.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::fleet {
using namespace testing;
namespace {

Image noise_picture(std::uint64_t seed, int columns = 96, int rows = 12) {
  Random random(seed);
  Image image(columns, rows);
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < columns; ++u) image.at(u, v) = static_cast<std::uint8_t>(random.next());
  }
  return image;
}

/// All but `bytes_read`, to the bit.
void expect_same(const Place& searched, const Place& held) {
  EXPECT_EQ(searched.known_probability, held.known_probability);
  EXPECT_EQ(searched.known, held.known);
  ASSERT_EQ(searched.matches.size(), held.matches.size());
  for (std::size_t i = 0; i < held.matches.size(); ++i) {
    const PlaceMatch& a = searched.matches[i];
    const PlaceMatch& b = held.matches[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.view, b.view);
    EXPECT_EQ(a.dissimilarity, b.dissimilarity);
    EXPECT_EQ(a.column_difference, b.column_difference);
    EXPECT_EQ(a.verified_features, b.verified_features);
    EXPECT_EQ(a.heading_rad, b.heading_rad);
  }
  ASSERT_EQ(searched.position.has_value(), held.position.has_value());
  if (held.position) {
    EXPECT_EQ(searched.position->x_m, held.position->x_m);
    EXPECT_EQ(searched.position->y_m, held.position->y_m);
    EXPECT_EQ(searched.position->radius_m, held.position->radius_m);
  }
  EXPECT_EQ(searched.heading_rad, held.heading_rad);
  EXPECT_EQ(searched.components, held.components);
}

class RecogniserOfAnIndexTest : public InTemporaryFolder {
 protected:
  /// Memorises a grid of views, each such grid once. `posed`: of every `posed` views one has a
  /// pose; 0: none has.
  void memorise(int side, std::size_t posed) {
    static const TemporaryFolder memorised;
    const std::filesystem::path made =
        memorised / (std::to_string(side) + "_" + std::to_string(posed) + ".panonav");
    if (!std::filesystem::exists(made)) make_memory(made, side, posed);
    std::filesystem::copy_file(made, path_);
  }
  void make_memory(const std::filesystem::path& path, int side, std::size_t posed) const {
    const auto poses = grid_poses(side);
    std::vector<Observation> observations;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Observation& seen =
          observations.emplace_back(landmark_picture(world_, poses[i], columns_, rows_));
      seen.name = view_name(i);
      if (posed > 0 && i % posed == 0) {
        seen.pose = ReferencePose{poses[i].x_m, poses[i].y_m, poses[i].heading_rad};
      }
    }
    Executor executor;
    Memoriser memoriser(path, {.source = landmark_panoramas(), .thumbnails = false});
    memoriser.add(std::move(observations), executor);
    memoriser.finish();
  }
  /// The memory is not held.
  PlaceRecogniser search(const PlaceRecogniserOptions& options = {}) const {
    return {std::make_unique<PlaceSearch>(path_), path_, options};
  }
  /// In the memory, turned, between its views, elsewhere and nowhere.
  std::vector<Image> queries() const {
    std::vector<Image> pictures;
    for (const Pose2& pose : {Pose2{1.0, 1.5, 0.0}, Pose2{0.5, 2.0, 2.0}, Pose2{1.3, 0.8, -1.0},
                              Pose2{50.0, 70.0, 0.0}}) {
      pictures.push_back(landmark_picture(world_, pose, columns_, rows_));
    }
    pictures.push_back(landmark_picture(landmark_world(77), {1.0, 1.0, 0.5}, columns_, rows_));
    pictures.push_back(noise_picture(3, columns_, rows_));
    return pictures;
  }
  void expect_same_answers(const PlaceRecogniserOptions& options = {}) {
    const PlaceRecogniser held(path_, options);
    const PlaceRecogniser searched = search(options);
    EXPECT_EQ(searched.size(), held.memory().size());
    const std::vector<std::string> excluded{view_name(8), view_name(3), "nothing"};
    for (const Image& picture : queries()) {
      const Observation seen(picture);
      expect_same(searched.localise(seen), held.localise(seen));
      expect_same(searched.localise(seen, excluded), held.localise(seen, excluded));
    }
    EXPECT_GE(searched.search_counters().searches, 2 * queries().size());
    EXPECT_GT(searched.search_counters().views_read, 0U);
  }

  const ToyWorld world_ = landmark_world(5);
  const std::filesystem::path path_ = folder / "m.panonav";
  int columns_ = 96, rows_ = 12;  ///< of all pictures
};

TEST_F(RecogniserOfAnIndexTest, AnswersAsTheHeldMemoryDoes) {
  memorise(9, 1);
  expect_same_answers();
  expect_same_answers({.localiser = {.top = 40}});
  expect_same_answers({.localiser = {.top = 3, .components = 4}});
  expect_same_answers({.localiser = {.reranked_views = 0}});
  expect_same_answers({.localiser = {.reranked_views = 30}});
}

TEST_F(RecogniserOfAnIndexTest, AnswersAlikeWhereFewViewsOrNoneHavePoses) {
  memorise(7, 3);
  expect_same_answers();
  std::filesystem::remove(path_);
  memorise(7, 0);
  expect_same_answers();
}

TEST_F(RecogniserOfAnIndexTest, AnswersAlikeBeyondAThousandViews) {
  columns_ = 48;
  rows_ = 6;
  memorise(33, 1);  // 1089: more than are ranked again, or whose columns are kept
  expect_same_answers();
}

TEST_F(RecogniserOfAnIndexTest, ATrackerEstimatesAsInTheHeldMemory) {
  memorise(9, 1);
  // Another seed than that of the stored models: the model is learnt from all views. Without
  // odometry, the scale of the motion is computed from all views, too.
  for (const auto& [seed, has_odometry] : {std::pair(1, true), {2, true}, {1, false}}) {
    const TrackerOptions options{.filter = {.max_particles = 1000, .seed = seed}};
    Tracker held(path_, options);
    Tracker searched(std::make_unique<PlaceSearch>(path_), path_, options);
    EXPECT_TRUE(held.is_memory_held());
    EXPECT_FALSE(searched.is_memory_held());
    EXPECT_THROW((void)searched.memory(), ContractError);
    EXPECT_EQ(searched.localiser().model(), held.localiser().model());
    for (int i = 0; i < 6; ++i) {
      Observation seen(landmark_picture(world_, {0.5 + 0.2 * i, 1.0, 0.1 * i}, columns_, rows_));
      if (has_odometry) seen.odometry = Pose2{0.2 * i, 0.0, 0.1 * i};
      const MonteCarloEstimate expected = held.observe(seen);
      const MonteCarloEstimate found = searched.observe(seen);
      EXPECT_EQ(found.pose, expected.pose);
      EXPECT_EQ(found.probability, expected.probability);
      EXPECT_EQ(searched.localiser().particles().x_m, held.localiser().particles().x_m);
    }
  }
}

TEST_F(RecogniserOfAnIndexTest, ATrackerKeepsItsParticlesWhileViewsComeAndGo) {
  memorise(9, 1);
  Tracker tracker(std::make_unique<PlaceSearch>(path_), path_, {.max_learnt_views = 50});
  EXPECT_FALSE(tracker.refresh());
  const Observation seen(landmark_picture(world_, {1.0, 1.5, 0.0}, columns_, rows_));
  const MonteCarloEstimate before = tracker.observe(seen);
  ASSERT_TRUE(before.pose);
  const ViewId nearest = tracker.localiser().find_nearest_view(before.pose->position());
  const std::vector<double> x_m = tracker.localiser().particles().x_m;
  MemoryFile file = MemoryFile::open(path_, Access::read_write);
  file.remove({&nearest, 1});
  EXPECT_TRUE(tracker.refresh());
  EXPECT_EQ(tracker.localiser().particles().x_m, x_m);
  EXPECT_NE(tracker.localiser().find_nearest_view(before.pose->position()), nearest);
  EXPECT_EQ(tracker.index()->posed_views().size(), 80U);
  EXPECT_TRUE(tracker.observe(seen).pose);
}

TEST_F(RecogniserOfAnIndexTest, OfALargeMemoryWhatIsKeptIsTaken) {
  memorise(9, 1);
  const PlaceRecogniser held(path_);
  PlaceRecogniser searched = search({.max_learnt_views = 50});  // of 81
  for (const Image& picture : queries()) {
    expect_same(searched.localise(Observation(picture)), held.localise(Observation(picture)));
  }
  // Others change the views: those that there are now are found, and the models stay.
  MemoryFile file = MemoryFile::open(path_, Access::read_write);
  file.remove(std::vector{*file.find(view_name(20))});
  EXPECT_TRUE(searched.refresh());
  EXPECT_FALSE(searched.refresh());
  EXPECT_EQ(searched.size(), 80U);
  const Place place = searched.localise(Observation(landmark_picture(world_, grid_poses(9)[20])));
  EXPECT_TRUE(place.known);
  for (const PlaceMatch& match : place.matches) EXPECT_NE(match.name, view_name(20));
}

TEST_F(RecogniserOfAnIndexTest, OfALargeMemoryThatKeepsNothingPartsAreLearnt) {
  for (const std::size_t posed : {1U, 0U}) {
    std::filesystem::remove(path_);
    memorise(9, posed);
    MemoryFile::open(path_, Access::read_write).set_parameter("learnt models", "none");
    const PlaceRecogniser searched = search({.max_learnt_views = 50});
    const PlaceRecogniser held(path_);
    const Place place = searched.localise(Observation(landmark_picture(world_, {1.0, 1.5, 1.0})));
    EXPECT_TRUE(place.known);
    EXPECT_EQ(
        place.matches.front().name,
        held.localise(Observation(landmark_picture(world_, {1.0, 1.5, 1.0}))).matches[0].name);
    EXPECT_FALSE(searched.localise(Observation(noise_picture(4))).known);
  }
}

TEST_F(RecogniserOfAnIndexTest, ThreadsAskAtOnce) {
  memorise(6, 1);
  const PlaceRecogniser searched = search();
  const PlaceRecogniser held(path_);
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i) {
    threads.emplace_back([&] {
      for (const Image& picture : queries()) {
        expect_same(searched.localise(Observation(picture)), held.localise(Observation(picture)));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST_F(RecogniserOfAnIndexTest, RefusesWhatItCannotTell) {
  EXPECT_THROW((void)search(), FileError);
  memorise(3, 1);
  PlaceRecogniser searched = search();
  EXPECT_FALSE(searched.is_memory_held());
  EXPECT_THROW((void)searched.memory(), ContractError);
  EXPECT_THROW((void)searched.localiser(), ContractError);
  EXPECT_THROW(searched.append({.name = "new"}, PackedSignature{}), ContractError);
  EXPECT_THROW((void)search({.areas = LocalisationAccuracy{}}), ContractError);
  EXPECT_THROW((void)search({.localiser = {.components = 99}}), ContractError);
  EXPECT_THROW((void)search({.localiser = {.top = 0}}), Error);
}

}  // namespace
}  // namespace panonav::fleet
