#include "panonav_recordings/video_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/dataset_readers.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav_recordings/internal/foreign_pictures.hpp"
#include "support/comma_locale.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

namespace fs = std::filesystem;

Image noise(int number) {
  Image picture(64, 32, 3);
  Random random(7, static_cast<std::uint64_t>(number));
  for (auto& value : picture.pixels()) value = static_cast<std::uint8_t>(random.index(256));
  return picture;
}

/// 20 pictures of noise, 10 a second, in a video without loss.
class Video : public ::testing::Test {
 protected:
  static constexpr int count = 20;

  void SetUp() override {
    for (int i = 0; i < count; ++i) {
      const Image picture = noise(i);
      write_png(folder / ("n" + std::to_string(i) + ".png"), picture.view());
    }
  }
  [[nodiscard]] fs::path make(const std::string& name, const std::string& codec) const {
    const fs::path video = folder / name;
    const std::string command = "ffmpeg -nostdin -v error -framerate 10 -i " +
                                quote_for_shell((folder / "n%d.png").string()) + " " + codec + " " +
                                quote_for_shell(video.string());
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return video;
  }
  TemporaryFolder folder;
};

TEST_F(Video, IsReadByAProgramWithDecimalCommas) {
  const fs::path file = make("walk.mkv", "-c:v ffv1 -pix_fmt bgr0");
  PANONAV_REQUIRE_COMMA_LOCALE(locale);
  const Dataset video = read_video(file, {});
  ASSERT_EQ(video.entries.size(), 20U);
  EXPECT_NEAR(video.entries.back().stamp_s.value(), 1.9, 1e-6);
  EXPECT_EQ(read_picture(video.entries[1]), noise(1));
}

TEST_F(Video, EveryPictureComesWithItsPixelsAndItsStamp) {
  for (const auto& [name, codec] : {std::pair{"it's a walk.mp4", "-c:v libx264rgb -qp 0"},
                                    {"walk.mkv", "-c:v ffv1 -pix_fmt bgr0"},
                                    {"walk.avi", "-c:v ffv1 -pix_fmt bgr0"},
                                    {"walk.mov", "-c:v png"}}) {
    const Dataset video = read_video(make(name, codec), {});
    ASSERT_EQ(video.entries.size(), count) << name;
    for (int i = 0; i < count; ++i) {
      const auto& entry = video.entries[static_cast<std::size_t>(i)];
      EXPECT_NEAR(*entry.stamp_s, 0.1 * i, 1e-3) << name;
      EXPECT_EQ(read_picture(entry), noise(i)) << name << " " << i;
    }
  }
}

TEST_F(Video, PicturesCanBeReadInAnyOrderAndFromSeveralThreads) {
  const Dataset video = read_video(make("walk.mp4", "-c:v libx264rgb -qp 0"), {});
  for (const int i : {7, 3, 3, 19, 0, 18, 5, 6}) {
    EXPECT_EQ(read_picture(video.entries[static_cast<std::size_t>(i)]), noise(i)) << i;
  }
  std::vector<std::thread> threads;
  std::array<bool, count> right{};
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = t; i < count; i += 4) {
        const auto n = static_cast<std::size_t>(i);
        right[n] = read_picture(video.entries[n]) == noise(i);
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(std::ranges::count(right, true), count);
}

TEST_F(Video, ASelectionTakesTheSamePicturesAsOfAFolderWithStamps) {
  const fs::path file = make("walk.mp4", "-c:v libx264rgb -qp 0");
  const auto numbers = [&](const Dataset::Selection& selection) {
    std::vector<int> found;
    for (const auto& entry : read_video(file, {}, selection).entries) {
      const Image picture = read_picture(entry);
      for (int i = 0; i < count; ++i) {
        if (picture == noise(i)) found.push_back(i);
      }
      EXPECT_NEAR(*entry.stamp_s, 0.1 * found.back(), 1e-6);
    }
    return found;
  };
  using Numbers = std::vector<int>;
  EXPECT_EQ(numbers({.every_s = 0.5}), (Numbers{0, 5, 10, 15}));
  EXPECT_EQ(numbers({.every_s = 0.25}), (Numbers{0, 3, 6, 9, 12, 15, 18}));
  EXPECT_EQ(numbers({.every = 6}), (Numbers{0, 6, 12, 18}));
  EXPECT_EQ(numbers({.from_s = 1.0, .to_s = 1.3}), (Numbers{10, 11, 12, 13}));
  EXPECT_EQ(numbers({.every = 2, .every_s = 0.2, .from_s = 0.3, .to_s = 1.5}),
            (Numbers{3, 7, 11, 15}));
  const std::string error =
      message_of<FileError>([&] { (void)read_video(file, {}, {.from_s = 30.0}); });
  EXPECT_NE(error.find("no image in the requested time"), std::string::npos) << error;
}

TEST_F(Video, CutAndForeignFilesAreRefusedInOneLine) {
  const fs::path whole = make("walk.mkv", "-c:v ffv1 -pix_fmt bgr0");
  const auto bytes = fs::file_size(whole);
  fs::copy_file(whole, folder / "cut.mkv");
  fs::resize_file(folder / "cut.mkv", bytes / 2);
  const Dataset cut = read_video(folder / "cut.mkv", {});
  ASSERT_GE(cut.entries.size(), 5U);
  EXPECT_LT(cut.entries.size(), std::size_t{count});
  for (std::size_t i = 0; i + 1 < cut.entries.size(); ++i) {
    EXPECT_EQ(read_picture(cut.entries[i]), noise(static_cast<int>(i)));
  }
  const auto refused = [&](const fs::path& file) {
    const std::string error = message_of<FileError>([&] { (void)read_video(file, {}); });
    EXPECT_NE(error.find(file.filename().string()), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  };
  std::ofstream(folder / "empty.mp4").flush();
  refused(folder / "empty.mp4");
  // The camera writes the index (moov) at the end.
  const fs::path unfinished = make("unfinished.mp4", "-c:v libx264rgb -qp 0");
  fs::resize_file(unfinished, fs::file_size(unfinished) / 2);
  refused(unfinished);
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)read_video(unfinished, {}); }),
                       "has no index (moov), because the recording was cut off"));
  std::ofstream(folder / "text.mp4") << "this is not a video\n" << std::string(5000, 'x');
  refused(folder / "text.mp4");
  refused(folder / "missing.mp4");
  // A list of other files and addresses is no video, whatever its name.
  std::ofstream(folder / "list.mkv") << "#EXTM3U\n#EXTINF:1,\nhttp://127.0.0.1:9/x.ts\n";
  refused(folder / "list.mkv");
}

TEST_F(Video, PicturesBeyondTheLimitsAreRefusedBeforeTheyAreDecoded) {
  const Dataset video = read_video(make("walk.mp4", "-c:v libx264rgb -qp 0"), {}, {},
                                   ImageLimits{.side_px = 32768, .area_px = 1000});
  const std::string error =
      message_of<FileError>([&] { (void)read_picture(video.entries.front()); });
  EXPECT_NE(error.find("64 x 32"), std::string::npos) << error;
}

// Cameras give videos names of their own, and a name does not make a video.
TEST_F(Video, ContentDecidesWhatAFileIs) {
  for (const auto& [name, codec] : {std::pair{"walk.insv", "-c:v libx264rgb -qp 0 -f mp4"},
                                    {"walk.lrv", "-c:v ffv1 -pix_fmt bgr0 -f matroska"},
                                    {"walk", "-c:v ffv1 -pix_fmt bgr0 -f avi"}}) {
    const fs::path file = make(name, codec);
    EXPECT_TRUE(is_video(file)) << name;
    const Dataset video = read_video(file, {});
    ASSERT_EQ(video.entries.size(), count) << name;
    EXPECT_EQ(read_picture(video.entries[4]), noise(4)) << name;
  }
  const fs::path stream = make("walk.ts", "-c:v mpeg2video -pix_fmt yuv420p -f mpegts -r 25");
  EXPECT_TRUE(is_video(stream));
  const Dataset video = read_video(stream, {});
  EXPECT_GE(video.entries.size(), std::size_t{count});
  EXPECT_EQ(read_picture(video.entries[2]).size(), (ImageSize{64, 32}));
  fs::copy_file(folder / "n0.png", folder / "picture.mp4");
  EXPECT_FALSE(is_video(folder / "picture.mp4"));
  EXPECT_FALSE(is_video(folder / "n0.png"));
  EXPECT_FALSE(is_video(folder.path())) << "a folder of images and videos";
}

TEST_F(Video, TheTracksOfTwoLensesAreSetSideBySide) {
  const std::string halves =
      "-filter_complex \"[0]split[a][b];[a]crop=32:32:0:0[l];[b]crop=32:32:32:0[r]\" "
      "-map \"[l]\" -map \"[r]\" -c:v ffv1 -pix_fmt bgr0 -f matroska";
  const Dataset video = read_video(make("lenses.insv", halves), {});
  ASSERT_EQ(video.entries.size(), count);
  for (const int i : {0, 1, 7, 3, 19}) {
    EXPECT_EQ(read_picture(video.entries[static_cast<std::size_t>(i)]), noise(i)) << i;
  }
  EXPECT_NEAR(*video.entries[7].stamp_s, 0.7, 1e-3);
  // The faces of a cube map are no lenses; another track of another size is a preview.
  const std::string cube =
      "-filter_complex \"[0]split[a][b];[a]scale=96:32[l];[b]scale=96:32[r]\" -map \"[l]\" -map "
      "\"[r]\" -c:v ffv1 -f matroska";
  const fs::path max = make("GS010001.360", cube);
  const std::string error = message_of<FileError>([&] { (void)read_video(max, {}); });
  EXPECT_TRUE(contains(error, "GS010001.360")) << error;
  EXPECT_TRUE(contains(error, "cube")) << error;
  // The command that the error names makes a video of 360 degree images.
  const std::string convert = error.substr(error.find("ffmpeg -i"));
  EXPECT_EQ(std::system(("cd " + quote_for_shell(folder.path().string()) + " && " + convert +
                         " -nostdin -v error")
                            .c_str()),
            0)
      << convert;
  const Dataset sphere = read_video(folder / "equirectangular.mp4", {});
  ASSERT_EQ(sphere.entries.size(), count);
  EXPECT_EQ(read_picture(sphere.entries[0]).size(), (ImageSize{128, 64}));
  const std::string preview =
      "-filter_complex \"[0]split[a][b];[a]scale=16:8[l]\" -map \"[l]\" -map \"[b]\" -c:v ffv1 "
      "-pix_fmt bgr0 -f matroska";
  const Dataset large = read_video(make("both.mkv", preview), {});
  EXPECT_EQ(read_picture(large.entries[5]), noise(5));
}

TEST_F(Video, FilesOfTwoLensesAreSetSideBySide) {
  const auto lens = [&](const std::string& name, const std::string& crop) {
    return make(name, "-vf crop=" + crop + " -c:v ffv1 -pix_fmt bgr0 -f matroska");
  };
  const fs::path left = lens("VID_20261127_101010_00_001.insv", "32:32:0:0");
  EXPECT_EQ(read_picture(read_video(left, {}).entries[3]).size(), (ImageSize{32, 32}));
  const fs::path right = lens("VID_20261127_101010_10_001.insv", "32:32:32:0");
  const fs::path both = folder / "both";
  fs::create_directory(both);
  fs::copy_file(left, both / left.filename());
  fs::copy_file(right, both / right.filename());
  std::ofstream(both / "LRV_20261127_101010_11_001.insv") << std::ifstream(left).rdbuf();
  using Files = std::vector<fs::path>;
  for (const Files& typed :
       {Files{left}, Files{right}, Files{left, right}, Files{right, left}, Files{both}}) {
    const Dataset video = read_videos(typed, {});
    ASSERT_EQ(video.entries.size(), count) << typed.front();
    for (const int i : {0, 1, 7, 3, 19}) {
      EXPECT_EQ(read_picture(video.entries[static_cast<std::size_t>(i)]), noise(i)) << i;
    }
    EXPECT_TRUE(video.warnings.empty());
  }
  // The name alone makes no pair.
  const fs::path wide = lens("VID_20261127_101010_00_002.insv", "64:32:0:0");
  fs::copy_file(wide, folder / "VID_20261127_101010_10_002.insv");
  EXPECT_TRUE(contains(message_of<FileError>([&] { (void)read_video(wide, {}); }),
                       "VID_20261127_101010_10_002.insv: is not the second lens of "));
}

TEST_F(Video, FoldersOfWebPAreReadAsThoseOfPng) {
  fs::create_directory(folder / "web");
  (void)make("web/w%d.webp", "-c:v libwebp -lossless 1 -f image2");
  register_foreign_picture_store(make_foreign_picture_store);
  const auto open = [&] { return open_input(folder / "web", {.source = PictureSource{}}); };
  const Dataset web = open();
  ASSERT_EQ(web.entries.size(), count);
  EXPECT_EQ(web.entries[9].file, "w10.webp");  // numbers from 1 on
  for (const int i : {9, 0, 19}) {
    EXPECT_EQ(read_picture(web.entries[static_cast<std::size_t>(i)]), noise(i)) << i;
  }
  EXPECT_EQ(read_picture(read_foreign_picture(folder / "web" / "w3.webp", {}).entries.at(0)),
            noise(2));
  // With those of other kinds, in the order of names; what is no image is named.
  fs::copy_file(folder / "n0.png", folder / "web" / "a.png");
  const Image jpeg = noise(5);
  write_file(folder / "web" / "w3_b.jpg", encode_jpeg(jpeg.view()));
  std::ofstream(folder / "web" / "notes.txt") << "text";
  Dataset mixed = open();
  ASSERT_EQ(mixed.entries.size(), count + 2U);
  EXPECT_EQ(mixed.entries[0].file, "a.png");
  EXPECT_EQ(mixed.entries[3].file, "w3.webp");
  EXPECT_EQ(mixed.entries[4].file, "w3_b.jpg");
  EXPECT_EQ(mixed.entries[5].file, "w4.webp");
  EXPECT_EQ(read_picture(mixed.entries[0]), noise(0));
  EXPECT_EQ(read_picture(mixed.entries[5]), noise(3));
  ASSERT_FALSE(mixed.warnings.empty());
  EXPECT_EQ(mixed.warnings[0], "left out, no image: notes.txt");
  // A damaged one is taken out and named, of any kind, and in any position.
  const std::string whole = bytes_of(folder / "web" / "w1.webp");
  write_file(folder / "web" / "w1.webp", std::string_view(whole).substr(0, 40));
  std::ofstream(folder / "web" / "w2.png") << "no image";
  mixed = open();
  Executor executor(1);
  leave_out_unusable_pictures(mixed, executor);
  EXPECT_EQ(mixed.entries.size(), count + 1U);
  ASSERT_EQ(mixed.unusable.size(), 2U);
  EXPECT_EQ(mixed.unusable[0].file, "w1.webp");
  EXPECT_EQ(mixed.unusable[1].file, "w2.png");
}

TEST_F(Video, TablesMayNameWebP) {
  fs::create_directory(folder / "set");
  (void)make("set/w%d.webp", "-c:v libwebp -lossless 1 -f image2");
  fs::copy_file(folder / "n0.png", folder / "set" / "a.png");
  std::ofstream(folder / "set" / "dataset.toml")
      << "[images]\nkind = \"panorama\"\n[list]\nfile = \"images.csv\"\n";
  std::ofstream(folder / "set" / "images.csv") << "file\nw2.webp\na.png\nw1.webp\n";
  register_foreign_picture_store(make_foreign_picture_store);
  const Dataset set = open_input(folder / "set", {});
  ASSERT_EQ(set.entries.size(), 3U);
  EXPECT_EQ(read_picture(set.entries[0]), noise(1));
  EXPECT_EQ(read_picture(set.entries[1]), noise(0));
  EXPECT_EQ(read_picture(set.entries[2]), noise(0));
}

TEST_F(Video, ChaptersAreOneVideo) {
  const fs::path chapters = folder / "chapters";
  fs::create_directory(chapters);
  const std::string codec = "-c:v ffv1 -pix_fmt bgr0 -f matroska ";
  // In order 0 .. 8, 9 .. 14, 15 .. 19, and a preview.
  (void)make("chapters/GX010007.MP4", "-vf trim=end_frame=9 " + codec);
  (void)make("chapters/GX020007.MP4",
             "-vf trim=start_frame=9:end_frame=15,setpts=PTS-STARTPTS " + codec);
  (void)make("chapters/GX010012.MP4", "-vf trim=start_frame=15,setpts=PTS-STARTPTS " + codec);
  (void)make("chapters/GL010007.LRV", "-vf trim=end_frame=3 " + codec);
  std::ofstream(chapters / "._GX010007.MP4") << "companion";
  EXPECT_TRUE(is_video(chapters));
  const Dataset joined = read_video(chapters, {});
  ASSERT_EQ(joined.entries.size(), count);
  for (int i = 0; i < count; ++i) {
    const auto& entry = joined.entries[static_cast<std::size_t>(i)];
    EXPECT_NEAR(*entry.stamp_s, 0.1 * i, 2e-3);
    EXPECT_EQ(read_picture(entry), noise(i)) << i;
  }
  EXPECT_EQ(joined.entries[9].file, "GX020007.MP4@0.000000");
  ASSERT_EQ(joined.warnings.size(), 1U);
  EXPECT_TRUE(contains(joined.warnings[0], "GX010007.MP4, GX020007.MP4, GX010012.MP4"));
  const Dataset some = read_video(chapters, {}, {.every_s = 0.5});
  ASSERT_EQ(some.entries.size(), 4U);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(read_picture(some.entries[static_cast<std::size_t>(i)]), noise(5 * i)) << i;
  }
  const Dataset listed = read_videos({chapters / "GX020007.MP4", chapters / "GX010012.MP4"}, {});
  ASSERT_EQ(listed.entries.size(), 11U);
  EXPECT_EQ(read_picture(listed.entries[10]), noise(19));
  const fs::path other = make("small.mkv", "-vf scale=32:16 -c:v ffv1 -pix_fmt bgr0");
  const std::string error = message_of<FileError>([&] {
    (void)read_videos({chapters / "GX010007.MP4", other}, {});
  });
  EXPECT_TRUE(contains(error, "small.mkv") && contains(error, "32 x 16")) << error;
}

}  // namespace
}  // namespace panonav::recordings
