#include "panonav/storage/memory_file_views.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "panonav/core/error.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

// Views 1 .. 60 but for every seventh, with links.
VisualMemory write_sample(const std::filesystem::path& path) {
  MemoryFile file = MemoryFile::create(path, small_header());
  Random random(1);
  std::vector<NewView> added;
  for (int number = 0; number < 60; ++number) {
    added.push_back(random_view(random, small_header().shape, number));
  }
  std::vector<ViewId> ids = file.append(added);
  std::vector<ViewId> removed;
  for (std::size_t i = 0; i < ids.size(); i += 7) removed.push_back(ids[i]);
  file.remove(removed);
  std::erase_if(ids, [&](ViewId id) { return std::ranges::binary_search(removed, id); });
  std::vector<Link> links;
  for (std::size_t i = 3; i < ids.size(); ++i) {
    links.push_back({ids[i - 3], ids[i], i % 2 == 0 ? Link::Kind::neighbour : Link::Kind::closure});
  }
  file.link(links);
  return file.load();
}

void expect_same_views(const VisualMemory& part, const VisualMemory& whole) {
  EXPECT_EQ(part.shape(), whole.shape());
  EXPECT_EQ(part.full_scale(), whole.full_scale());
  EXPECT_EQ(part.elevations(), whole.elevations());
  for (const ViewId view : part.views()) {
    EXPECT_EQ(part.info(view), whole.info(view));
    EXPECT_EQ(part.packed(view), whole.packed(view));
  }
}

using ViewsOfAMemoryFile = MemoryFileTest;

TEST_F(ViewsOfAMemoryFile, AreThoseOfTheWholeMemory) {
  const VisualMemory whole = write_sample(path);
  ASSERT_EQ(whole.size(), 51U);
  const MemoryFileViews source(path);
  EXPECT_TRUE(std::ranges::equal(source.views(), whole.views()));
  EXPECT_TRUE(std::ranges::equal(source.file().links(), whole.links()));
  EXPECT_EQ(source.load({}).size(), 0U);
  std::vector<ViewId> read;
  source.file().read_views(
      [&](ViewId view, const ReferenceInfo& info, const PackedSignature& signature) {
        EXPECT_EQ(info, whole.info(view));
        EXPECT_EQ(signature, whole.packed(view));
        read.push_back(view);
      });
  EXPECT_TRUE(std::ranges::equal(read, whole.views()));
  const VisualMemory all = source.load(source.views());
  EXPECT_TRUE(std::ranges::equal(all.views(), whole.views()));
  EXPECT_TRUE(all.links().empty());
  expect_same_views(all, whole);
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<ViewId> chosen;
    for (const ViewId view : whole.views()) {
      if (random.index(4) == 0) chosen.push_back(view);
    }
    const VisualMemory part = source.load(chosen);
    EXPECT_TRUE(std::ranges::equal(part.views(), chosen));
    expect_same_views(part, whole);
  }
}

TEST_F(ViewsOfAMemoryFile, RefuseWhatIsNotThere) {
  const VisualMemory whole = write_sample(path);
  const MemoryFileViews source(path);
  const ViewId there = whole.views().front();
  ASSERT_FALSE(whole.contains(ViewId{1}));
  EXPECT_THROW((void)source.load(std::vector<ViewId>{ViewId{1}}), ContractError);
  EXPECT_THROW((void)source.load(std::vector<ViewId>{there, ViewId{9999}}), ContractError);
  EXPECT_THROW((void)source.load(std::vector<ViewId>{there, there}), ContractError);
  EXPECT_EQ(source.load(std::vector<ViewId>{there}).size(), 1U);
  EXPECT_THROW(MemoryFileViews(folder / "absent.panonav"), FileError);
  folder.write("foreign.panonav", "no memory at all");
  EXPECT_THROW(MemoryFileViews(folder / "foreign.panonav"), FileError);
}

TEST_F(ViewsOfAMemoryFile, SeeWhatOthersChange) {
  const VisualMemory whole = write_sample(path);
  const MemoryFileViews source(path);
  const std::vector<ViewId> first{whole.views()[0]};
  const std::vector<ViewId> second{whole.views()[1]};
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  file.remove(first);
  file.set_pose(second[0], ReferencePose{1.0, 2.0, 3.0});
  EXPECT_THROW((void)source.load(first), ContractError);
  EXPECT_EQ(source.load(second).info(second[0]).pose, (ReferencePose{1.0, 2.0, 3.0}));
}

// Whatever is damaged, a view is what was written or refused as a fault of the file.
TEST_F(ViewsOfAMemoryFile, DamageIsAFaultOfTheFile) {
  const VisualMemory whole = write_sample(path);
  const std::string good = bytes_of(path);
  Random random(3);
  int views_refused = 0;
  int views_read = 0;
  for (int trial = 0; trial < 400; ++trial) {
    SCOPED_TRACE(trial);
    const auto copy = folder.write("damaged.panonav", damaged_bytes(good, random, trial));
    try {
      const MemoryFileViews source(copy);
      for (const ViewId view : whole.views()) {
        try {
          expect_same_views(source.load({&view, 1}), whole);
          ++views_read;
        } catch (const FileError&) {
          ++views_refused;
        }
      }
      source.file().read_views(
          [&](ViewId view, const ReferenceInfo& info, const PackedSignature& signature) {
            EXPECT_EQ(info, whole.info(view));
            EXPECT_EQ(signature, whole.packed(view));
          });
    } catch (const FileError&) {
    }
    if (HasFailure()) return;
  }
  EXPECT_GT(views_read, 1000);
  EXPECT_GT(views_refused, 50);
}

}  // namespace
}  // namespace panonav::testing
