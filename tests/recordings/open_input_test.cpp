// One way to open an input, for the command and for Python.
#include "panonav/pipeline/open_input.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/register_recordings.hpp"
#include "support/picture_samples.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::recordings {
using namespace testing;
namespace {

namespace fs = std::filesystem;

class OpenInput : public ::testing::Test {
 protected:
  void SetUp() override {
    const Image picture = smooth_image(16, 8, 1);
    for (const std::string name : {"data/a.png", "data/b.png", "photos/view_9.png",
                                   "photos/view_10.png", "photos/evening/view_1.png"}) {
      fs::create_directories((folder_ / name).parent_path());
      write_png(folder_ / name, picture.view());
    }
    folder_.write("data/dataset.toml",
                  "[images]\nkind = \"equirectangular\"\n[list]\nfile = \"images.csv\"\n");
    folder_.write("data/images.csv", "file,stamp_s\na.png,0\nb.png,1\n");
    folder_.write("photos/notes.txt", "mine");
  }
  [[nodiscard]] std::string refusal(const std::string& name, const InputOptions& options) const {
    return message_of<OptionError>([&] { (void)open_input(folder_ / name, options); });
  }
  [[nodiscard]] std::string fault(const std::string& name, const InputOptions& options) const {
    return message_of<FileError>([&] { (void)open_input(folder_ / name, options); });
  }

  TemporaryFolder folder_;
  const PictureSource panorama_{.kind = PictureKind::panorama};
};

// The first test: the others register readers.
TEST_F(OpenInput, AKindThatIsNotRegisteredIsNamed) {
  folder_.write("drive.mcap", "\x89MCAP0\r\n");
  folder_.write("walk.MP4", "");
  fs::create_directory(folder_ / "bag");
  folder_.write("bag/metadata.yaml", "rosbag2_bagfile_information:\n");
  ASSERT_FALSE(has_dataset_reader("recording"));
  for (const std::string name : {"drive.mcap", "bag"}) {
    EXPECT_EQ(fault(name, {.source = panorama_}),
              (folder_ / name).string() +
                  ": is a recording, and this program reads no recordings: no reader of that kind "
                  "is registered");
  }
  EXPECT_TRUE(contains(fault("walk.MP4", {}), "is a video, and this program reads no videos"));
  register_recordings();
  register_recordings();
  ASSERT_TRUE(has_dataset_reader("recording"));
  ASSERT_TRUE(has_dataset_reader("video"));
  EXPECT_EQ(find_dataset_reader(folder_ / "drive.mcap")->name, "recording");
  EXPECT_FALSE(contains(fault("drive.mcap", {.source = panorama_}), "registered"));
  EXPECT_FALSE(find_dataset_reader(folder_ / "data"));
}

TEST_F(OpenInput, ADataSetDescribesItself) {
  const Dataset opened = open_input(folder_ / "data", {.default_source = panorama_});
  EXPECT_EQ(opened.source.kind, PictureKind::equirectangular);
  EXPECT_EQ(opened.entries.size(), 2U);
  EXPECT_TRUE(opened.warnings.empty());
  EXPECT_TRUE(
      contains(refusal("data", {.source = panorama_}),
               "has a dataset.toml, which gives the type of its images; leave out 'source'"));
  EXPECT_TRUE(contains(refusal("data", {.recursive = true}), "leave out the option recursive"));
  EXPECT_TRUE(contains(refusal("data", {.topics = {.imu = "/imu"}}),
                       "has no topics; leave out the option imu_topic"));
  const auto later = open_input(folder_ / "data", {.selection = {.from_s = 0.5}});
  ASSERT_EQ(later.entries.size(), 1U);
  EXPECT_EQ(later.entries[0].file, "b.png");
}

TEST_F(OpenInput, PicturesLieAsTheCallerSays) {
  const Dataset flat = open_input(folder_ / "photos", {.default_source = panorama_});
  EXPECT_EQ(flat.entries.size(), 2U);
  EXPECT_EQ(flat.warnings, (std::vector<std::string>{"left out, no image: notes.txt",
                                                     "left out, folders within: evening/"}));
  const Dataset deep = open_input(folder_ / "photos", {.source = panorama_, .recursive = true});
  EXPECT_EQ(deep.entries.size(), 3U);
  ASSERT_EQ(deep.warnings.size(), 2U);
  EXPECT_TRUE(contains(deep.warnings[1], "is 16 x 8 px; an image of the whole sphere"));
  EXPECT_TRUE(contains(fault("photos", {}),
                       "has no dataset.toml; set the type of the images with 'source'"));
  EXPECT_TRUE(contains(fault("missing", {.source = panorama_}), "there is no such file or folder"));
  const std::string one = "photos/view_9.png";
  EXPECT_EQ(open_input(folder_ / one, {.default_source = panorama_}).entries.size(), 1U);
  EXPECT_TRUE(contains(refusal(one, {.source = panorama_, .recursive = true}),
                       "is one image; the option recursive can only be used with a folder"));
  EXPECT_TRUE(contains(
      refusal(one, {.source = panorama_, .selection = {.every = 2}}),
      "is one image; 'from_s', 'to_s' and the option every can only be used with a recording"));
}

TEST_F(OpenInput, RadiansInThePlaceOfDegreesAreHinted) {
  folder_.write("data/dataset.toml",
                "[images]\nkind = \"panorama\"\nelevation_deg = [-0.5, 0.7]\n[list]\nfile = "
                "\"images.csv\"\n");
  const Dataset opened = open_input(folder_ / "data");
  ASSERT_EQ(opened.warnings.size(), 1U);
  EXPECT_TRUE(contains(opened.warnings[0], "is -0.5 to 0.7 degrees; are these radians?"));
}

TEST_F(OpenInput, AReaderIsReplacedByOneOfItsName) {
  const auto is_toy = [](const fs::path& path) { return path.extension() == ".toy"; };
  const DatasetReader empty{
      "toy", false, is_toy,
      [](const fs::path& path, const PictureSource& source, const InputOptions& /*options*/) {
        return Dataset{.folder = path, .source = source, .warnings = {"empty"}};
      }};
  register_dataset_reader(empty);
  EXPECT_EQ(open_input("walk.toy", {.default_source = panorama_}).warnings,
            std::vector<std::string>{"walk.toy: empty"});
  DatasetReader other = empty;
  other.read = [](const fs::path& path, const PictureSource& source,
                  const InputOptions& /*options*/) {
    return Dataset{.folder = path, .source = source};
  };
  register_dataset_reader(other);
  EXPECT_TRUE(open_input("walk.toy", {.default_source = panorama_}).warnings.empty());
  EXPECT_TRUE(contains(message_of<OptionError>([&] {
                         (void)open_input("walk.toy",
                                          {.source = panorama_, .topics = {.image = "/a"}});
                       }),
                       "walk.toy has no topics; leave out the option image_topic"));
  EXPECT_TRUE(contains(message_of<OptionError>([&] {
                         (void)open_input("walk.toy", {.source = panorama_, .recursive = true});
                       }),
                       "walk.toy is a toy; leave out the option recursive"));
  EXPECT_THROW(register_dataset_reader({"half", false, is_toy, nullptr}), ContractError);
}

}  // namespace
}  // namespace panonav::recordings
