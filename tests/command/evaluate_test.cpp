#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/command_runner.hpp"

namespace panonav::testing {
namespace {

using nlohmann::json;

class Evaluate : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
  }
  /// A way around a corner, 8 poses, with `text(i, x, y, heading)` for each line.
  template <class Line>
  [[nodiscard]] static std::string lines_of(Line line) {
    std::string text;
    for (int i = 0; i < 8; ++i) {
      const double x = i < 4 ? i : 4.0;
      const double y = i < 4 ? 0.0 : i - 3.0;
      text += line(i, x, y);
    }
    return text;
  }
  [[nodiscard]] static std::string tum(int i, double x, double y) {
    return std::to_string(i) + " " + std::to_string(x) + " " + std::to_string(y) + " 0 0 0 0 1\n";
  }
  TemporaryFolder folder_;
};

TEST_F(Evaluate, AShiftedCopyIsRightOnceAligned) {
  write("truth.tum", lines_of(tum));
  write("shifted.tum",
        lines_of([](int i, double x, double y) { return tum(i, x + 3.0, y - 1.0); }));
  const auto said =
      answer_of({"evaluate", folder_ / "shifted.tum", folder_ / "truth.tum", "--json"});
  for (const char* key : {"formats", "paired_by", "pairs", "left_out", "alignment", "ate_m",
                          "rotation_rad", "relative_pairs", "rpe_m", "rpe_rotation_rad"}) {
    EXPECT_TRUE(said.contains(key)) << key;
  }
  EXPECT_EQ(said["pairs"], 8);
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  EXPECT_NEAR(said["alignment"]["x_m"], -3.0, 1e-9);
  EXPECT_NEAR(said["alignment"]["y_m"], 1.0, 1e-9);
  const auto as_is = run_panonav(
      {"evaluate", folder_ / "shifted.tum", folder_ / "truth.tum", "--align", "none", "--json"});
  EXPECT_NEAR(json::parse(as_is.out)["ate_m"]["rmse"], std::sqrt(10.0), 1e-9);
}

TEST_F(Evaluate, TextForPeopleSaysTheSame) {
  write("truth.tum", lines_of(tum));
  write("shifted.tum", lines_of([](int i, double x, double y) { return tum(i, x + 3.0, y); }));
  const auto result =
      run_panonav({"evaluate", folder_ / "shifted.tum", folder_ / "truth.tum", "--align", "none"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(contains(result.out, "8 poses compared"));
  EXPECT_TRUE(contains(result.out, "RMSE 3.000000"));
  EXPECT_TRUE(contains(result.out, "estimate: TUM, ground truth: TUM"));
  EXPECT_TRUE(contains(result.out, "no alignment"));
}

TEST_F(Evaluate, CameraAxesAreAlignedInSpace) {
  write("truth.tum", lines_of(tum));
  // The same path in axes of a camera: x right, y down, z forward.
  write("camera.tum", lines_of([](int i, double x, double y) {
          return std::to_string(i) + " " + std::to_string(-y) + " 0 " + std::to_string(x) +
                 " 0 0 0 1\n";
        }));
  const std::vector<std::string> call{"evaluate", folder_ / "camera.tum", folder_ / "truth.tum"};
  const auto said = answer_of(with(call, {"--json"}));
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  EXPECT_EQ(said["alignment"]["dimensions"], 3);
  EXPECT_EQ(said["alignment"]["kind"], "rigid");
  EXPECT_TRUE(contains(run_panonav(call).out, "rigid alignment in space (SE3)"));
  EXPECT_TRUE(contains(run_panonav(with(call, {"--align", "similarity"})).out,
                       "similarity alignment in space (Sim3), scale 1.000000"));
  EXPECT_TRUE(contains(run_panonav({"evaluate", folder_ / "truth.tum", folder_ / "truth.tum"}).out,
                       "rigid alignment in the plane"));
}

TEST_F(Evaluate, PosesWithoutStampsArePairedByTheirOrder) {
  write("truth.tum", lines_of(tum));
  write("poses.txt", lines_of([](int, double x, double y) {
          return "1 0 0 " + std::to_string(x + 3.0) + " 0 1 0 " + std::to_string(y) + " 0 0 1 0\n";
        }));
  const std::vector<std::string> call{"evaluate", folder_ / "poses.txt", folder_ / "truth.tum"};
  const auto said = answer_of(with(call, {"--json"}));
  EXPECT_EQ(said["formats"], (json{"KITTI", "TUM"}));
  EXPECT_EQ(said["paired_by"], "order");
  EXPECT_EQ(said["pairs"], 8);
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  EXPECT_TRUE(contains(run_panonav(call).out, "paired by their order"));
  write("fewer.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n");
  expect_refusal({"evaluate", folder_ / "fewer.txt", folder_ / "truth.tum"},
                 "number of estimated poses is 2; allowed: 8");
}

TEST_F(Evaluate, ViewStepsAreNotComparedWithMetres) {
  write("truth.tum", lines_of(tum));
  write("steps.tum", "# unit: view steps\n" + lines_of([](int i, double x, double y) {
                       return tum(i, 4.0 * x, 4.0 * y);
                     }));
  const std::vector<std::string> call{"evaluate", folder_ / "steps.tum", folder_ / "truth.tum"};
  const auto said = answer_of(with(call, {"--json"}));
  EXPECT_EQ(said["alignment"]["kind"], "similarity");
  EXPECT_NEAR(said["alignment"]["scale"], 0.25, 1e-9);
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  EXPECT_TRUE(contains(run_panonav(call).err, "view steps"));
  for (const char* align : {"rigid", "none"}) {
    expect_refusal(with(call, {"--align", align}), "allowed: similarity");
  }
  const std::vector<std::string> both{"evaluate", folder_ / "steps.tum", folder_ / "steps.tum"};
  EXPECT_TRUE(contains(run_panonav(both).out, "ATE [view steps]"));
  EXPECT_TRUE(answer_of(with(both, {"--json"})).contains("ate_steps"));
}

TEST_F(Evaluate, ImageNumbersAreNoStamps) {
  write("numbers.tum", "# stamps: image numbers\n" + lines_of([](int i, double x, double y) {
                         return i == 3 ? "" : tum(i, x, y);
                       }));
  write("poses.csv", "file,x_m,y_m,heading_deg\n" + lines_of([](int i, double x, double y) {
                       return std::to_string(i) + ".png," + std::to_string(x) + "," +
                              std::to_string(y) + ",0\n";
                     }));
  const std::vector<std::string> call{"evaluate", folder_ / "numbers.tum", folder_ / "poses.csv"};
  const auto said = answer_of(with(call, {"--json"}));
  EXPECT_EQ(said["paired_by"], "image_number");
  EXPECT_EQ(said["pairs"], 7);
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  // The stamps 0 to 7 of the truth are seconds, not numbers of images.
  write("truth.tum", lines_of(tum));
  expect_refusal({"evaluate", folder_ / "numbers.tum", folder_ / "truth.tum"},
                 "number of estimated poses is 7; allowed: 8");
}

TEST_F(Evaluate, PositionsSufficeForTheAte) {
  write("estimate.tum", lines_of(tum));
  write("truth.csv", "stamp_s,x_m,y_m\n" + lines_of([](int i, double x, double y) {
                       return std::to_string(i) + "," + std::to_string(x) + "," +
                              std::to_string(y + 1) + "\n";
                     }));
  const std::vector<std::string> call{"evaluate", folder_ / "estimate.tum", folder_ / "truth.csv"};
  const auto said = answer_of(with(call, {"--json"}));
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  EXPECT_TRUE(said["rotation_rad"].is_null());
  EXPECT_TRUE(said["rpe_m"].is_null());
  const auto text = run_panonav(call).out;
  EXPECT_TRUE(contains(text, "no headings"));
  EXPECT_FALSE(contains(text, "rotation [degrees]"));
}

TEST_F(Evaluate, NoCommonTimeIsNoAnswer) {
  write("truth.tum", lines_of(tum));
  write("later.tum", lines_of([](int i, double x, double y) { return tum(i + 1000, x, y); }));
  const auto result = run_panonav({"evaluate", folder_ / "later.tum", folder_ / "truth.tum"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(lines(result.err).size(), 1U) << result.err;
  EXPECT_TRUE(contains(result.err, "later.tum"));
  EXPECT_TRUE(contains(result.err, "--max-stamp-difference-s"));
  EXPECT_TRUE(contains(result.err, "estimate are 1000 to 1007, those of the truth 0 to 7"));
  write("half.tum",
        lines_of([](int i, double x, double y) { return tum(i < 4 ? i : i + 1000, x, y); }));
  const auto half = run_panonav({"evaluate", folder_ / "half.tum", folder_ / "truth.tum"});
  EXPECT_TRUE(contains(half.out,
                       "4 without ground truth within 0.01 s "
                       "(--max-stamp-difference-s)"));
}

TEST_F(Evaluate, BrokenFilesAreNamedWithLineAndField) {
  write("truth.tum", lines_of(tum));
  const auto refused = [&](const std::string& name, const std::string& text) {
    write(name, text);
    const auto line = refusal({"evaluate", folder_ / name, folder_ / "truth.tum"});
    EXPECT_TRUE(contains(line, name));
    return line;
  };
  EXPECT_TRUE(contains(refused("nan.tum", "0 nan 0 0 0 0 0 1\n"), "nan"));
  (void)refused("short.tum", "0 1 2\n");
  (void)refused("empty.tum", "");
  (void)refused("back.tum", "1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n");
  EXPECT_TRUE(contains(refused("columns.csv", "stamp_s,x_m,heading_deg\n0,1,0\n"), "y_m"));
  expect_refusal({"evaluate", folder_ / "no.tum", folder_ / "truth.tum"}, "no.tum");
  expect_refusal(
      {"evaluate", folder_ / "truth.tum", folder_ / "truth.tum", "--relative-distance-m", "-1"},
      "relative_distance_m is -1");
}

TEST_F(Evaluate, ADataSetIsTheTruthByItsPoses) {
  write("truth.tum", lines_of(tum));
  std::filesystem::create_directory(std::string(folder_ / "run"));
  const std::vector<std::string> call{"evaluate", folder_ / "truth.tum", folder_ / "run"};
  expect_refusal(call, "a folder without poses.csv; allowed: a data set with poses.csv");
  write("run/poses.csv",
        "file,stamp_s,x_m,y_m,heading_deg\n" + lines_of([](int i, double x, double y) {
          return "v.png," + std::to_string(i) + "," + std::to_string(x) + "," + std::to_string(y) +
                 ",0\n";
        }));
  EXPECT_EQ(answer_of(with(call, {"--json"}))["pairs"], 8);
  EXPECT_EQ(answer_of({"evaluate", folder_ / "run", folder_ / "truth.tum", "--json"})["pairs"], 8);
}

TEST_F(Evaluate, FewPairsAreNoted) {
  write("truth.tum", tum(0, 0.0, 0.0) + tum(1, 1.0, 0.0) + tum(5, 4.0, 2.0));
  write("half.tum", lines_of(tum).substr(0, 5 * tum(0, 0.0, 0.0).size()));
  write("all.tum", lines_of(tum));
  const auto few = run_panonav({"evaluate", folder_ / "all.tum", folder_ / "truth.tum"});
  EXPECT_TRUE(contains(few.err, "only 3 of 8 estimated poses have a true pose")) << few.err;
  EXPECT_TRUE(
      contains(few.err, "the stamps of the estimate are 0 to 7, those of the truth 0 to 5"));
  const auto whole = run_panonav({"evaluate", folder_ / "truth.tum", folder_ / "all.tum"});
  EXPECT_FALSE(contains(whole.err, "true pose")) << whole.err;
}

}  // namespace
}  // namespace panonav::testing
