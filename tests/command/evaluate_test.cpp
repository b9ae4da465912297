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
  for (const char* key : {"pairs", "left_out", "alignment", "ate_m", "heading_rad",
                          "relative_pairs", "rpe_m", "rpe_heading_rad"}) {
    EXPECT_TRUE(said.contains(key)) << key;
  }
  EXPECT_EQ(said["pairs"], 8);
  EXPECT_NEAR(said["ate_m"]["rmse"], 0.0, 1e-9);
  EXPECT_NEAR(said["alignment"]["x_m"], -3.0, 1e-9);
  EXPECT_NEAR(said["alignment"]["y_m"], 1.0, 1e-9);
  const auto as_is = run_panonav(
      {"evaluate", folder_ / "shifted.tum", folder_ / "truth.tum", "--align", "false", "--json"});
  EXPECT_NEAR(json::parse(as_is.out)["ate_m"]["rmse"], std::sqrt(10.0), 1e-9);
}

TEST_F(Evaluate, TextForPeopleSaysTheSame) {
  write("truth.tum", lines_of(tum));
  write("shifted.tum", lines_of([](int i, double x, double y) { return tum(i, x + 3.0, y); }));
  const auto result =
      run_panonav({"evaluate", folder_ / "shifted.tum", folder_ / "truth.tum", "--align", "false"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_TRUE(contains(result.out, "8 poses compared"));
  EXPECT_TRUE(contains(result.out, "RMSE 3.000"));
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
