#include "panonav/pipeline/memory_export.hpp"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <functional>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "support/memory_samples.hpp"

namespace panonav::testing {
namespace {
std::atomic<int> fsync_calls{0};
}
}  // namespace panonav::testing

// Replaces that of the C library in this program, so that waiting for the disk can be counted.
extern "C" int fsync(int file) {
  ++panonav::testing::fsync_calls;
  return static_cast<int>(::syscall(SYS_fsync, file));
}

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

class Export : public MemoryFileTest {
 protected:
  /// A file with a view of each of these names, all with thumbnails.
  MemoryFile file_of(const std::vector<std::string>& names, MemoryHeader header = small_header()) {
    MemoryFile file = MemoryFile::create(path, header);
    Random random(3);
    for (const std::string& name : names) {
      NewView view = random_view(random, header.shape, 1);
      view.info.name = name;
      Panorama panorama(header.shape.rows, header.panorama_columns, header.elevations);
      for (float& value : panorama.values()) value = static_cast<float>(random.uniform(0.0, 1.0));
      view.thumbnail = encode_thumbnail(panorama);
      file.append(view);
    }
    return file;
  }
  fs::path out = folder / "out";
};

TEST_F(Export, NamesThatCannotBeFilesGetOthersAndNothingLeavesTheFolder) {
  const std::vector<std::string> names{"a/b.png",
                                       "a",
                                       "/tmp/x.png",
                                       "../x.png",
                                       "a/../b.png",
                                       "views.csv",
                                       "view_4.png",
                                       "b/",
                                       "line\nbreak",
                                       "dots/..png",
                                       ".",
                                       "a//b.png",
                                       std::string(300, 'x')};
  const MemoryExport done = export_memory(file_of(names), out);
  EXPECT_EQ(done.pictures, names.size());
  EXPECT_EQ(done.renamed, names.size() - 3);
  const Dataset dataset = read_dataset(out);
  ASSERT_EQ(dataset.entries.size(), names.size());
  EXPECT_EQ(dataset.entries[0].file, "a/b.png");
  EXPECT_EQ(dataset.entries[1].file, "view_2.png");
  EXPECT_EQ(dataset.entries[3].file, "view_4.png_") << "another view has the name";
  EXPECT_EQ(dataset.entries[6].file, "view_4.png");
  EXPECT_EQ(dataset.entries[9].file, "dots/..png");
  std::size_t there = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    there += entry.path() != path && entry.path() != out ? 1 : 0;
  }
  EXPECT_EQ(there, 0U);
}

TEST_F(Export, WaitsForTheDiskAsOftenForManyViewsAsForOne) {
  std::vector<std::string> names;
  for (int i = 0; i < 30; ++i) names.push_back(std::to_string(i) + ".png");
  const auto count_calls = [](const std::function<void()>& work) {
    const int before = fsync_calls;
    work();
    return fsync_calls - before;
  };
  MemoryFile file = file_of(names);
  const int of_many = count_calls([&] { (void)export_memory(file, out); });
  std::vector<ViewId> others = file.views();
  others.pop_back();
  file.remove(others);
  EXPECT_EQ(count_calls([&] { (void)export_memory(file, folder / "one"); }), of_many);
  EXPECT_GT(of_many, 0);  // guard
}

TEST_F(Export, SignaturesComeInTheOrderOfTheViews) {
  std::vector<std::string> names;
  for (int i = 0; i < 30; ++i) names.push_back(std::to_string(i) + ".png");
  MemoryFile file = file_of(names);
  file.remove(std::vector<ViewId>{ViewId{7}});
  (void)export_memory(file, out);
  const auto bytes = read_file(out / "signatures.npy", 1U << 20U);
  const SignatureShape shape = file.header().shape;
  ASSERT_EQ(bytes.size() % 64, 29 * 2 * shape.size() % 64);
  const auto values = std::span(bytes).last(29 * 2 * shape.size());
  const VisualMemory memory = file.load();
  for (std::size_t i = 0; i < 29; ++i) {
    const PackedSignature signature = memory.packed(memory.views()[i]);
    const auto row = values.subspan(i * 2 * shape.size(), 2 * shape.size());
    EXPECT_TRUE(std::ranges::equal(row.first(shape.size()), signature.magnitudes));
    EXPECT_TRUE(std::ranges::equal(row.last(shape.size()), signature.phases));
  }
}

TEST_F(Export, WhatSomeViewsLackIsEmptyInTheDataSet) {
  {
    MemoryFile file = file_of({"a.png", "b.png"});
    file.set_pose(ViewId{2}, ReferencePose{1.0, 2.0, {}});
    const MemoryExport done = export_memory(file, out);
    EXPECT_TRUE(done.positions);
    EXPECT_TRUE(done.headings);
    file.set_pose(ViewId{2}, std::nullopt);
    EXPECT_TRUE(export_memory(file, folder / "bare").positions);
  }
  EXPECT_EQ(read_dataset(out).entries[1].pose, (ReferencePose{1.0, 2.0, {}}));
  EXPECT_TRUE(read_dataset(folder / "bare").entries[0].pose);
  EXPECT_FALSE(read_dataset(folder / "bare").entries[1].pose);
}

TEST_F(Export, ThumbnailsTooSmallForTheComponentsAreNoPictures) {
  MemoryHeader header = small_header();
  header.panorama_columns = 512;
  header.shape.components = 129;
  const MemoryExport done = export_memory(file_of({"a.png"}, header), out);
  EXPECT_EQ(done.pictures, 0U);
  EXPECT_FALSE(fs::exists(out / "dataset.toml"));
  EXPECT_TRUE(fs::exists(out / "signatures.npy"));
}

TEST_F(Export, TakesOverWhatAKilledProcessLeftAndNothingElse) {
  const MemoryFile file = file_of({"a.png"});
  fs::create_directory(folder / ".out.tmp.d");
  std::ofstream(folder / ".out.tmp.d" / "b.png") << "half";
  (void)export_memory(file, out);
  EXPECT_FALSE(fs::exists(folder / ".out.tmp.d"));
  EXPECT_FALSE(fs::exists(out / "b.png"));
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { (void)export_memory(file, out); }), "not empty"));
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { (void)export_memory(file, path); }), "not empty"));
  (void)export_memory(file, folder / "new" / "below" / "");
  EXPECT_TRUE(fs::exists(folder / "new" / "below" / "dataset.toml"));
}

TEST_F(Export, ThumbnailsOfWidePanoramasShowTheSameDirections) {
  MemoryHeader header = small_header();
  header.panorama_columns = 512;
  header.shape.rows = 8;
  header.elevations = ElevationBand{-0.2, 0.3};
  Panorama panorama(8, 512, header.elevations);
  for (int y = 0; y < 8; ++y) {
    for (int c = 100; c < 140; ++c) panorama.at(y, c) = y < 4 ? 1.0F : 0.5F;
  }
  const auto back = panorama_from_thumbnail(encode_thumbnail(panorama), header);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->elevations(), panorama.elevations());
  double along = 0.0;
  double weight = 0.0;
  for (int c = 0; c < 512; ++c) {
    along += static_cast<double>(back->at(1, c)) * c;
    weight += static_cast<double>(back->at(1, c));
  }
  EXPECT_NEAR(along / weight, 119.5, 0.05) << "turned against the panorama";
  EXPECT_NEAR(back->at(6, 120), 0.5, 0.02);
  EXPECT_EQ(image_format(encode_thumbnail(panorama), "thumbnail"), ImageFormat::jpeg);
  const Panorama narrow(8, 256, header.elevations);
  EXPECT_EQ(image_format(encode_thumbnail(narrow), "thumbnail"), ImageFormat::png);
  EXPECT_FALSE(panorama_from_thumbnail(std::vector<std::uint8_t>{1, 2, 3}, header));
  header.panorama_columns = 90;
  EXPECT_FALSE(panorama_from_thumbnail(encode_thumbnail(panorama), header)) << "of another size";
}

}  // namespace
}  // namespace panonav::testing
