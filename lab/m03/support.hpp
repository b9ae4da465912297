#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lab/rows.hpp"
#include "lab/runs/tracking_filter.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/core/executor.hpp"

namespace panonav::lab {

// What the experiments of [M03] share.

/// Side of the references' grid in the office, and the way between two images.
inline constexpr double m03_spacing_m = 0.25;
/// Runs that are not localised within so many images, or not at all, count as this many.
inline constexpr int m03_most_images = 15;
/// A pose that is off by more is plainly wrong.
inline constexpr double m03_wrong_m = 1.0;

/// Runs in one place.
struct RunSet {
  std::shared_ptr<const TrackingPlace> place;
  std::vector<TrackingRun> runs;
  SingleImages single_images;  ///< of these runs
};
[[nodiscard]] RunSet make_run_set(std::shared_ptr<const TrackingPlace> place,
                                  std::vector<TrackingRun> runs, Executor& executor);
[[nodiscard]] std::size_t number_of_runs(std::span<const RunSet> sets);

/// All runs of all sets through a filter, in their order. Runs of different sets have different
/// seeds.
[[nodiscard]] std::vector<TrackedRun> track_sets(std::span<const RunSet> sets,
                                                 const FilterSetting& setting, std::uint64_t seed,
                                                 Executor& executor);

/// An office with everything that happens in it.
struct OfficeRuns {
  std::vector<viewer::MapLayer> furniture;
  RunSet constant_heading;  ///< clean
  RunSet hard;
  RunSet kidnapped;  ///< hard; 10 images, then kidnapped by at least 1 m
};
inline constexpr std::size_t m03_images_before_kidnapping = 10;
[[nodiscard]] OfficeRuns record_office(const TrackingReproductionOptions& options, int number,
                                       Executor& executor);

/// Adds what one image alone gives to what `row` was taken over: "one image alone: right 74 % (by
/// dissimilarity only 54 %), within 25 cm 96 %".
void tell_single_images(ResultRow& row, std::span<const RunSet> sets);

/// Images until localised, each at most `m03_most_images`.
[[nodiscard]] std::vector<double> capped_images(std::span<const TrackedRun> runs, double radius_m,
                                                std::size_t first_step = 0);
/// How many runs are localised within so many images.
[[nodiscard]] std::size_t localised_within(std::span<const TrackedRun> runs, double radius_m,
                                           int images, std::size_t first_step = 0);
/// Error after so many images, counted from `first_step`; runs that ended before are left out.
[[nodiscard]] std::vector<double> errors_after(std::span<const TrackedRun> runs, std::size_t images,
                                               std::size_t first_step = 0);

/// How often the filter says "localised" while it is wrong by more than `m03_wrong_m`, over all
/// images.
void add_confidently_wrong(Reproduction& result, const std::string& id, const std::string& what,
                           std::span<const TrackedRun> runs,
                           std::optional<Target> target = std::nullopt);

/// A filter's particles over a run, as in [M03] figures 7 to 9: panels at the chosen steps.
[[nodiscard]] std::vector<viewer::MapPlot> particle_maps(
    const TrackingPlace& place, std::span<const viewer::MapLayer> furniture, const TrackingRun& run,
    const FilterSetting& setting, std::uint64_t seed, std::span<const std::size_t> steps,
    const std::string& title);

/// Median error over the images with the 5 % and 95 % quantiles as bars.
[[nodiscard]] viewer::Series error_over_images(const std::string& label,
                                               std::span<const TrackedRun> runs, std::size_t images,
                                               std::size_t first_step = 0);

}  // namespace panonav::lab
