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
#include "panonav/core/random.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/image_file.hpp"
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

}  // namespace
}  // namespace panonav::recordings
