// The methods of the papers as published, beside which ours are measured.

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "lab/runs/published_filter.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/scenes.hpp"
#include "support/skips.hpp"

namespace panonav::lab {
namespace {

TEST(PublishedFilter, ComesNearerWithEachImageTheSameEachTime) {
  PANONAV_SKIP_RATES_UNDER_SANITIZERS();
  Executor executor(2);
  const simulation::PlaceRecording place = simulation::record_place(
      {.scene = "office", .seed = 701, .spacing_m = 0.5, .queries = 1, .rows = 24, .columns = 128},
      executor);
  const auto remembered = make_tracking_place(place, executor);
  const auto walks = record_walks(
      place, *remembered, make_clean_condition(),
      {.variants = 1, .runs_each = 6, .images = 15, .constant_heading = true, .seed = 4}, executor);
  const PublishedFilterSetting setting{.particles = 400};
  std::vector<double> first;
  std::vector<double> last;
  for (std::size_t r = 0; r < walks.size(); ++r) {
    const TrackedRun run = track_run_as_published(*remembered, walks[r], setting, r);
    const TrackedRun again = track_run_as_published(*remembered, walks[r], setting, r);
    ASSERT_EQ(run.size(), walks[r].steps.size());
    for (std::size_t i = 0; i < run.size(); ++i) {
      EXPECT_EQ(run[i].error_m, again[i].error_m);
      EXPECT_EQ(run[i].particles, 400);
    }
    first.push_back(run.front().error_m);
    last.push_back(run.back().error_m);
  }
  EXPECT_LT(median(last), 0.8 * median(first));
  EXPECT_THROW((void)track_run_as_published(*remembered, walks[0], {.particles = 0}, 1),
               ContractError);
}

}  // namespace
}  // namespace panonav::lab
