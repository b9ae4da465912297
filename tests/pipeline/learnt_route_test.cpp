#include "panonav/pipeline/learnt_route.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "panonav/core/number_text.hpp"
#include "panonav/pipeline/map_scale.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "support/temporary_folder.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

/// A memory with a curved route through a room.
class KeptRouteLimits : public ::testing::Test {
 protected:
  KeptRouteLimits() {
    MemoryHeader header;
    header.shape = {4, 3};
    header.full_scale = 0.1F;
    header.panorama_columns = 96;
    file.emplace(MemoryFile::create(folder / "kept.panonav", header));
    for (int i = 0; i <= 30; ++i) {
      const Pose2 pose{0.1 * i - 1.5, 0.2 * std::sin(0.3 * i), 0.0};
      route.append(pose, room.line(pose));
    }
    file->append_route(name, route);
    store_route_source(*file, name, {});
  }
  [[nodiscard]] std::optional<RouteLimits> load(const std::string& of) const {
    return load_route_limits(*file, of, file->route(of).value(), {}, {});
  }

  const std::string name = "round";
  const std::string key = "learnt route.round";
  const ToyWorld room = pillared_room(31);
  RoutePanorama route;
  TemporaryFolder folder;
  std::optional<MemoryFile> file;
};

TEST_F(KeptRouteLimits, AreThoseOfATrackerThatLearnsAgain) {
  EXPECT_EQ(load(name), std::nullopt);
  learn_and_store_route(*file, name);
  const RouteLimits relearnt = RouteTracker(route).limits();
  EXPECT_EQ(load(name), relearnt);
  EXPECT_GT(relearnt.min_detail_correlation, -1.0);
  EXPECT_EQ(RouteFollower(*file, std::nullopt).tracker().limits(), relearnt);
  // Other options learn other limits.
  const RouteTrackerOptions wide{.search_lateral_m = 0.4};
  EXPECT_EQ(load_route_limits(*file, name, route, wide, {}), std::nullopt);
  EXPECT_EQ(load_route_limits(*file, name, route, {}, {.reach_m = 3.0}), std::nullopt);
}

// A follower takes the stored limits: it does not learn them again.
TEST_F(KeptRouteLimits, AreUsedByAFollower) {
  learn_and_store_route(*file, name);
  auto words = split_words(file->parameter(key).value());
  words[2] = to_hex_text(0.625);
  std::string text;
  for (const std::string& word : words) text += word + " ";
  file->set_parameter(key, text);
  EXPECT_EQ(RouteFollower(*file, std::nullopt).tracker().limits().min_correlation, 0.625);
}

TEST_F(KeptRouteLimits, OfAnotherRouteAreNotUsed) {
  learn_and_store_route(*file, name);
  file->rename_route(name, "tour");
  EXPECT_EQ(load("tour"), RouteTracker(route).limits());
  EXPECT_EQ(file->parameter(key), std::nullopt);
  RoutePanorama more(route.columns());
  const Pose2 next{1.6, 0.1, 0.0};
  more.append(next, room.line(next));
  file->append_route("tour", more);
  EXPECT_EQ(load("tour"), std::nullopt);
  learn_and_store_route(*file, "tour");
  EXPECT_TRUE(load("tour"));
}

TEST_F(KeptRouteLimits, OfAStrangerHoldNoNumberThatDoesNotFit) {
  learn_and_store_route(*file, name);
  const auto words = split_words(file->parameter(key).value());
  for (std::size_t i = 2; i < words.size(); ++i) {
    for (const char* wrong : {"-2", "0x1p+1024", "nan", "word", "1e400", ""}) {
      std::string text;
      for (std::size_t k = 0; k < words.size(); ++k)
        text += (k == i ? std::string(wrong) : words[k]) + " ";
      file->set_parameter(key, text);
      EXPECT_EQ(load(name), std::nullopt) << i << " " << wrong;
    }
  }
  file->set_parameter(key, "1 nonsense");
  EXPECT_EQ(load(name), std::nullopt);
  EXPECT_NO_THROW((void)RouteFollower(*file, std::nullopt));
}

TEST_F(KeptRouteLimits, AreLearntAgainWhenARouteIsScaled) {
  store_route_source(*file, name, {.is_in_map_unit = true});
  learn_and_store_route(*file, name);
  const auto before = file->parameter(key);
  file->change([&] { (void)scale_routes(*file, 0.5); });
  ASSERT_NE(file->route(name)->length_m(), route.length_m());
  EXPECT_NE(file->parameter(key), before);
  EXPECT_EQ(load(name), RouteTracker(file->route(name).value()).limits());
}

TEST_F(KeptRouteLimits, OfARouteOfOneLineAreNotLearnt) {
  RoutePanorama one(route.columns());
  one.append({}, room.line({}));
  file->append_route("one", one);
  learn_and_store_route(*file, "one");
  EXPECT_EQ(file->parameter("learnt route.one"), std::nullopt);
}

}  // namespace
}  // namespace panonav::testing
