#include "panonav/pipeline/observation_source.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

Image make_stripes(int width, int height) {
  Image picture(width, height, 3);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u)
      picture.at(u, v) = static_cast<std::uint8_t>(40 * u + 9 * v * u);
  }
  return picture;
}

/// A folder with usable pictures and one of each fault.
class Unusable : public ::testing::Test {
 protected:
  void SetUp() override {
    const Image whole = make_stripes(64, 32);
    const Image other = make_stripes(64, 16);
    auto png = encode_png(whole.view());
    auto jpeg = encode_jpeg(whole.view());
    for (const char* name : {"a.png", "b.png", "z.png"}) write_file(folder / name, png);
    write_file(folder / "c.jpg", jpeg);
    write_file(folder / "other.png", encode_png(other.view()));
    write_file(folder / "empty.jpg", std::string_view());
    write_file(folder / "text.png", std::string_view("this is no image"));
    png[png.size() / 2] ^= 0x55U;
    write_file(folder / "flipped.png", png);
    jpeg.resize(jpeg.size() - 60);
    write_file(folder / "cut.jpg", jpeg);
  }
  static std::vector<std::string> names_of(const Dataset& dataset) {
    std::vector<std::string> names;
    for (const auto& one : dataset.unusable) names.push_back(one.file);
    return names;
  }
  TemporaryFolder folder;
};

TEST_F(Unusable, PicturesAreTakenOutAndNamed) {
  const std::vector<std::string> bad{"cut.jpg", "empty.jpg", "flipped.png", "other.png",
                                     "text.png"};
  for (const PictureKind kind : {PictureKind::panorama, PictureKind::equirectangular}) {
    for (const int threads : {1, 3}) {
      Dataset dataset = read_picture_folder(folder.path(), {.kind = kind});
      Executor executor(threads);
      leave_out_unusable_pictures(dataset, executor);
      EXPECT_EQ(dataset.entries.size(), 4U);
      EXPECT_EQ(names_of(dataset), bad);
      for (const auto& one : dataset.unusable) {
        EXPECT_TRUE(contains(one.describe(), (folder / one.file).string() + ": "))
            << one.describe();
        EXPECT_FALSE(one.fault.empty());
      }
    }
  }
}

TEST_F(Unusable, NothingLeftIsAnError) {
  for (const char* name : {"a.png", "b.png", "z.png", "c.jpg", "other.png"}) {
    fs::remove(folder / name);
  }
  Dataset dataset = read_picture_folder(folder.path(), {});
  Executor executor;
  const std::string error =
      message_of<FileError>([&] { leave_out_unusable_pictures(dataset, executor); });
  EXPECT_TRUE(contains(error, "cut.jpg")) << error;
}

TEST_F(Unusable, CheckingAnImageFindsWhatReadingFinds) {
  for (const auto& file : fs::directory_iterator(folder.path())) {
    std::string reading;
    std::string checking;
    ImageSize size;
    try {
      size = read_image(file.path()).size();
    } catch (const FileError& error) {
      reading = error.what();
    }
    try {
      EXPECT_EQ(check_image(file.path()), size) << file.path();
    } catch (const FileError& error) {
      checking = error.what();
    }
    EXPECT_EQ(checking, reading);
  }
}

}  // namespace
}  // namespace panonav::testing
