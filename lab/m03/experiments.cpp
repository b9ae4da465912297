// Result rows and images shared by the experiments of [M03].

#include "lab/m03/experiments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/make_each.hpp"
#include "panonav_simulation/worlds.hpp"
#include "panonav_viewer/scene_drawing.hpp"

namespace panonav::lab {

RunSet make_run_set(std::shared_ptr<const TrackingPlace> place, std::vector<TrackingRun> runs,
                    Executor& executor) {
  RunSet set{std::move(place), std::move(runs), {}};
  set.single_images = localise_single_images(*set.place, set.runs, executor);
  return set;
}

SingleImages sum_single_images(std::span<const RunSet> sets) {
  SingleImages sum;
  for (const RunSet& set : sets) sum.add(set.single_images);
  return sum;
}

std::vector<double> capped_images_until_localised(std::span<const TrackedRun> runs, double radius_m,
                                                  std::size_t first_step) {
  std::vector<double> images;
  for (const TrackedRun& run : runs) {
    const int count = images_until_localised(run, radius_m, first_step).value_or(m03_max_images);
    images.push_back(std::min(count, m03_max_images));
  }
  return images;
}

std::size_t count_localised_within(std::span<const TrackedRun> runs, double radius_m, int images,
                                   std::size_t first_step) {
  return count_where(runs, [&](const TrackedRun& run) {
    const auto count = images_until_localised(run, radius_m, first_step);
    return count && *count <= images;
  });
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

viewer::Series make_error_series(const std::string& label, std::span<const TrackedRun> runs,
                                 std::size_t images, std::size_t first_step, double shift) {
  viewer::Series series{.label = label};
  for (std::size_t i = 1; i <= images; ++i) {
    const auto errors = errors_after(runs, i, first_step);
    if (errors.empty()) break;
    series.add(static_cast<double>(i) + shift, median(errors));
    series.y_low.push_back(quantile(errors, 0.05));
    series.y_high.push_back(quantile(errors, 0.95));
  }
  return series;
}

void RunRows::add_images_until_localised(std::optional<Target> target,
                                         std::optional<std::pair<double, double>> published) const {
  add_median(
      result, id + ".images",
      what + ": images until the error is below " + format_centimetres(radius_m) + " from then on",
      "images", capped_images_until_localised(runs, radius_m, first_step),
      with_targets ? target : std::nullopt, published);
  append_single_image_rates();
}

void RunRows::add_images_mean() const {
  add_mean(result, id + ".images_mean", what + ": images", "images",
           capped_images_until_localised(runs, radius_m, first_step));
}

void RunRows::add_rate_localised_within(int images, std::optional<Target> target) const {
  const std::string count = std::to_string(images);
  add_rate(result, id + ".within_" + count, what + ": runs localised within " + count + " images",
           count_localised_within(runs, radius_m, images, first_step), runs.size(),
           with_targets ? target : std::nullopt);
}

void RunRows::add_error_after(std::size_t images, std::optional<Target> target) const {
  const std::string count = std::to_string(images);
  add_median(result, id + ".error_" + count, what + ": error after " + count + " images", "m",
             errors_after(runs, images), with_targets ? target : std::nullopt);
}

void RunRows::add_rate_of_wrong_answers(std::optional<Target> target) const {
  std::size_t images = 0;
  std::size_t wrong = 0;
  for (const TrackedRun& run : runs) {
    images += run.size();
    wrong += count_where(
        run, [](const TrackedImage& image) { return image.is_confidently_wrong(m03_wrong_m); });
  }
  add_rate(result, id + ".wrong",
           what + ": images at which it reports localised and is off by more than 1 m", wrong,
           images, target);
}

void RunRows::append_single_image_rates() const {
  const SingleImages sum = sum_single_images(sets);
  const auto percent = [&](std::size_t count) {
    return std::to_string(
        std::lround(100.0 * static_cast<double>(count) / static_cast<double>(sum.images)));
  };
  result.rows.back().over +=
      sum.images == 0 ? "; no image alone"
                      : "; one image alone: right " + percent(sum.right) +
                            " % (by dissimilarity only " + percent(sum.right_by_dissimilarity) +
                            " %), within " + format_centimetres(sets.front().place->spacing_m()) +
                            " " + percent(sum.near) + " %";
}

namespace {

// Returns the map layers of one panel: references, particles, true position and estimate at a step.
std::vector<viewer::MapLayer> make_particle_layers(const TrackingPlace& place, const Pose2& truth,
                                                   const MonteCarloLocaliser& filter,
                                                   const MonteCarloEstimate& estimate) {
  viewer::MapLayer particles{.label = "particles", .colour = viewer::PlotColour::vermilion};
  const Particles& held = filter.particles();
  for (std::size_t i = 0; i < held.size(); ++i) particles.dots.push_back(held.position(i));
  viewer::MapLayer guess{.label = "estimate", .colour = viewer::PlotColour::blue};
  if (!estimate.modes.empty()) guess.circles = {estimate.modes.front().mean.position()};
  return {
      {.label = "references",
       .colour = viewer::PlotColour::grey,
       .dots = place.reference_positions()},
      std::move(particles),
      {.label = "ground truth", .colour = viewer::PlotColour::black, .crosses = {truth.position()}},
      std::move(guess)};
}

}  // namespace

std::vector<viewer::MapPlot> make_particle_maps(const TrackingPlace& place,
                                                std::span<const viewer::MapLayer> furniture,
                                                const TrackingRun& run,
                                                const FilterSetting& setting, std::uint64_t seed,
                                                std::span<const std::size_t> steps,
                                                const std::string& title) {
  std::vector<viewer::MapPlot> maps;
  // The line of the truth is cut where the robot was kidnapped.
  std::vector<std::vector<Point2>> truths;
  std::vector<std::vector<Point2>> estimates;
  std::size_t images = 0;
  const auto observe = [&](std::size_t step, const MonteCarloLocaliser& filter,
                           const MonteCarloEstimate& estimate) {
    const TrackingStep& there = run.steps[step];
    if (!there.moved) truths.emplace_back();
    if (step == 0) estimates.emplace_back();
    truths.back().push_back(there.truth.position());
    if (!estimate.modes.empty()) {
      estimates.back().push_back(estimate.modes.front().mean.position());
    }
    images += there.view ? 1 : 0;
    if (std::ranges::find(steps, step) == steps.end()) return;
    auto layers = make_particle_layers(place, there.truth, filter, estimate);
    layers[2].lines = truths;
    layers[3].lines = estimates;
    layers.insert(layers.begin(), furniture.begin(), furniture.end());
    maps.push_back({.title = title + ", " + std::to_string(images) +
                             (images == 1 ? " image" : " images") +
                             (there.view ? "" : ", driving blind"),
                    .layers = std::move(layers)});
  };
  (void)track_run(place, run, setting, seed, observe);
  return maps;
}

simulation::PlaceRecording TrackingExperiments::record_variant(const std::string& scene, int number,
                                                               double spacing_m,
                                                               int columns) const {
  return simulation::record_place({.scene = scene,
                                   .seed = options.seed + static_cast<std::uint64_t>(number),
                                   .spacing_m = spacing_m,
                                   .queries = 1,
                                   .rows = options.rows,
                                   .columns = columns,
                                   .mirror = options.optics == Optics::mirror},
                                  executor);
}

std::vector<TrackedRun> TrackingExperiments::track(std::span<const RunSet> sets,
                                                   const FilterSetting& setting,
                                                   std::uint64_t seed) const {
  std::vector<TrackedRun> all;
  for (const RunSet& set : sets) {
    std::ranges::move(track_runs(*set.place, set.runs, setting, seed + all.size(), executor),
                      std::back_inserter(all));
  }
  return all;
}

std::vector<TrackedRun> TrackingExperiments::track_as_published(
    std::span<const RunSet> sets, const PublishedFilterSetting& setting, std::uint64_t seed) const {
  std::vector<TrackedRun> all;
  for (const RunSet& set : sets) {
    const std::uint64_t first_seed = seed + all.size();
    std::ranges::move(simulation::make_each(executor, set.runs.size(),
                                            [&](std::size_t i) {
                                              return track_run_as_published(
                                                  *set.place, set.runs[i], setting, first_seed + i);
                                            }),
                      std::back_inserter(all));
  }
  return all;
}

std::vector<RunSet> TrackingExperiments::collect_sets(RunSet OfficeRuns::*set) const {
  std::vector<RunSet> sets;
  for (const OfficeRuns& office : offices) sets.push_back(office.*set);
  return sets;
}

std::span<const std::string_view> tracking_reproduction_parts() {
  static constexpr std::array<std::string_view, 7> parts{
      "office", "corridor", "sparse", "garden", "leaving", "worlds", "recordings"};
  return parts;
}

}  // namespace panonav::lab
