// Refuses bad input to `memorise`, and keeps the memory whole.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "command/memorise.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

// Each of these must be refused with one line that names the culprit, and nothing may be lost.
class BadInput : public Memorise {
 protected:
  void SetUp() override {
    Memorise::SetUp();
    first_ = folder_ / "first";
    write_dataset(first_, world_, {{-1.0, -1.0, 0.0}, {-1.0, -0.5, 0.0}});
    fs::rename(first_ / view_name(0), first_ / "a.png");
    fs::rename(first_ / view_name(1), first_ / "b.png");
    write_text(first_ / "poses.csv", "file,x_m,y_m,heading_deg\na.png,-1,-1,0\nb.png,-1,-0.5,0\n");
    run_well({"memorise", memory(), first_});
  }
  void expect_refused(const std::vector<std::string>& words, int views_kept_at_least = 2) {
    const auto line = refusal({"memorise", memory(), data(), "--strict"});
    for (const auto& word : words) EXPECT_TRUE(contains(line, word));
    EXPECT_GE(views_in(memory()), views_kept_at_least);
    run_well({"verify", memory()});
  }
  fs::path first_;
};

TEST_F(BadInput, WrongPicturesAreNamed) {
  const std::string name = view_name(5);
  fs::remove(data() / name);
  expect_refused({name});
  write_text(data() / name, "this is no image");
  expect_refused({name});
  write_picture(data() / name, world_, {0.0, 0.0, 0.0});
  fs::resize_file(data() / name, fs::file_size(data() / name) / 2);
  expect_refused({name});
  write_picture(data() / name, world_, {0.0, 0.0, 0.0}, 96, 9);
  expect_refused({name, "9", "12"});
  const std::vector<std::tuple<int, int, std::vector<std::string>>> sizes{{96, 9, {"9", "12"}},
                                                                          {80, 12, {"80", "96"}}};
  for (const auto& [columns, rows, words] : sizes) {
    for (std::size_t i = 0; i < 16; ++i) {
      write_picture(data() / view_name(i), world_, {0.0, 0.0, 0.0}, columns, rows);
    }
    expect_refused(words);
  }
}

TEST_F(BadInput, WrongTablesAreNamed) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> tables{
      {"file,x_m,y_m,heading_deg\n", {}},
      {"file,x_m,y_m,heading_deg\nview_000.png,0,nan,0\nview_001.png,0,0,0\n", {"y_m", "nan"}},
      {"file,x_m,y_m,heading_deg\nview_000.png,0,1\n", {}},
      {"file,x_m,heading_deg\nview_000.png,0,1\n", {"y_m"}},
      {"file,x_m,y_m,heading_deg\nview_001.png,0,0,0\nview_001.png,1,0,0\n", {"view_001.png"}}};
  for (const auto& [text, words] : tables) {
    write_text(data() / "poses.csv", text);
    expect_refused(with({"poses.csv"}, words));
  }
}

TEST_F(BadInput, EmptyFolder) {
  fs::remove_all(data());
  fs::create_directory(data());
  expect_refusal({"memorise", memory(), data(), "--kind", "panorama"}, "data");
}

TEST_F(BadInput, ZeroComponents) {
  expect_refusal({"memorise", folder_ / "new.panonav", data(), "--components", "0"}, "components");
  EXPECT_FALSE(fs::exists(folder_ / "new.panonav"));
}

TEST_F(BadInput, DirectoryThatCannotBeWritten) {
  // Root may write anywhere but into what is no real folder.
  expect_refusal({"memorise", "/proc/m.panonav", data()}, "/proc");
  expect_refusal({"memorise", folder_ / "no/such/folder/m.panonav", data()}, "no/such");
}

TEST_F(BadInput, FilesThatAreNoMemory) {
  write_text(folder_ / "text.panonav", "hello");
  expect_refusal({"memorise", folder_ / "text.panonav", data()}, "text.panonav");
  EXPECT_EQ(fs::file_size(folder_ / "text.panonav"), 5U) << "a foreign file was changed";
  expect_refusal({"info", folder_ / "text.panonav"}, "text.panonav");
  expect_refusal({"verify", folder_ / "text.panonav"}, "text.panonav");
}

TEST_F(BadInput, FullDiskWhileAppendingKeepsWhatWasAppended) {
  const auto result = run_panonav({"memorise", memory(), data()},
                                  {.file_size_limit_bytes = 16384, .kill_after_ms = {}});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_EQ(lines(result.err).size(), 1U) << result.err;
  EXPECT_GE(views_in(memory()), 2);
  run_well({"verify", memory()});
  ASSERT_EQ(run_panonav({"memorise", memory(), data()}).exit_code, 0) << "resumes";
  EXPECT_EQ(views_in(memory()), 18);
}

TEST_F(BadInput, KilledMemoriseResumes) {
  write_dataset(data(), world_, grid_poses(15));
  const std::string whole = folder_ / "whole.panonav";
  run_well({"memorise", whole, data()});
  const std::string killed_memory = folder_ / "killed.panonav";
  int killed = 0;
  for (int delay_ms = 5; delay_ms < 400; delay_ms += delay_ms < 40 ? 5 : 60) {
    const auto result = run_panonav({"memorise", killed_memory, data()},
                                    {.file_size_limit_bytes = {}, .kill_after_ms = delay_ms});
    killed += result.signal == 9 ? 1 : 0;
    if (fs::exists(killed_memory)) {
      run_well({"verify", killed_memory});
    }
  }
  EXPECT_GE(killed, 3);
  run_well({"memorise", killed_memory, data()});
  EXPECT_EQ(views_in(killed_memory), 225);
  // A resumed memory answers like one that was made in one go.
  const auto a = run_panonav({"localise", whole, data(), "--json", "--turn-randomly", "1"});
  const auto b = run_panonav({"localise", killed_memory, data(), "--json", "--turn-randomly", "1"});
  EXPECT_EQ(a.exit_code, 0);
  EXPECT_EQ(a.out, b.out);
}

}  // namespace
}  // namespace panonav::testing
