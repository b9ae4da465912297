// A moving robot's poses from its pictures and odometry:   track office.panonav run
#include <cstdio>
#include <exception>

#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/tracker.hpp"

int main(int argc, char** argv) try {
  if (argc != 3) return std::puts("usage: track MEMORY DATASET"), 2;
  panonav::Executor executor;
  panonav::DatasetObservations run(panonav::read_dataset(argv[2]), executor);
  panonav::Tracker tracker(argv[1], {.source = run.pictures()});
  while (const auto observation = run.next()) {
    const auto estimate = tracker.observe(*observation);
    if (estimate.state != panonav::LocalisationState::localised || !estimate.pose) continue;
    const auto& [x_m, y_m, heading_rad] = *estimate.pose;
    std::printf("%s %.17g %.17g %.17g\n", observation->name.c_str(), x_m, y_m, heading_rad);
  }
} catch (const std::exception& error) {
  return std::puts(error.what()), 2;
}
