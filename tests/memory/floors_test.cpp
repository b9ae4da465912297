#include "panonav/memory/floors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "panonav/core/error.hpp"

namespace panonav::testing {
namespace {

TEST(Floors, TheFolderOfAViewNamesItsFloor) {
  EXPECT_EQ(make_name_on_floor("ground", "view_3.png"), "floor=ground/view_3.png");
  EXPECT_EQ(make_name_on_floor("", "view_3.png"), "view_3.png");
  EXPECT_EQ(floor_of("floor=ground/view_3.png"), "ground");
  EXPECT_EQ(floor_of("floor=1st floor/red/view.png"), "1st floor");
  for (const char* name : {"view.png", "ground/view.png", "floor=2.png", "floor=/view.png",
                           "a/floor=ground/view.png", ""}) {
    EXPECT_EQ(floor_of(name), "") << name;
  }
  EXPECT_EQ(add_prefix_on_floor("red/", "floor=ground/view.png"), "floor=ground/red/view.png");
  EXPECT_EQ(add_prefix_on_floor("red/", "view.png"), "red/view.png");
}

TEST(Floors, ANameThatIsNoFolderIsRefused) {
  for (const std::string& floor :
       {std::string("a/b"), std::string("a\nb"), std::string(201, 'a')}) {
    EXPECT_THROW((void)make_name_on_floor(floor, "view.png"), ContractError) << floor;
  }
}

TEST(Floors, PositionsOnTwoFloorsAreInfinitelyFarApart) {
  EXPECT_EQ(distance(FloorPosition{{0.0, 0.0}, "a"}, FloorPosition{{3.0, 4.0}, "a"}), 5.0);
  EXPECT_TRUE(std::isinf(distance(FloorPosition{{0.0, 0.0}, "a"}, FloorPosition{{0.0, 0.0}, "b"})));
}

TEST(FloorPlane, LaysFloorsApartAndBack) {
  FloorPlane plane;
  for (int i = 0; i < 30; ++i) {
    const std::string floor = i == 0 ? "" : std::to_string(i);
    for (const Point2 point : {Point2{0.25, -3.5}, Point2{-1e7, 1e7}, Point2{1e7, -1e7}}) {
      const Point2 there = plane.to_plane({point, floor});
      if (i == 0) {
        EXPECT_EQ(there, point);
      }
      const FloorPosition back = plane.to_floor(there);
      EXPECT_EQ(back.floor, floor);
      EXPECT_LT(distance(back.point, point), 1e-7);
    }
  }
}

}  // namespace
}  // namespace panonav::testing
