#include "lab/m03/support.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

RunSet make_run_set(std::shared_ptr<const TrackingPlace> place, std::vector<TrackingRun> runs,
                    Executor& executor) {
  RunSet set{std::move(place), std::move(runs), {}};
  set.single_images = localise_single_images(*set.place, set.runs, executor);
  return set;
}

std::size_t number_of_runs(std::span<const RunSet> sets) {
  std::size_t count = 0;
  for (const RunSet& set : sets) count += set.runs.size();
  return count;
}

std::vector<TrackedRun> track_sets(std::span<const RunSet> sets, const FilterSetting& setting,
                                   std::uint64_t seed, Executor& executor) {
  std::vector<TrackedRun> all;
  for (const RunSet& set : sets) {
    auto tracked = track_runs(*set.place, set.runs, setting, seed + all.size(), executor);
    std::ranges::move(tracked, std::back_inserter(all));
  }
  return all;
}

OfficeRuns record_office(const TrackingReproductionOptions& options, int number,
                         Executor& executor) {
  const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(number);
  const simulation::PlaceRecording place = simulation::record_place({.scene = "office",
                                                                     .seed = seed,
                                                                     .spacing_m = m03_spacing_m,
                                                                     .queries = 1,
                                                                     .rows = options.rows,
                                                                     .columns = options.columns},
                                                                    executor);
  const auto remembered = remember_for_tracking(place, executor);
  const WalkOptions constant{.variants = 1,
                             .runs_each = options.variants * options.runs,
                             .constant_heading = true,
                             .seed = 1};
  const WalkOptions hard{.variants = options.variants, .runs_each = options.runs, .seed = 2};
  OfficeRuns office{
      viewer::scene_layers(place.scene),
      make_run_set(remembered,
                   record_walks(place, *remembered, clean_condition(), constant, executor),
                   executor),
      make_run_set(remembered, record_walks(place, *remembered, hard_condition(), hard, executor),
                   executor),
      {}};
  // From each run to another one in the same variant, so that only the place changes.
  std::vector<TrackingRun> carried;
  const auto each = static_cast<std::size_t>(options.runs);
  for (std::size_t i = 0; i < office.hard.runs.size(); ++i) {
    const std::size_t first = i / each * each;
    for (std::size_t k = 1; k < each; ++k) {
      const TrackingRun& other = office.hard.runs[first + (i - first + k) % each];
      if (auto run = kidnapped(office.hard.runs[i], other, m03_images_before_kidnapping, 1.0,
                               static_cast<std::size_t>(m03_most_images))) {
        carried.push_back(std::move(*run));
        break;
      }
    }
  }
  office.kidnapped = {remembered, std::move(carried), office.hard.single_images};
  return office;
}

namespace {

std::string single_images_text(std::span<const RunSet> sets) {
  SingleImages sum;
  for (const RunSet& set : sets) sum.add(set.single_images);
  if (sum.asked == 0) return "no image alone";
  const auto percent = [&](std::size_t count) {
    return std::to_string(
        std::lround(100.0 * static_cast<double>(count) / static_cast<double>(sum.asked)));
  };
  const auto spacing = std::lround(100.0 * sets.front().place->spacing_m());
  return "one image alone: right " + percent(sum.right) + " % (by dissimilarity only " +
         percent(sum.right_by_dissimilarity) + " %), within " + std::to_string(spacing) + " cm " +
         percent(sum.near) + " %";
}

}  // namespace

void tell_single_images(ResultRow& row, std::span<const RunSet> sets) {
  row.over += "; " + single_images_text(sets);
}

std::vector<double> capped_images(std::span<const TrackedRun> runs, double radius_m,
                                  std::size_t first_step) {
  std::vector<double> images;
  for (const TrackedRun& run : runs) {
    const int count = images_until_localised(run, radius_m, first_step).value_or(m03_most_images);
    images.push_back(std::min(count, m03_most_images));
  }
  return images;
}

std::size_t localised_within(std::span<const TrackedRun> runs, double radius_m, int images,
                             std::size_t first_step) {
  return static_cast<std::size_t>(std::ranges::count_if(runs, [&](const TrackedRun& run) {
    const auto count = images_until_localised(run, radius_m, first_step);
    return count && *count <= images;
  }));
}

std::vector<double> errors_after(std::span<const TrackedRun> runs, std::size_t images,
                                 std::size_t first_step) {
  std::vector<double> errors;
  for (const TrackedRun& run : runs) {
    std::size_t count = 0;
    for (const TrackedImage& image : run) {
      if (image.step >= first_step && ++count == images) errors.push_back(image.error_m);
    }
  }
  return errors;
}

void add_confidently_wrong(Reproduction& result, const std::string& id, const std::string& what,
                           std::span<const TrackedRun> runs, std::optional<Target> target) {
  std::size_t images = 0;
  std::size_t wrong = 0;
  for (const TrackedRun& run : runs) {
    for (const TrackedImage& image : run) {
      ++images;
      wrong += image.is_confidently_wrong(m03_wrong_m) ? 1 : 0;
    }
  }
  add_rate(result, id, what + ": images at which it says localised and is off by more than 1 m",
           wrong, images, target);
}

std::vector<viewer::MapPlot> particle_maps(const TrackingPlace& place,
                                           std::span<const viewer::MapLayer> furniture,
                                           const TrackingRun& run, const FilterSetting& setting,
                                           std::uint64_t seed, std::span<const std::size_t> steps,
                                           const std::string& title) {
  std::vector<viewer::MapPlot> maps;
  // The estimate's line is cut where the robot was kidnapped.
  std::vector<std::vector<Point2>> truths;
  std::vector<std::vector<Point2>> estimates;
  std::size_t images = 0;
  (void)track_run(
      place, run, setting, seed,
      [&](std::size_t step, const MonteCarloLocaliser& filter, const MonteCarloEstimate& estimate) {
        if (!run.steps[step].moved) truths.emplace_back();
        if (step == 0) estimates.emplace_back();
        truths.back().push_back(run.steps[step].truth.position());
        if (!estimate.modes.empty()) {
          estimates.back().push_back(estimate.modes.front().mean.position());
        }
        images += run.steps[step].view ? 1 : 0;
        if (std::ranges::find(steps, step) == steps.end()) return;
        viewer::MapPlot map{.title = title + ", " + std::to_string(images) +
                                     (images == 1 ? " image" : " images") +
                                     (run.steps[step].view ? "" : ", driving blind"),
                            .layers = {furniture.begin(), furniture.end()}};
        map.layers.push_back({.label = "references",
                              .colour = viewer::PlotColour::grey,
                              .dots = place.reference_positions()});
        viewer::MapLayer particles{.label = "particles", .colour = viewer::PlotColour::vermilion};
        const Particles& held = filter.particles();
        for (std::size_t i = 0; i < held.size(); ++i) particles.dots.push_back(held.position(i));
        map.layers.push_back(std::move(particles));
        map.layers.push_back({.label = "ground truth",
                              .colour = viewer::PlotColour::black,
                              .crosses = {run.steps[step].truth.position()},
                              .lines = truths});
        viewer::MapLayer guess{
            .label = "estimate", .colour = viewer::PlotColour::blue, .lines = estimates};
        if (!estimate.modes.empty()) {
          guess.circles = {estimate.modes.front().mean.position()};
        }
        map.layers.push_back(std::move(guess));
        maps.push_back(std::move(map));
      });
  return maps;
}

viewer::Series error_over_images(const std::string& label, std::span<const TrackedRun> runs,
                                 std::size_t images, std::size_t first_step) {
  viewer::Series series{.label = label};
  for (std::size_t n = 1; n <= images; ++n) {
    const auto errors = errors_after(runs, n, first_step);
    if (errors.empty()) break;
    series.add(static_cast<double>(n), median(errors));
    series.y_low.push_back(quantile(errors, 0.05));
    series.y_high.push_back(quantile(errors, 0.95));
  }
  return series;
}

}  // namespace panonav::lab
