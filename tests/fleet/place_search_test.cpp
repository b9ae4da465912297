// Searches memory files; tests/fleet/test_server.py runs all of it with memories on a server, too.
#include "panonav_fleet/place_search.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_address.hpp"
#include "support/memory_samples.hpp"

namespace panonav::fleet {
using namespace testing;
namespace {

class PlaceSearchTest : public MemoryFileTest {
 protected:
  std::vector<NewView> views(int count) {
    std::vector<NewView> made;
    for (int i = 0; i < count; ++i) {
      made.push_back(random_view(random, small_header().shape, number++));
      // Random signatures of few values, so that there are ties.
      for (auto& value : made.back().signature.magnitudes) value /= 64;
    }
    return made;
  }
  PackedSignature query() {
    PackedSignature made = random_packed(random, small_header().shape);
    for (auto& value : made.magnitudes) value /= 64;
    return made;
  }
  /// A search and what it finds are those of the memory held whole.
  void expect_same(const PlaceSearch& search, const MemoryFile& file) {
    const VisualMemory held = file.load();
    ASSERT_EQ(search.size(), held.size());
    EXPECT_EQ(search.views(), file.views());
    for (int i = 0; i < 6; ++i) {
      const PackedSignature signature = query();
      const std::vector<ViewId> excluded{held.views()[held.size() / 3], ViewId{999999}};
      const SearchMask mask{i % 2 == 0 ? std::span<const ViewId>() : excluded, {}};
      const SearchOptions options{.top = i == 5 ? 5000 : 7, .components = i % 3};
      EXPECT_EQ(search.search(signature, options, mask).matches,
                held.search(signature, options, mask).matches);
    }
  }
  /// Changes are reported a moment later; on a busy machine after many seconds.
  static void refresh(PlaceSearch& search, std::size_t views) {
    for (int i = 0; i < 6000; ++i) {
      search.refresh();
      if (search.size() == views) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    FAIL() << search.size() << " views, wanted: " << views;
  }

  Random random{5};
  int number = 0;
};

TEST_F(PlaceSearchTest, FindsWhatTheWholeMemoryFinds) {
  MemoryFile file = MemoryFile::create(path, small_header());
  file.append(views(1500));
  const PlaceSearch search(path);
  EXPECT_EQ(search.header(), file.header());
  EXPECT_GT(search.bytes(), 1500U);
  expect_same(search, file);
}

TEST_F(PlaceSearchTest, TakesOverWhatOthersChange) {
  MemoryFile file = MemoryFile::create(path, small_header());
  PlaceSearch search(path);
  EXPECT_EQ(search.size(), 0U);
  EXPECT_TRUE(search.search(query()).matches.empty());
  const auto ids = file.append(views(400));
  refresh(search, 400);
  expect_same(search, file);
  file.change([&] { file.remove(std::vector{ids[0], ids[17], ids[18], ids[399]}); }, "some");
  refresh(search, 396);
  expect_same(search, file);
  file.undo();  // under their old ids
  refresh(search, 400);
  expect_same(search, file);
  for (const NewView& view : views(3)) file.append(view);
  refresh(search, 403);
  expect_same(search, file);
  // Into another area, out of all areas, and one that goes while another comes in one change.
  file.set_pose(ids[1], ReferencePose{100.0, 100.0, 0.0});
  file.set_pose(ids[2], std::nullopt);
  file.remove(std::vector{ids[1], ids[5]});
  file.append(views(2));
  refresh(search, 403);
  search.refresh();
  expect_same(search, file);
}

TEST_F(PlaceSearchTest, ASearchSeesOneStateAndLeavesOutWhatIsGone) {
  MemoryFile file = MemoryFile::create(path, small_header());
  file.append(views(300));
  PlaceSearch search(path);
  const PackedSignature signature = query();
  const auto nearest = file.load().search(signature, {.top = 12}).matches;
  PlaceSearch::Snapshot before = search.snapshot();
  EXPECT_EQ(before.search(signature, {.top = 12}, {}).matches, nearest);
  file.remove(std::vector{nearest[0].view, nearest[4].view});
  EXPECT_EQ(before.search(signature, {.top = 12}, {}).matches, nearest);
  // Sketched, and gone from the memory.
  const auto left = search.search(signature, {.top = 10}).matches;
  EXPECT_EQ(left, file.load().search(signature, {.top = 10}).matches);
  PlaceSearch::Snapshot after = search.snapshot();
  EXPECT_EQ(after.size(), 300U);
  const VisualMemory loaded =
      after.load(std::vector{nearest[4].view, nearest[2].view, nearest[1].view, nearest[2].view});
  EXPECT_EQ(loaded.size(), 2U);
  EXPECT_EQ(loaded.info(nearest[1].view), file.load().info(nearest[1].view));
  EXPECT_EQ(after.find(loaded.info(nearest[1].view).name), nearest[1].view);
  EXPECT_EQ(after.find("nobody"), std::nullopt);
  EXPECT_EQ(after.find("\xFF"), std::nullopt);
  EXPECT_EQ(after.find(std::string("a\0b", 3)), std::nullopt);
  const std::vector<PositionBounds> bounds{{-1.0, 1.0, -1.0, 1.0}, {0.0, 2.0, 0.0, 2.0}};
  std::vector<ViewId> within = file.views_within(bounds[0]);
  for (const ViewId view : file.views_within(bounds[1])) within.push_back(view);
  std::ranges::sort(within);
  within.erase(std::unique(within.begin(), within.end()), within.end());
  EXPECT_EQ(after.views_within(bounds), within);
  EXPECT_GT(within.size(), 5U);
}

TEST_F(PlaceSearchTest, ManyThreadsSearchWhileOthersChange) {
  MemoryFile file = MemoryFile::create(path, small_header());
  const auto first = file.append(views(300));
  PlaceSearch search(path);
  // Views that are as the query come, and others go: each search finds one state or the other.
  NewView repeated = views(1).front();
  std::atomic<bool> done = false;
  std::atomic<int> wrong = 0;
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 3; ++thread) {
    threads.emplace_back([&] {
      while (!done) {
        const auto matches = search.search(repeated.signature, {.top = 3}).matches;
        if (matches.size() != 3 || matches[0].dissimilarity > matches[2].dissimilarity) ++wrong;
      }
    });
  }
  for (int i = 0; i < 10; ++i) {
    repeated.info.name = "repeated " + std::to_string(i);
    file.append(repeated);
    file.remove(std::vector{first[static_cast<std::size_t>(i)]});
    search.refresh();
  }
  done = true;
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  refresh(search, 300);
  expect_same(search, file);
  EXPECT_EQ(search.search(repeated.signature, {.top = 3}).matches[2].dissimilarity, 0U);
}

TEST_F(PlaceSearchTest, RefusesWhatIsNoMemory) {
  EXPECT_THROW(PlaceSearch{path}, FileError);
  MemoryFile file = MemoryFile::create(path, small_header());
  file.append(views(10));
  const PlaceSearch search(path);
  PackedSignature other = query();
  other.shape = {5, 7};
  EXPECT_THROW((void)search.search(other), ContractError);
  EXPECT_THROW((void)search.search(query(), {.top = 0}), ContractError);
}

}  // namespace
}  // namespace panonav::fleet
