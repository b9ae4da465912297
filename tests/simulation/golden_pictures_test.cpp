// Pictures of every built-in scene against those committed in data/golden. Rays are traced with one
// instruction set, so that the pictures are the same on every machine that has it.
//
// After an intended change: PANONAV_WRITE_GOLDEN=1 writes them again; look at each before it is
// committed.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <string>

#include "panonav/io/image_file.hpp"
#include "panonav_simulation/mirror.hpp"
#include "panonav_simulation/renderer.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/scene_views.hpp"

namespace panonav::simulation {
using namespace testing;
namespace {

namespace fs = std::filesystem;

const fs::path golden = fs::path(PANONAV_TEST_DATA) / "golden";

constexpr char instructions[] = "sse4.2";

// Not looking along any wall.
Viewpoint viewpoint_in(const Scene& scene) {
  return viewpoint_on_tour(scene, 0.3, 0.4);
}

struct Pictures {
  Image panorama;
  Image mirror;
};

Pictures pictures_of(const Renderer& renderer, const Viewpoint& viewpoint) {
  Executor executor;
  return {to_picture(renderer.render_panorama(viewpoint, {.rows = 40, .columns = 160}, executor)),
          to_image(renderer.render_image(viewpoint, small_mirror_camera(), 2, executor))};
}

struct Difference {
  double mean_levels = 0.0;
  double share_of_far_pixels = 0.0;
};

// A pixel is far off when it differs by more than a ray of four that falls to the other side of a
// faint edge can explain.
Difference difference(const Image& a, const Image& b) {
  constexpr int far_levels = 8;
  double sum = 0.0;
  double far = 0.0;
  for (std::size_t i = 0; i < a.pixels().size(); ++i) {
    const int levels = std::abs(static_cast<int>(a.pixels()[i]) - static_cast<int>(b.pixels()[i]));
    sum += levels;
    far += levels > far_levels ? 1.0 : 0.0;
  }
  const auto count = static_cast<double>(a.pixels().size());
  return {sum / count, far / count};
}

// True if the difference is that of other rounding. Measured between the instruction sets SSE4.2,
// AVX2 and AVX-512: a mean difference of 0.002 levels at most and no far pixel. The small changes
// below give 0.15 levels and more.
bool is_the_same(const Difference& found) {
  return found.mean_levels <= 0.1 && found.share_of_far_pixels <= 0.002;
}

class GoldenPicture : public ::testing::TestWithParam<std::string_view> {};

void compare(const Image& picture, const fs::path& file) {
  if (std::getenv("PANONAV_WRITE_GOLDEN") != nullptr) write_png(file, picture.view());
  const Image expected = read_image(file);
  ASSERT_EQ(picture.size(), expected.size()) << file;
  const Difference found = difference(picture, expected);
  EXPECT_TRUE(is_the_same(found)) << file.filename() << ": mean difference " << found.mean_levels
                                  << " grey levels, far off " << found.share_of_far_pixels;
}

TEST_P(GoldenPicture, IsRenderedAgainAndSmallChangesWouldBeNoticed) {
  const std::string name(GetParam());
  const RendererOptions options{.instructions = instructions};
  const Scene scene = make_scene(name);
  const Renderer renderer(scene, options);
  const Viewpoint viewpoint = viewpoint_in(scene);
  const Pictures found = pictures_of(renderer, viewpoint);
  compare(found.panorama, golden / (name + "_panorama.png"));
  compare(found.mirror, golden / (name + "_mirror.png"));

  const auto expect_noticed = [&](const Pictures& changed, const char* what) {
    EXPECT_FALSE(is_the_same(difference(changed.panorama, found.panorama))) << what;
    EXPECT_FALSE(is_the_same(difference(changed.mirror, found.mirror))) << what;
  };
  Viewpoint moved = viewpoint;
  moved.pose.x_m += 0.02 * scene.robot_radius_m;
  expect_noticed(pictures_of(renderer, moved), "the camera moved by a fiftieth of the radius");
  Viewpoint turned = viewpoint;
  turned.pose.heading_rad += 0.1 * 2.0 * std::numbers::pi / 160.0;
  expect_noticed(pictures_of(renderer, turned), "the robot turned by a tenth of a column");
  const Renderer brighter(make_scene(name, {.light = 1.01}), options);
  expect_noticed(pictures_of(brighter, viewpoint), "1 % more light");
}

INSTANTIATE_TEST_SUITE_P(Scenes, GoldenPicture,
                         ::testing::Values("office", "hall", "hall_periodic", "arena", "lab",
                                           "loop", "corridor", "garden"),
                         [](const auto& scene) { return std::string(scene.param); });

}  // namespace
}  // namespace panonav::simulation
