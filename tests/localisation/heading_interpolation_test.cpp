#include "panonav/localisation/internal/heading_interpolation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "panonav/geometry/angles.hpp"

namespace panonav {
namespace {

// References on the corners of a square of 1 m, whose compass errs by `slope_rad` for each metre by
// which the robot stands to the left of them.
struct Square {
  explicit Square(double slope_rad, Point2 robot, double robot_heading_rad)
      : memory({1, 2}, 1.0F, std::nullopt), position{robot.x_m, robot.y_m} {
    for (const auto& [x_m, y_m] : {Point2{0, 0}, Point2{1, 0}, Point2{0, 1}, Point2{1, 1}}) {
      const double reference_heading_rad = 0.3 + x_m;
      const std::string name = std::to_string(matches.size());
      const ViewId view =
          memory.append(PackedSignature{{1, 2}, {9, 9}, {0, 0}},
                        {name, ReferencePose{x_m, y_m, reference_heading_rad}, std::nullopt});
      PlaceMatch match{.name = name, .view = view};
      match.column_difference = 0.2 + 0.1 * std::hypot(x_m - robot.x_m, y_m - robot.y_m);
      match.heading_rad = robot_heading_rad - reference_heading_rad + slope_rad * (robot.y_m - y_m);
      matches.push_back(match);
    }
  }
  VisualMemory memory;
  PositionEstimate position;
  std::vector<PlaceMatch> matches;
};

TEST(HeadingInterpolation, RemovesTheErrorThatGrowsWithTheDisplacement) {
  constexpr double heading_rad =
      3.1;  // the mean of the references' crosses the end of the interval
  for (const Point2 robot : {Point2{0.5, 0.5}, Point2{0.2, 0.9}, Point2{0.1, 0.2}}) {
    const Square square(radians(6.0), robot, heading_rad);
    const auto found = interpolate_heading(square.memory, square.matches, square.position);
    ASSERT_TRUE(found);
    EXPECT_NEAR(angle_difference(*found, heading_rad), 0.0, radians(0.7));
    // Without a position, the weighted mean is all that is known.
    const auto mean = interpolate_heading(square.memory, square.matches, std::nullopt);
    ASSERT_TRUE(mean);
    EXPECT_LE(std::abs(angle_difference(*found, heading_rad)),
              0.6 * std::abs(angle_difference(*mean, heading_rad)) + 1e-6);
  }
}

TEST(HeadingInterpolation, LeavesOutOutliersAndKnowsNothingWithoutHeadings) {
  Square square(0.0, {0.5, 0.5}, 1.0);
  *square.matches[2].heading_rad += radians(90.0);
  const auto found = interpolate_heading(square.memory, square.matches, square.position);
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, 1.0, 1e-9);
  // On a line of references nothing is known across it, and the plane is flat.
  square.matches.resize(2);
  const auto along = interpolate_heading(square.memory, square.matches, square.position);
  ASSERT_TRUE(along);
  EXPECT_NEAR(*along, 1.0, 1e-9);
  for (PlaceMatch& match : square.matches) match.heading_rad.reset();
  EXPECT_FALSE(interpolate_heading(square.memory, square.matches, square.position));
}

}  // namespace
}  // namespace panonav
