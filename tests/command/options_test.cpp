// Refuses options that have no effect, or that contradict the memory they are used with.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/options.hpp"
#include "panonav/panorama/preprocessing.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

/// A line that types an option where it does nothing, and what makes it do something.
struct Unused {
  std::string line;
  std::string flag;
  std::string instead;  ///< added to the line, the option counts
};

// Files are not there: what is wrong with the options is said before they are looked for.
TEST(Usage, AnOptionThatDoesNothingIsRefused) {
  const std::string on_navigate = "navigate m --goal 1 --scene office ";
  const std::vector<Unused> all{
      {"localise m x --area-tolerance 1", "--area-tolerance", "--areas"},
      {"home a b --rising true", "--rising", "--iterations 2"},
      {"home a b --starting-estimates 3 --turn sequential", "--starting-estimates", ""},
      {"home a b --horizon --tilt true", "--tilt", ""},
      {"route follow m x --no-odometry --recovery-m 1", "--recovery-m", ""},
      {"route follow m x --levels 1 --coarse-deg 2", "--coarse-deg", ""},
      {"map x m --close-loops false --closure-min-loop-m 3", "--closure-min-loop-m", ""},
      {"map x m --close-loops false --graph-settled-m 3", "--graph-settled-m", ""},
      {"map x m --turn-components 3", "--turn-components", "--rule published"},
      {"map x m --rule published --nearer-side true", "--nearer-side", ""},
      {"arrange m --motion-turn-deviation-rad 1", "--motion-turn-deviation-rad", "--odometry x"},
      {"calibrate a -o c --xi 0.9", "--xi", "--profile unified"},
      {"calibrate a -o c --mirror-a-mm 9", "--mirror-a-mm", "--profile hyperboloidal"},
      {"calibrate a -o c --profile unified --inner-elevation-deg 9", "--inner-elevation-deg", ""},
      {"evaluate a b --align none --align-reflection true", "--align-reflection", ""},
      {"catchment x --ahead 2 --up-to-m 1", "--up-to-m", ""},
      {"catchment x --ahead 2 --max-step-m 1", "--max-step-m", ""},
      {"catchment x --goal y", "--goal", "--report r"},
      {"simulate none o --rows 30", "--rows", "--kind panorama"},
      {"simulate none o --kind panorama --vignetting 0.1", "--vignetting", ""},
      {"simulate none o --moved-seed 2", "--moved-seed", "--moved-objects 0.1"},
      {"simulate none o --occluders 2", "--occluders", "--occluded-fraction 0.1"},
      {"simulate none o --light-azimuth-rad 2", "--light-azimuth-rad", "--directional-light 0.1"},
      {"simulate none o --eight-bit false", "--eight-bit", ""},
      {"simulate none o --grid 1 --spacing-m 2", "--spacing-m", ""},
      {"simulate none o --random 3 --poses 2", "--poses", ""},
      {"simulate none o --poses 2", "--poses", "--path walk"},
      {"simulate none o --random 3 --speed-m-s 2", "--speed-m-s", ""},
      {"simulate none o --random 3 --odometry-drive holonomic", "--odometry-drive", ""},
      {"simulate none o --trajectory t --heading random", "--heading", ""},
      {"simulate none o --path tour --heading-rad 1", "--heading-rad", "--heading fixed"},
      {on_navigate + "--route-max-lateral-m 2", "--route-max-lateral-m", "--route r"},
      {on_navigate + "--strategy steady --coarse 2", "--coarse", ""},
      {on_navigate + "--strategy recovering --fine 2", "--fine", ""},
      {on_navigate + "--moved-seed 2", "--moved-seed", "--moved-objects 0.1"},
  };
  for (const Unused& one : all) {
    EXPECT_TRUE(contains(refusal(words_of(one.line)), one.flag + " has no effect")) << one.line;
    if (one.instead.empty()) continue;
    const auto used = run_panonav(words_of(one.line + " " + one.instead));
    EXPECT_EQ(used.exit_code, 2);
    EXPECT_FALSE(contains(used.err, "has no effect")) << one.line << " " << one.instead;
  }
}

// One file serves several verbs, so what it says of unused things is no mistake.
TEST(Usage, AConfigFileMaySayMoreThanAVerbUses) {
  const TemporaryFolder folder;
  std::ofstream(folder / "c.toml") << "[accuracy]\ntolerance = 1\n";
  EXPECT_FALSE(
      contains(refusal({"localise", "m", "x", "--config", folder / "c.toml"}), "has no effect"));
}

/// Shows another value of each option, as it would be typed.
class OtherValues final : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& value) override { add(info, std::to_string(value + 1)); }
  void visit(const OptionInfo& info, double& value) override { add(info, to_text(value + 1.0)); }
  void visit(const OptionInfo& info, bool& value) override { add(info, value ? "false" : "true"); }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    add(info, std::string(choices[static_cast<std::size_t>(value == 0 ? 1 : 0)]));
  }
  struct Typed {
    std::string name, flag, value;
  };
  std::vector<Typed> typed;

 private:
  void add(const OptionInfo& info, const std::string& value) {
    std::string flag = "--" + std::string(info.name);
    std::ranges::replace(flag, '_', '-');
    typed.push_back({std::string(info.name), flag, value});
  }
};

template <class Options>
std::vector<OtherValues::Typed> other_values(Options options) {
  OtherValues visitor;
  visit_options(options, visitor);
  return visitor.typed;
}

TEST(Usage, AMemoryKeepsEveryOptionThatItWasMadeWith) {
  const TemporaryFolder folder;
  const std::string data = folder / "data";
  const std::string memory = folder / "m.panonav";
  write_dataset(data, landmark_world(5), grid_poses(2));
  run_well({"memorise", memory, data});
  const auto info = answer_of({"info", memory, "--json"});
  const SignatureOptions kept{info["rows"].get<int>(), info["panorama_columns"].get<int>(),
                              info["components"].get<int>()};
  const auto signature = other_values(kept);
  const auto preprocessing = other_values(PreprocessingOptions{});
  ASSERT_GE(preprocessing.size(), 5U);
  const auto refused = [&](std::vector<std::string> line, const OtherValues::Typed& other,
                           const std::string& section) {
    const auto typed = refusal(with(line, {other.flag, other.value}));
    EXPECT_TRUE(contains(typed, other.flag + " is " + other.value + "; allowed: ")) << typed;
    EXPECT_TRUE(contains(typed, "as " + memory + " was made with")) << typed;
    std::ofstream(folder / "c.toml") << section << "\n"
                                     << other.name << " = " << other.value << "\n";
    expect_refusal(with(line, {"--config", folder / "c.toml"}), other.flag + " is ");
  };
  for (const auto& other : signature) {
    refused({"memorise", memory, data}, other, "[signature]");
    refused({"map", memory, data}, other, "[signature]");
    if (other.name != "components") {
      refused({"home", "1", data, "--memory", memory}, other, "[signature]");
    }
  }
  for (const auto& other : preprocessing) {
    refused({"memorise", memory, data}, other, "[preprocessing]");
    refused({"home", "1", data, "--memory", memory}, other, "[preprocessing]");
  }
  // The same values are no contradiction.
  std::vector<std::string> same{"--rows", std::to_string(kept.rows), "--components",
                                std::to_string(kept.components)};
  run_well(with({"memorise", memory, data, "--remove-mean", "true"}, same));
  run_well(with({"map", memory, data}, same));
  run_well(with({"home", "1", data, "--memory", memory}, same));
}

TEST(Usage, AMemoryKeepsItsBandOfElevations) {
  const TemporaryFolder folder;
  const std::string data = folder / "data";
  const std::string memory = folder / "m.panonav";
  write_dataset(data, landmark_world(5), grid_poses(3));
  for (const char* table : {"dataset.toml", "poses.csv"}) {
    std::filesystem::remove(std::filesystem::path(data) / table);
  }
  const std::vector<std::string> kind{"--kind", "panorama", "--elevation-deg"};
  run_well(with(with({"memorise", memory, data}, kind), {"-30", "40"}));
  for (const std::vector<std::string>& line :
       std::vector<std::vector<std::string>>{{"memorise", memory, data},
                                             {"localise", memory, data},
                                             {"map", memory, data},
                                             {"home", "1", data, "--memory", memory}}) {
    EXPECT_TRUE(contains(refusal(with(with(line, kind), {"-60", "60"})),
                         "--elevation-deg is -60 60; allowed: -30 40, the band of " + memory))
        << line.front();
    EXPECT_EQ(run_panonav(with(with(line, kind), {"-30", "40"})).exit_code, 0) << line.front();
  }
}

// The message names what is missing, the file, the field names, and an example line.
TEST(Usage, AFolderOfPicturesAloneIsToldHowToBecomeADataSet) {
  const TemporaryFolder folder;
  const std::string bare = folder / "bare";
  write_dataset(bare, landmark_world(5), grid_poses(2));
  run_well({"memorise", folder / "m.panonav", bare});
  for (const char* table : {"dataset.toml", "poses.csv"}) {
    std::filesystem::remove(std::filesystem::path(bare) / table);
  }
  std::vector<std::vector<std::string>> all{{"arrange", folder / "m.panonav", "--odometry", bare}};
  all.push_back({"catchment", bare});
  for (const auto& line : all) {
    const auto said = refusal(line);
    EXPECT_TRUE(contains(said, "has no dataset.toml")) << said;
    EXPECT_TRUE(contains(said, "[poses] file = \"poses.csv\"")) << said;
    const std::string odometry = line.front() == "arrange" ? "odom_" : "";
    EXPECT_TRUE(contains(said, "file," + odometry + "x_m," + odometry + "y_m")) << said;
    EXPECT_TRUE(contains(said, "such as " + view_name(0) + ",1.5,0.25,90")) << said;
  }
}

}  // namespace
}  // namespace panonav::testing
