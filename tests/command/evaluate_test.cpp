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

TEST_F(Evaluate, NoCommonTimeIsNoAnswer) {
  write("truth.tum", lines_of(tum));
  write("later.tum", lines_of([](int i, double x, double y) { return tum(i + 1000, x, y); }));
  const auto result = run_panonav({"evaluate", folder_ / "later.tum", folder_ / "truth.tum"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(lines(result.err).size(), 1U) << result.err;
  EXPECT_TRUE(contains(result.err, "later.tum"));
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

}  // namespace
}  // namespace panonav::testing
