#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "command_runner.hpp"
#include "landmark_world.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json info_of(const std::string& memory) {
  const auto result = run_panonav({"info", memory, "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result.exit_code == 0 ? json::parse(result.out) : json();
}

int views_in(const std::string& memory) {
  return info_of(memory).value("views", -1);
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

class Memorise : public ::testing::Test {
 protected:
  void SetUp() override { write_dataset(data(), world_, grid_poses(4)); }
  [[nodiscard]] fs::path data() const { return folder_.path() / "data"; }
  [[nodiscard]] std::string memory() const { return folder_ / "m.panonav"; }

  TemporaryFolder folder_;
  LandmarkWorld world_{5};
};

TEST_F(Memorise, SaysWhatItDidAndInfoAgrees) {
  const auto result = run_panonav({"memorise", data(), memory(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto said = json::parse(result.out);
  EXPECT_EQ(said["appended"], 16);
  EXPECT_EQ(said["known_before"], 0);
  const auto info = info_of(memory());
  EXPECT_EQ(info["views"], 16);
  EXPECT_EQ(info["rows"], 12);
  EXPECT_EQ(info["components"], 15);
  EXPECT_EQ(info["views_with_position"], 16);
  EXPECT_EQ(info["views_with_heading"], 16);
  const auto verified = run_panonav({"verify", memory(), "--json"});
  EXPECT_EQ(verified.exit_code, 0);
  EXPECT_EQ(json::parse(verified.out)["intact"], true);
}

TEST_F(Memorise, SecondTimeThereIsNothingToDo) {
  ASSERT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0);
  const auto again = run_panonav({"memorise", data(), memory(), "--json"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(json::parse(again.out)["appended"], 0);
  EXPECT_EQ(json::parse(again.out)["known_before"], 16);
  EXPECT_EQ(views_in(memory()), 16);
}

TEST_F(Memorise, PanoramasAreResampledToTheSizeAskedFor) {
  ASSERT_EQ(run_panonav({"memorise", data(), memory(), "--rows", "6", "--columns", "48"}).exit_code,
            0);
  const auto info = info_of(memory());
  EXPECT_EQ(info["rows"], 6);
  EXPECT_EQ(info["panorama_columns"], 48);
  EXPECT_EQ(info["views"], 16);
  // Asking resamples in the same way, so that every view finds itself.
  const auto asked = run_panonav({"localise", memory(), data(), "--json"});
  ASSERT_EQ(asked.exit_code, 0) << asked.err;
  const auto answers = lines(asked.out);
  ASSERT_EQ(answers.size(), 16U);
  for (const auto& line : answers) {
    const auto answer = json::parse(line);
    EXPECT_EQ(answer["matches"][0]["file"], answer["file"]);
    EXPECT_EQ(answer["matches"][0]["dissimilarity"], 0);
  }
  // Pictures of another size than the recording's are still refused, on both ways in.
  world_.write_picture(data() / view_name(5), {0.0, 0.0, 0.0}, 48, 6);
  auto line = refusal({"localise", memory(), data()});
  EXPECT_NE(line.find(view_name(5) + ": rows is 6; allowed: 12"), std::string::npos) << line;
  line = refusal({"memorise", data(), folder_ / "o.panonav", "--rows", "6", "--columns", "48"});
  EXPECT_NE(line.find(view_name(5)), std::string::npos) << line;
  EXPECT_FALSE(fs::exists(folder_ / "o.panonav"));
}

TEST_F(Memorise, AResumedMemoryTakesNoOtherPictureUnderAKnownName) {
  ASSERT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0);
  // Same name, same pose, one other picture out of sixteen.
  world_.write_picture(data() / view_name(6), {1.7, 0.1, 0.0});
  auto line = refusal({"memorise", data(), memory()});
  EXPECT_NE(line.find("m.panonav"), std::string::npos) << line;
  EXPECT_NE(line.find("another picture under the name " + view_name(6)), std::string::npos) << line;
  // The robot turned on the spot: the same place, but another view.
  world_.write_picture(data() / view_name(6), {0.5, 1.0, 0.4});
  line = refusal({"memorise", data(), memory()});
  EXPECT_NE(line.find(view_name(6)), std::string::npos) << line;
  // The true picture written anew is the same view.
  world_.write_picture(data() / view_name(6), grid_poses(4)[6]);
  EXPECT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0);
  fs::remove(data() / view_name(6));
  line = refusal({"memorise", data(), memory()});
  EXPECT_NE(line.find(view_name(6)), std::string::npos) << line;
  EXPECT_EQ(views_in(memory()), 16);
}

TEST_F(Memorise, AResumedMemoryTakesNoOtherPoseUnderAKnownName) {
  ASSERT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0);
  auto moved = grid_poses(4);
  moved[9].x_m += 0.01;
  write_dataset(data(), world_, moved);
  const auto line = refusal({"memorise", data(), memory()});
  EXPECT_NE(line.find(view_name(9)), std::string::npos) << line;
  EXPECT_EQ(views_in(memory()), 16);
}

TEST_F(Memorise, WhatWasForgottenAndReplacedIsComparedAgain) {
  ASSERT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0);
  ASSERT_EQ(run_panonav({"forget", memory(), view_name(6)}).exit_code, 0);
  const auto other = folder_.path() / "other";
  auto poses = grid_poses(4);
  write_dataset(other, LandmarkWorld(99), poses);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i != 6) fs::remove(other / view_name(i));
  }
  write_text(other / "poses.csv", "file,x_m,y_m,heading_deg\nview_006.png,0.5,1,0\n");
  ASSERT_EQ(run_panonav({"memorise", other, memory()}).exit_code, 0);
  const auto line = refusal({"memorise", data(), memory()});
  EXPECT_NE(line.find(view_name(6)), std::string::npos) << line;
}

TEST_F(Memorise, TakesAFolderOfImagesWithoutPoses) {
  fs::remove(data() / "dataset.toml");
  const auto result = run_panonav({"memorise", data(), memory(), "--kind", "panorama", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto info = info_of(memory());
  EXPECT_EQ(info["views"], 16);
  EXPECT_EQ(info["views_with_position"], 0);
}

TEST_F(Memorise, AFolderWithoutDatasetTomlNeedsAKind) {
  fs::remove(data() / "dataset.toml");
  EXPECT_NE(refusal({"memorise", data(), memory()}).find("--kind"), std::string::npos);
  EXPECT_FALSE(fs::exists(memory()));
}

TEST_F(Memorise, ForgetDropsViewsByNameAndRefusesUnknownOnes) {
  ASSERT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0);
  const auto line = refusal({"forget", memory(), view_name(2), "never_seen.png"});
  EXPECT_NE(line.find("never_seen.png"), std::string::npos);
  EXPECT_EQ(views_in(memory()), 16) << "a refused forget must forget nothing";
  EXPECT_EQ(run_panonav({"forget", memory(), view_name(2), view_name(3)}).exit_code, 0);
  EXPECT_EQ(views_in(memory()), 14);
}

TEST_F(Memorise, OptionsComeFromFlagsAndFromAFile) {
  write_text(folder_.path() / "options.toml", "[signature]\ncomponents = 7\n");
  ASSERT_EQ(
      run_panonav({"memorise", data(), memory(), "--config", folder_ / "options.toml"}).exit_code,
      0);
  EXPECT_EQ(info_of(memory())["components"], 7);
  const auto other = folder_ / "other.panonav";
  ASSERT_EQ(run_panonav({"memorise", data(), other, "--config", folder_ / "options.toml",
                         "--components", "5"})
                .exit_code,
            0);
  EXPECT_EQ(info_of(other)["components"], 5);
}

TEST_F(Memorise, WrongOptionsInAFileAreRefusedByName) {
  const std::string config = folder_ / "options.toml";
  write_text(config, "[signature]\ncomponentz = 7\n");
  auto line = refusal({"memorise", data(), memory(), "--config", config});
  EXPECT_NE(line.find("options.toml"), std::string::npos) << line;
  EXPECT_NE(line.find("componentz"), std::string::npos) << line;
  write_text(config, "[signatures]\ncomponents = 7\n");
  line = refusal({"memorise", data(), memory(), "--config", config});
  EXPECT_NE(line.find("signatures"), std::string::npos) << line;
  write_text(config, "[signature]\ncomponents = 0\n");
  line = refusal({"memorise", data(), memory(), "--config", config});
  EXPECT_NE(line.find("components"), std::string::npos) << line;
  write_text(config, "not toml [");
  line = refusal({"memorise", data(), memory(), "--config", config});
  EXPECT_NE(line.find("options.toml"), std::string::npos) << line;
  EXPECT_NE(
      refusal({"memorise", data(), memory(), "--config", folder_ / "no.toml"}).find("no.toml"),
      std::string::npos);
  EXPECT_FALSE(fs::exists(memory()));
}

// Each of these must be refused with one line that names the culprit, and nothing may be lost.
class BadInput : public Memorise {
 protected:
  void SetUp() override {
    Memorise::SetUp();
    first_ = folder_.path() / "first";
    write_dataset(first_, world_, {{-1.0, -1.0, 0.0}, {-1.0, -0.5, 0.0}});
    fs::rename(first_ / view_name(0), first_ / "a.png");
    fs::rename(first_ / view_name(1), first_ / "b.png");
    write_text(first_ / "poses.csv", "file,x_m,y_m,heading_deg\na.png,-1,-1,0\nb.png,-1,-0.5,0\n");
    ASSERT_EQ(run_panonav({"memorise", first_, memory()}).exit_code, 0);
  }
  void expect_refused(const std::vector<std::string>& words, int views_kept_at_least = 2) {
    const auto line = refusal({"memorise", data(), memory()});
    for (const auto& word : words) EXPECT_NE(line.find(word), std::string::npos) << line;
    EXPECT_GE(views_in(memory()), views_kept_at_least);
    EXPECT_EQ(run_panonav({"verify", memory()}).exit_code, 0);
  }
  fs::path first_;
};

TEST_F(BadInput, MissingImage) {
  fs::remove(data() / view_name(5));
  expect_refused({view_name(5)});
}

TEST_F(BadInput, UndecodableImage) {
  write_text(data() / view_name(5), "this is no picture");
  expect_refused({view_name(5)});
}

TEST_F(BadInput, ImageCutShort) {
  fs::resize_file(data() / view_name(5), fs::file_size(data() / view_name(5)) / 2);
  expect_refused({view_name(5)});
}

TEST_F(BadInput, WrongSize) {
  world_.write_picture(data() / view_name(5), {0.0, 0.0, 0.0}, 96, 9);
  expect_refused({view_name(5), "9", "12"});
}

TEST_F(BadInput, EmptyDataSet) {
  write_text(data() / "poses.csv", "file,x_m,y_m,heading_deg\n");
  expect_refused({"poses.csv"});
}

TEST_F(BadInput, EmptyFolder) {
  fs::remove_all(data());
  fs::create_directory(data());
  const auto line = refusal({"memorise", data(), memory(), "--kind", "panorama"});
  EXPECT_NE(line.find("data"), std::string::npos) << line;
}

TEST_F(BadInput, PoseThatIsNoNumber) {
  write_text(data() / "poses.csv",
             "file,x_m,y_m,heading_deg\nview_000.png,0,nan,0\nview_001.png,0,0,0\n");
  expect_refused({"poses.csv", "y_m", "nan"});
}

TEST_F(BadInput, MissingPoseField) {
  write_text(data() / "poses.csv", "file,x_m,y_m,heading_deg\nview_000.png,0,1\n");
  expect_refused({"poses.csv"});
  write_text(data() / "poses.csv", "file,x_m,heading_deg\nview_000.png,0,1\n");
  expect_refused({"poses.csv", "y_m"});
}

TEST_F(BadInput, DuplicateNames) {
  write_text(data() / "poses.csv",
             "file,x_m,y_m,heading_deg\nview_001.png,0,0,0\nview_001.png,1,0,0\n");
  expect_refused({"poses.csv", "view_001.png"});
}

TEST_F(BadInput, ZeroComponents) {
  const auto line = refusal({"memorise", data(), folder_ / "new.panonav", "--components", "0"});
  EXPECT_NE(line.find("components"), std::string::npos) << line;
  EXPECT_FALSE(fs::exists(folder_ / "new.panonav"));
}

TEST_F(BadInput, RowsThatDoNotMatchTheMemory) {
  for (std::size_t i = 0; i < 16; ++i) {
    world_.write_picture(data() / view_name(i), {0.0, 0.0, 0.0}, 96, 9);
  }
  expect_refused({"9", "12"});
}

TEST_F(BadInput, ColumnsThatDoNotMatchTheMemory) {
  for (std::size_t i = 0; i < 16; ++i) {
    world_.write_picture(data() / view_name(i), {0.0, 0.0, 0.0}, 80, 12);
  }
  expect_refused({"80", "96"});
}

TEST_F(BadInput, DirectoryThatCannotBeWritten) {
  // Root may write anywhere but into what is no real folder.
  EXPECT_NE(refusal({"memorise", data(), "/proc/m.panonav"}).find("/proc"), std::string::npos);
  EXPECT_NE(refusal({"memorise", data(), folder_ / "no/such/folder/m.panonav"}).find("no/such"),
            std::string::npos);
}

TEST_F(BadInput, FilesThatAreNoMemory) {
  write_text(folder_.path() / "text.panonav", "hello");
  EXPECT_NE(refusal({"memorise", data(), folder_ / "text.panonav"}).find("text.panonav"),
            std::string::npos);
  EXPECT_EQ(fs::file_size(folder_.path() / "text.panonav"), 5U) << "a foreign file was changed";
  EXPECT_NE(refusal({"info", folder_ / "text.panonav"}).find("text.panonav"), std::string::npos);
  EXPECT_NE(refusal({"verify", folder_ / "text.panonav"}).find("text.panonav"), std::string::npos);
}

TEST_F(BadInput, FullDiskWhileAppendingKeepsWhatWasAppended) {
  const auto size = fs::file_size(memory());
  const auto result = run_panonav({"memorise", data(), memory()},
                                  {.file_size_limit_bytes = size + 16384, .kill_after_ms = {}});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_EQ(lines(result.err).size(), 1U) << result.err;
  EXPECT_GE(views_in(memory()), 2);
  EXPECT_EQ(run_panonav({"verify", memory()}).exit_code, 0);
  ASSERT_EQ(run_panonav({"memorise", data(), memory()}).exit_code, 0) << "resumes";
  EXPECT_EQ(views_in(memory()), 18);
}

TEST_F(BadInput, KilledMemoriseResumes) {
  write_dataset(data(), world_, grid_poses(15));
  const auto whole = folder_ / "whole.panonav";
  ASSERT_EQ(run_panonav({"memorise", data(), whole}).exit_code, 0);
  const auto killed_memory = folder_ / "killed.panonav";
  int killed = 0;
  for (int delay_ms = 5; delay_ms < 400; delay_ms += delay_ms < 40 ? 5 : 60) {
    const auto result = run_panonav({"memorise", data(), killed_memory},
                                    {.file_size_limit_bytes = {}, .kill_after_ms = delay_ms});
    killed += result.signal == 9 ? 1 : 0;
    if (fs::exists(killed_memory)) {
      EXPECT_EQ(run_panonav({"verify", killed_memory}).exit_code, 0);
    }
  }
  EXPECT_GE(killed, 3);
  ASSERT_EQ(run_panonav({"memorise", data(), killed_memory}).exit_code, 0);
  EXPECT_EQ(views_in(killed_memory), 225);
  // What was resumed answers as what was made in one go.
  const auto a = run_panonav({"localise", whole, data(), "--json", "--turn-randomly", "1"});
  const auto b = run_panonav({"localise", killed_memory, data(), "--json", "--turn-randomly", "1"});
  EXPECT_EQ(a.exit_code, 0);
  EXPECT_EQ(a.out, b.out);
}

}  // namespace
}  // namespace panonav::testing
