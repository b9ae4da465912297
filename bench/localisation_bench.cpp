// One update of Monte-Carlo localisation, motion and picture, beside MRPT's filter with laser
// scans.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <string>

#include "corridor_walks.hpp"
#include "panonav/localisation/monte_carlo.hpp"
#include "scan_filter.hpp"

namespace panonav::bench {
namespace {

constexpr double start_deviation_m = 0.1;
constexpr double start_heading_deviation_rad = 0.1;

/// Made when the first benchmark asks for it.
const Corridor& corridor() {
  static const Corridor made = make_corridor();
  return made;
}

const lab::TrackingPlace& place_with(std::size_t references) {
  static std::map<std::size_t, std::shared_ptr<const lab::TrackingPlace>> made;
  if (references == corridor().remembered->memory().size()) return *corridor().remembered;
  auto& place = made[references];
  if (place == nullptr) place = corridors_with(corridor(), references);
  return *place;
}

MonteCarloLocaliser localiser_of(const lab::TrackingPlace& place, int particles) {
  return MonteCarloLocaliser(place.ranking(), place.model(),
                             {.min_particles = particles, .max_particles = particles, .seed = 1});
}

/// Goes through the walks again and again. Only `update(walk, step)` is timed: not `start(walk)`,
/// which takes the first image too, `prepare(walk, step)` before and `look(walk, step)` after it.
template <class Start, class Prepare, class Update, class Look>
void along_walks(benchmark::State& state, const std::vector<Walk>& walks, Start start,
                 Prepare prepare, Update update, Look look) {
  std::size_t number = 0;
  std::size_t step = walks.front().run.steps.size();
  bool begun = false;
  for (auto _ : state) {
    state.PauseTiming();
    if (step >= walks[number].run.steps.size()) {
      if (begun) number = (number + 1) % walks.size();
      begun = true;
      start(walks[number]);
      step = 1;
    }
    prepare(walks[number], step);
    state.ResumeTiming();
    update(walks[number], step);
    state.PauseTiming();
    look(walks[number], step);
    ++step;
    state.ResumeTiming();
  }
}

double error_m(const Pose2& estimate, const Walk& walk, std::size_t step) {
  return distance(estimate.position(), walk.run.steps[step].truth.position());
}

/// The robot knows where it is and drives on.
void time_tracking(benchmark::State& state, const lab::TrackingPlace& place,
                   const std::vector<Walk>& walks, int particles) {
  MonteCarloLocaliser filter = localiser_of(place, particles);
  MonteCarloEstimate estimate;
  double compared = 0.0;
  double localised = 0.0;
  double resampled = 0.0;
  double injected = 0.0;
  double error = 0.0;
  along_walks(
      state, walks,
      [&](const Walk& walk) {
        filter.start_at(walk.run.steps[0].truth, start_deviation_m, start_heading_deviation_rad);
        estimate = filter.observe(*walk.run.steps[0].view);
      },
      [](const Walk&, std::size_t) {},
      [&](const Walk& walk, std::size_t step) {
        filter.move(walk.odometry[step]);
        estimate = filter.observe(*walk.run.steps[step].view);
      },
      [&](const Walk& walk, std::size_t step) {
        compared += static_cast<double>(estimate.views_compared);
        localised += estimate.state == LocalisationState::localised ? 1.0 : 0.0;
        resampled += estimate.resampled ? 1.0 : 0.0;
        injected += static_cast<double>(estimate.injected);
        if (!estimate.modes.empty()) error += error_m(estimate.modes.front().mean, walk, step);
      });
  const auto runs = static_cast<double>(state.iterations());
  state.counters["compared"] = compared / runs;
  state.counters["localised"] = localised / runs;
  state.counters["resampled"] = resampled / runs;
  state.counters["injected"] = injected / runs;
  state.counters["error_m"] = error / runs;
}

/// Nothing is known: the first image of a walk.
void time_first_image(benchmark::State& state, const lab::TrackingPlace& place,
                      const std::vector<Walk>& walks, int particles) {
  MonteCarloLocaliser filter = localiser_of(place, particles);
  double compared = 0.0;
  std::size_t i = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const Walk& walk = walks[i % walks.size()];
    const std::size_t step = i / walks.size() % walk.run.steps.size();
    ++i;
    filter.start_globally();
    state.ResumeTiming();
    const MonteCarloEstimate estimate = filter.observe(*walk.run.steps[step].view);
    compared += static_cast<double>(estimate.views_compared);
  }
  state.counters["compared"] = compared / static_cast<double>(state.iterations());
}

/// Measures the part of an update without particles: the search of the memory alone.
void time_search(benchmark::State& state, const lab::TrackingPlace& place,
                 const std::vector<Walk>& walks) {
  std::size_t i = 0;
  for (auto _ : state) {
    const Walk& walk = walks[i % walks.size()];
    const auto& view = walk.run.steps[i / walks.size() % walk.run.steps.size()].view;
    ++i;
    const SearchResult found = place.memory().search(*view, {.top = 8});
    benchmark::DoNotOptimize(found.matches.data());
  }
}

void time_motion(benchmark::State& state, int particles) {
  MonteCarloLocaliser filter = localiser_of(*corridor().remembered, particles);
  const Walk& walk = corridor().clean.front();
  filter.start_at(walk.run.steps[0].truth, start_deviation_m, start_heading_deviation_rad);
  for (auto _ : state) {
    filter.move(walk.odometry[1]);
    benchmark::DoNotOptimize(filter.particles().x_m.data());
  }
}

void time_mrpt(benchmark::State& state, int particles, int beams) {
  const auto filter = make_mrpt_filter(corridor(), particles, beams);
  if (filter == nullptr) {
    state.SkipWithError("not installed");
    return;
  }
  double error = 0.0;
  along_walks(
      state, corridor().clean,
      [&](const Walk& walk) {
        filter->start_at(walk.run.steps[0].truth, start_deviation_m, start_heading_deviation_rad);
        filter->take(walk.scans[0]);
        filter->update({});
      },
      [&](const Walk& walk, std::size_t step) { filter->take(walk.scans[step]); },
      [&](const Walk& walk, std::size_t step) { filter->update(walk.odometry[step]); },
      [&](const Walk& walk, std::size_t step) { error += error_m(filter->mean(), walk, step); });
  state.counters["error_m"] = error / static_cast<double>(state.iterations());
}

void time_mrpt_motion(benchmark::State& state, int particles) {
  const auto filter = make_mrpt_filter(corridor(), particles, 1);
  if (filter == nullptr) {
    state.SkipWithError("not installed");
    return;
  }
  const Walk& walk = corridor().clean.front();
  filter->start_at(walk.run.steps[0].truth, start_deviation_m, start_heading_deviation_rad);
  for (auto _ : state) filter->update(walk.odometry[1]);
}

void add(const std::string& name, const std::function<void(benchmark::State&)>& body) {
  benchmark::RegisterBenchmark(name.c_str(), body)
      ->Unit(benchmark::kMicrosecond)
      ->ComputeStatistics("min", [](const std::vector<double>& values) {
        return *std::min_element(values.begin(), values.end());
      });
}

}  // namespace

int run(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  for (const int particles : {200, 1000, 10000}) {
    const std::string of = "/" + std::to_string(particles);
    add("track_clean" + of, [particles](benchmark::State& state) {
      time_tracking(state, *corridor().remembered, corridor().clean, particles);
    });
    add("track_hard" + of, [particles](benchmark::State& state) {
      time_tracking(state, *corridor().remembered, corridor().hard, particles);
    });
    add("first_image" + of, [particles](benchmark::State& state) {
      time_first_image(state, *corridor().remembered, corridor().clean, particles);
    });
    add("motion" + of, [particles](benchmark::State& state) { time_motion(state, particles); });
    for (const int beams : {10, 30}) {
      add("mrpt_" + std::to_string(beams) + "_beams" + of,
          [particles, beams](benchmark::State& state) { time_mrpt(state, particles, beams); });
    }
    add("mrpt_motion" + of,
        [particles](benchmark::State& state) { time_mrpt_motion(state, particles); });
  }
  for (const std::size_t references : {250, 1000, 4000}) {
    const std::string of = "/" + std::to_string(references) + "_references";
    const auto walks_on = [references]() -> const lab::TrackingPlace& {
      return place_with(references);
    };
    add("search" + of,
        [walks_on](benchmark::State& state) { time_search(state, walks_on(), corridor().clean); });
    add("track_clean/1000" + of, [walks_on](benchmark::State& state) {
      time_tracking(state, walks_on(), corridor().clean, 1000);
    });
    add("first_image/1000" + of, [walks_on](benchmark::State& state) {
      time_first_image(state, walks_on(), corridor().clean, 1000);
    });
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace panonav::bench

int main(int argc, char** argv) {
  return panonav::bench::run(argc, argv);
}
