#include <gtest/gtest.h>

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav_simulation/mapping_run.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/skips.hpp"

namespace panonav::simulation {
namespace {

MappingRecording small_loop(int views, std::uint64_t seed) {
  Executor executor(1);
  const PlaceRecording place = make_empty_place(make_scene("loop", {.seed = seed}), seed,
                                                {.columns = 128, .rays_per_axis = 1}, executor);
  return record_for_mapping(place, drive(place, {}, 0.1, static_cast<std::size_t>(views)), 17,
                            make_noisy_wheels(), seed, executor);
}

TEST(MappingRun, FewerViewsAndComponentsAreThoseOfTheRecording) {
  const MappingRecording recording = small_loop(12, 3);
  ASSERT_EQ(recording.views.size(), 12U);
  const MappingRecording thinned = thin_recording(recording, 5);
  ASSERT_EQ(thinned.views.size(), 3U);
  EXPECT_EQ(thinned.views[2], recording.views[10]);
  EXPECT_EQ(thinned.truth[2], recording.truth[10]);
  const auto few = first_components(recording.views[0], 4);
  EXPECT_EQ(few.components(), 4);
  EXPECT_EQ(few.magnitude(7, 3), recording.views[0].magnitude(7, 3));
  EXPECT_EQ(few.phase_rad(7, 3), recording.views[0].phase_rad(7, 3));
  EXPECT_THROW((void)first_components(recording.views[0], 18), ContractError);
  EXPECT_THROW((void)thin_recording(recording, 0), ContractError);
}

TEST(MappingRun, ARoundTripIsClosedAndMeasured) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  const MappingRecording recording = small_loop(200, 4);
  const auto open = map_recording(recording, {.mapping = {.close_loops = false}});
  const auto closed = map_recording(recording, {.wheels = true});
  ASSERT_EQ(open.estimate.size(), 200U);
  EXPECT_EQ(open.right_closures + open.wrong_closures, 0U);
  EXPECT_LT(shape_error(open.estimate, open.truth), 0.1);
  EXPECT_LT(shape_error(closed.estimate, closed.truth), shape_error(open.estimate, open.truth));
  EXPECT_EQ(closed.wrong_closures, 0U);
  EXPECT_GT(closed.mean_step_s, 0.0);
  const auto captured =
      map_recording(recording, {.mapping = {.capture_difference = 0.1}, .max_nodes = 20});
  EXPECT_LE(captured.number.size(), 20U);
  EXPECT_TRUE(std::ranges::is_sorted(captured.number));
  const auto alone =
      map_recording({.truth = {{}}, .wheels = {{}}, .views = {recording.views[0]}}, {});
  EXPECT_EQ(alone.estimate.size(), 1U);
  EXPECT_EQ(shape_error(alone.estimate, alone.truth), 1.0);
  EXPECT_THROW((void)map_recording({}, {}), ContractError);
}

}  // namespace
}  // namespace panonav::simulation
