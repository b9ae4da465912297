#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lab/experiments.hpp"
#include "lab/runs/published_filter.hpp"
#include "lab/runs/tracking_filter.hpp"
#include "lab/runs/tracking_run.hpp"

namespace panonav::lab {

/// Spacing of the references in the office, and distance between two images of a run.
inline constexpr double m03_spacing_m = 0.25;
/// Maximum of counted images; also the count of runs that need more or are never localised.
inline constexpr int m03_max_images = 15;
/// Position error above which an estimate is wrong.
inline constexpr double m03_wrong_m = 1.0;
inline constexpr std::size_t m03_images_before_kidnapping = 10;

/// Runs through one place, with the map that they are tracked in.
struct RunSet {
  std::shared_ptr<const TrackingPlace> place;
  std::vector<TrackingRun> runs;
  SingleImages single_images;  ///< of these runs
};
[[nodiscard]] RunSet make_run_set(std::shared_ptr<const TrackingPlace> place,
                                  std::vector<TrackingRun> runs, Executor& executor);
/// Sums the counts of single-image localisation over all sets.
[[nodiscard]] SingleImages sum_single_images(std::span<const RunSet> sets);

/// All recorded runs through one office.
struct OfficeRuns {
  std::vector<viewer::MapLayer> furniture;
  RunSet constant_heading;  ///< clean
  RunSet hard;
  RunSet kidnapped;  ///< hard condition; carried off by at least 1 m after 10 images
};

/// Returns the number of images until each run is localised, at most `m03_max_images`.
[[nodiscard]] std::vector<double> capped_images_until_localised(std::span<const TrackedRun> runs,
                                                                double radius_m,
                                                                std::size_t first_step = 0);
/// Counts the runs that are localised within `images` images from `first_step` on.
[[nodiscard]] std::size_t count_localised_within(std::span<const TrackedRun> runs, double radius_m,
                                                 int images, std::size_t first_step = 0);
/// Returns the error of each run at image number `images` from `first_step` on, without runs that
/// are shorter.
[[nodiscard]] std::vector<double> errors_after(std::span<const TrackedRun> runs, std::size_t images,
                                               std::size_t first_step = 0);
/// Makes the series of median errors against the number of images, with the 5 % and 95 %
/// quantiles as bars; `shift` is added to all x, so that bars of several series do not overlap.
[[nodiscard]] viewer::Series make_error_series(const std::string& label,
                                               std::span<const TrackedRun> runs, std::size_t images,
                                               std::size_t first_step, double shift);

/// Draws the particles of a filter over a run at the chosen steps, as in [M03] figures 7 to 9.
[[nodiscard]] std::vector<viewer::MapPlot> make_particle_maps(
    const TrackingPlace& place, std::span<const viewer::MapLayer> furniture, const TrackingRun& run,
    const FilterSetting& setting, std::uint64_t seed, std::span<const std::size_t> steps,
    const std::string& title);

/// Adds result rows of runs that a filter tracked; ids begin with `id`, texts with `what`.
struct RunRows {
  Reproduction& result;
  std::string id;
  std::string what;
  std::span<const RunSet> sets;
  std::span<const TrackedRun> runs;
  double radius_m = m03_spacing_m;  ///< within which a run is localised
  std::size_t first_step = 0;       ///< from which images are counted
  bool with_targets = true;         ///< false: rows have no targets

  /// Adds the median number of images until localised, with the rates of single images.
  void add_images_until_localised(
      std::optional<Target> target = std::nullopt,
      std::optional<std::pair<double, double>> published = std::nullopt) const;
  void add_images_mean() const;
  void add_rate_localised_within(int images, std::optional<Target> target = std::nullopt) const;
  void add_error_after(std::size_t images, std::optional<Target> target = std::nullopt) const;
  /// Adds the rate of images at which the filter reports localised but its error is above
  /// `m03_wrong_m`.
  void add_rate_of_wrong_answers(std::optional<Target> target = std::nullopt) const;
  /// Appends the rates of single images to `over` of the last row: "one image alone: right 74 % (by
  /// dissimilarity only 54 %), within 25 cm 96 %".
  void append_single_image_rates() const;
};

/// The experiments of [M03], and those that its authors announced as future work.
struct TrackingExperiments : Experiments {
  std::vector<OfficeRuns> offices{};  ///< recorded first; the next four experiments use them

  void record_office(int number);
  /// Reproduces [M03] section 4.1, Global Localisation and figure 7 (1-3).
  void reproduce_global_localisation();
  /// Reproduces [M03] section 4.1, Position Tracking and figure 7 (4-6).
  void reproduce_position_tracking();
  /// Reproduces [M03] section 4.1, Kidnapped Robot and figures 8 and 9.
  void reproduce_kidnapping();
  /// Varies the number of particles and the noise of odometry.
  void reproduce_sweeps();
  /// Reproduces "a long indoor corridor with a loop where we face many false hypothesis".
  void reproduce_corridor();
  /// Localises in the same corridor with references every 0.5, 1 and 2 m, by our filter and as
  /// published.
  void reproduce_sparse_corridor();
  /// Reproduces "a large outdoor environment where we are investigating the different nature of
  /// brightness variations".
  void reproduce_garden();
  /// Tracks a robot that leaves the memorised half of the scene `name` and returns.
  void reproduce_leaving(const std::string& name);
  /// Reproduces global localisation in the world `name` of `options.data`. Throws FileError.
  void reproduce_gazebo_world(const std::string& name);
  /// Localise in the recordings sussex_route and gantry_plants of `options.data`. Throw FileError.
  void reproduce_recorded_route();
  void reproduce_gantry();

  /// Records variant `number` of a built-in scene with its references.
  [[nodiscard]] simulation::PlaceRecording record_variant(const std::string& scene, int number,
                                                          double spacing_m, int columns) const;
  /// Tracks all runs of all sets by a filter, in order. Each run has its own seed.
  [[nodiscard]] std::vector<TrackedRun> track(std::span<const RunSet> sets,
                                              const FilterSetting& setting,
                                              std::uint64_t seed) const;
  /// Tracks all runs of all sets by the filter as published, in order. Each run has its own seed.
  [[nodiscard]] std::vector<TrackedRun> track_as_published(std::span<const RunSet> sets,
                                                           const PublishedFilterSetting& setting,
                                                           std::uint64_t seed) const;
  /// Returns the run set `set` of each office.
  [[nodiscard]] std::vector<RunSet> collect_sets(RunSet OfficeRuns::*set) const;
};

}  // namespace panonav::lab
