#include "runs/trial.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <system_error>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/camera_file.hpp"
#include "panonav/io/gpano.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/localisation/observation_model.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/open_input.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/tracker.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav_viewer/report_page.hpp"
#include "reports/report_page.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

/// Largest number of images that a trial uses, so that it takes about a minute.
constexpr std::size_t max_images = 400;
constexpr std::size_t max_samples = 12;       ///< images from which the kind is guessed
constexpr std::size_t max_lean_samples = 60;  ///< images from which the lean is estimated

/// Keeps at most `count` entries at equal intervals.
void thin_out(std::vector<DatasetEntry>& entries, std::size_t count) {
  if (entries.size() <= count) return;
  std::vector<DatasetEntry> kept;
  for (std::size_t i = 0; i < count; ++i) kept.push_back(entries[i * entries.size() / count]);
  entries = std::move(kept);
}

std::vector<Image> read_samples(const Dataset& recording, const std::string& input) {
  std::vector<Image> samples;
  const std::size_t count = recording.entries.size();
  const std::size_t sample_count = std::min(max_samples, count);
  for (std::size_t i = 0; i < sample_count; ++i) {
    try {
      Image image = read_picture(recording.entries[i * count / sample_count]);
      if (samples.empty() || image.size() == samples.front().size()) {
        samples.push_back(std::move(image));
      }
    } catch (const FileError&) {
      continue;  // reported when all images are read
    }
  }
  if (samples.empty()) {
    throw FileError(input, "contains no image that can be read");
  }
  return samples;
}

/// Reads all images as panoramas; prints why images are skipped.
std::vector<Observation> read_panoramas(const Dataset& recording, const PictureSource& source,
                                        Trial& trial, Session& session) {
  const PanoramaReader reader(source, choose_panorama_shape(source, {}));
  std::vector<Observation> observations;
  Progress progress(session, "reading", recording.entries.size());
  std::optional<PanoramaShape> shape;
  process_in_order(
      recording.entries.size(), session.executor(),
      [&](std::size_t i) {
        Observation observation = read_observation(recording.entries[i]);
        const Tilt tilt = observation.tilt.value_or(Tilt{});
        observation.picture = reader.convert(std::get<Image>(observation.picture).view(), tilt);
        observation.tilt.reset();
        return observation;
      },
      [&](std::size_t i, Observation&& observation) {
        progress.advance();
        const auto& panorama = std::get<Panorama>(observation.picture);
        const PanoramaShape own{panorama.rows(), panorama.columns()};
        if (shape && *shape != own) {
          trial.unread.push_back(recording.entries[i].file);
          return;
        }
        shape = own;
        observations.push_back(std::move(observation));
      },
      [&](std::size_t i, const std::exception_ptr& failure) {
        progress.clear();
        trial.unread.push_back(recording.entries[i].file);
        try {
          std::rethrow_exception(failure);
        } catch (const Error& error) {
          session.note("skipped: " + to_readable_line(error.what()));
        }
        progress.advance();
      });
  return observations;
}

/// Guesses the source of images without a description. GPano data say which part of the sphere
/// equirectangular images show and by how much they are tilted.
void guess_source(Trial& trial, Dataset& recording, const std::vector<Image>& samples,
                  Session& session) {
  const std::optional<ElevationBand> shown = recording.source.layout.elevations;
  trial.guess = guess_pictures(samples, session.executor());
  if (!trial.guess.source || trial.guess.form == PictureForm::two_lenses ||
      trial.guess.form == PictureForm::mirror) {
    return;
  }
  PictureSource& source = *trial.guess.source;
  if (shown) source = {.kind = PictureKind::equirectangular};
  if (source.kind == PictureKind::equirectangular) source.layout = {};
  recording.source = source;
  recording.warnings.clear();
  apply_gpano(recording);
  for (const std::string& warning : recording.warnings) session.note(warning);
  source = recording.source;
  if (source.kind == PictureKind::equirectangular && !source.layout.kept_elevations) {
    source.layout.kept_elevations = default_equirectangular_band;
  }
  if (!shown) return;
  trial.guess.form = PictureForm::sphere;
  trial.guess.explanation = "GPano data of the images say that they show a part of the sphere.";
}

/// Measures carrier and brightness from samples, and leaves out the rows that show the
/// carrier, if the band of the source can be chosen.
void measure_images(const std::vector<Image>& samples, PictureSource& source, Trial& trial) {
  const PanoramaReader reader(source, choose_panorama_shape(source, {}));
  std::vector<Panorama> panoramas;
  for (const Image& sample : samples) panoramas.push_back(reader.convert(sample.view()));
  trial.example = to_picture(panoramas[panoramas.size() / 2]);
  for (const Panorama& panorama : panoramas) {
    const auto values = panorama.values();
    trial.mean_brightness += std::accumulate(values.begin(), values.end(), 0.0) /
                             static_cast<double>(values.size() * panoramas.size());
  }
  constexpr double min_carrier_share = 0.1;
  const int rows = panoramas.front().rows();
  const double share = static_cast<double>(count_carrier_rows(panoramas)) / rows;
  if (share > min_carrier_share && share < 0.7 && source.kind != PictureKind::panorama) {
    const ElevationBand& band = *panoramas.front().elevations();
    trial.carrier_top_rad = band.bottom_rad + share * (band.top_rad - band.bottom_rad);
    source.layout.kept_elevations = ElevationBand{*trial.carrier_top_rad, band.top_rad};
    const PanoramaReader upper(source, choose_panorama_shape(source, {}));
    for (std::size_t i = 0; i < samples.size(); ++i) {
      panoramas[i] = upper.convert(samples[i].view());
    }
  }
}

/// Measures the lean of the camera. The slant of edges depends on elevations, which are assumed for
/// mirrors and strips.
void measure_lean(const std::vector<Observation>& observations, Trial& trial, Session& session) {
  if (trial.guess.source->kind != PictureKind::equirectangular) return;
  const std::size_t count = std::min(max_lean_samples, observations.size());
  std::vector<Panorama> panoramas;
  for (std::size_t i = 0; i < count; ++i) {
    panoramas.push_back(std::get<Panorama>(observations[i * observations.size() / count].picture));
  }
  trial.lean = estimate_lean(panoramas, session.executor());
}

void memorise(const std::vector<Observation>& observations, const PictureSource& source,
              Trial& trial, Session& session) {
  Memoriser memoriser(trial.memory,
                      {.source = source, .left_out = [&](const Observation& image, const Error&) {
                         trial.unread.push_back(image.name);
                       }});
  Progress progress(session, "memorising", 2 * observations.size());
  constexpr std::size_t batch = 16;
  for (std::size_t begin = 0; begin < observations.size(); begin += batch) {
    const auto end = std::min(begin + batch, observations.size());
    memoriser.add(
        std::vector<Observation>(observations.begin() + static_cast<std::ptrdiff_t>(begin),
                                 observations.begin() + static_cast<std::ptrdiff_t>(end)),
        session.executor());
    progress.advance(end - begin);
  }
  trial.map_summary = memoriser.finish(session.executor(), [&] { progress.advance(); }).map;
  trial.has_positions = !trial.map_summary && memoriser.file()->info().views_with_position > 0;
}

void localise_all(const std::vector<Observation>& observations, Trial& trial, Session& session) {
  const PlaceRecogniser recogniser(trial.memory);
  Progress progress(session, "localising", observations.size());
  process_in_order(
      observations.size(), session.executor(),
      [&](std::size_t i) {
        return recogniser.localise(observations[i], std::span(&observations[i].name, 1));
      },
      [&](std::size_t i, Place&& place) {
        progress.advance();
        trial.queries.push_back({observations[i].name, std::move(place)});
      });
}

/// Measures the distances between images at equal intervals, with each other.
void measure_motion(const std::vector<Observation>& observations, Trial& trial, Session& session) {
  const auto memory = MemoryFile::open(trial.memory, Access::read_only);
  const ViewEncoder encoder(memory.header(), memory.header().source);
  const std::size_t count = std::min(max_samples, observations.size());
  std::vector<OdometryView> views;
  for (std::size_t i = 0; i < count; ++i) {
    views.emplace_back(encoder.signature(observations[i * observations.size() / count]));
  }
  constexpr double not_visible = std::numeric_limits<double>::infinity();
  std::vector<double> distances_m(count * (count - 1) / 2, not_visible);
  parallel_for(session.executor(), count, [&](std::size_t second) {
    for (std::size_t first = 0; first < second; ++first) {
      const auto step = visual_step(views[first], views[second]);
      if (!step) continue;
      const Pose2& moved = step->before_from_after;
      distances_m[second * (second - 1) / 2 + first] = std::hypot(moved.x_m, moved.y_m);
    }
  });
  const double median_m = upper_median_in_place(std::span(distances_m));
  if (std::isfinite(median_m)) trial.median_distance_m = median_m;
}

/// Tracks a robot that takes the same images in their order, with unknown start. Does nothing if
/// too few views have positions.
void track_all(const std::vector<Observation>& observations, Trial& trial, Session& session) {
  if (!trial.has_positions && !trial.has_map()) return;
  constexpr std::uint64_t min_positions = ObservationModel::min_views;
  const auto info = MemoryFile::open(trial.memory, Access::read_only).info();
  if (info.views_with_position < min_positions) return;
  Tracker tracker(trial.memory);
  Progress progress(session, "tracking", observations.size());
  std::size_t tracked = 0;
  for (const Observation& observation : observations) {
    const LocalisationState state = tracker.observe(observation).state;
    tracked += state == LocalisationState::localised || state == LocalisationState::position_known;
    progress.advance();
  }
  trial.tracked = tracked;
}

void measure_steps(const std::vector<Observation>& observations, Trial& trial) {
  std::vector<double> steps_m;
  std::vector<double> nearest_m;
  for (const Observation& image : observations) {
    double off_m = std::numeric_limits<double>::infinity();
    for (const Observation& other : observations) {
      if (&other == &image || !image.pose || !other.pose) continue;
      off_m = std::min(off_m, distance(image.pose->position(), other.pose->position()));
    }
    if (std::isfinite(off_m)) nearest_m.push_back(off_m);
  }
  for (std::size_t i = 1; i < observations.size(); ++i) {
    const auto& before = observations[i - 1].pose;
    const auto& after = observations[i].pose;
    if (before && after) steps_m.push_back(distance(before->position(), after->position()));
  }
  if (!steps_m.empty()) trial.median_step_m = median(steps_m);
  if (!nearest_m.empty()) trial.median_nearest_m = median(nearest_m);
}

void read_map(Trial& trial) {
  const auto memory = MemoryFile::open(trial.memory, Access::read_only);
  trial.map = memory.map(map_name);
  trial.is_in_order = are_in_order(memory.load());
  if (trial.map) trial.map_poses = place_components_side_by_side(*trial.map);
}

/// Throws FileError if the memory of an earlier trial has routes, changes or a scale that a new
/// trial would remove.
void require_unchanged_memory(const fs::path& path, const Dataset& recording) {
  std::error_code error;
  if (!fs::exists(path, error)) return;
  const auto memory = MemoryFile::open(path, Access::read_only);
  const bool has_odometry = std::ranges::any_of(
      recording.entries, [](const DatasetEntry& entry) { return entry.odometry.has_value(); });
  const bool is_scaled = has_positions_from_map(memory) && !has_odometry &&
                         read_length_unit(memory) == LengthUnit::metres;
  if (!is_scaled && memory.route_names().empty() && memory.history().empty()) return;
  throw FileError(path.string(),
                  "has " +
                      std::string(is_scaled                      ? "a scale in metres"
                                  : memory.route_names().empty() ? "changes"
                                                                 : "a route") +
                      ", which trying the images again would remove; allowed: another folder "
                      "(--out), or remove that file first");
}

void remove_earlier_memory(const fs::path& memory) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(memory.string() + suffix, ignored);
}

}  // namespace

std::string choose_memory_name(const std::string& input) {
  const std::string stem = fs::path(input).lexically_normal().stem().string();
  return (stem.empty() || stem == "." ? "images" : stem) + ".panonav";
}

std::size_t Trial::count_known() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(queries, [](const Query& query) { return query.place.known; }));
}

bool Trial::is_standing() const {
  // A step of 20 cm, the shortest that is recommended, in a hall whose walls are four times as far
  // away as assumed.
  constexpr double shortest_step_m = 0.05;
  return !has_positions && median_distance_m && *median_distance_m < shortest_step_m;
}

std::size_t Trial::count_connected_steps() const {
  if (!map_summary) return 0;
  if (!map) {  // the parts are too small for a map, and consist of consecutive images
    const auto& sizes = map_summary->part_sizes;
    return std::accumulate(sizes.begin(), sizes.end(), std::size_t{0}) - sizes.size();
  }
  std::size_t steps = 0;
  for (std::size_t i = 1; i < map->nodes.size(); ++i) {
    steps += map->nodes[i].component == map->nodes[i - 1].component ? 1 : 0;
  }
  return steps;
}

Trial run_trial(const std::vector<std::string>& inputs, const fs::path& folder, Session& session) {
  Trial trial;
  const std::string& input = inputs.front();
  trial.inputs = inputs;
  PictureArguments pictures;
  pictures.check = PictureArguments::Check::heads;  // others are skipped as they are read
  pictures.further_videos.assign(inputs.begin() + 1, inputs.end());
  Dataset recording = has_dataset_file(input)
                          ? open_recording(input, pictures, std::nullopt, session)
                          : open_recording(input, pictures, PictureSource{}, session);
  trial.image_count = recording.entries.size() + recording.unusable.size();
  for (const auto& one : recording.unusable) trial.unread.push_back(one.file);
  thin_out(recording.entries, max_images);
  if (has_dataset_file(input)) {
    trial.guess.source = recording.source;
    trial.guess.form = recording.source.kind == PictureKind::equirectangular ? PictureForm::sphere
                       : recording.source.kind == PictureKind::mirror        ? PictureForm::mirror
                                                                             : PictureForm::strip;
    trial.guess.explanation = "dataset.toml describes the images.";
  }
  const std::vector<Image> samples = read_samples(recording, input);
  const fs::path memory = folder / choose_memory_name(input);
  prepare_report_folder(folder, "try");
  require_unchanged_memory(memory, recording);
  if (!trial.guess.source) guess_source(trial, recording, samples, session);
  if (!trial.guess.source) return trial;
  PictureSource& source = *trial.guess.source;
  if (!has_dataset_file(input)) measure_images(samples, source, trial);
  const std::vector<Observation> observations = read_panoramas(recording, source, trial, session);
  if (!has_dataset_file(input)) measure_lean(observations, trial, session);
  if (observations.size() < 2) return trial;
  trial.memory = memory;
  // A later run recognises the folder of an interrupted one by this page.
  viewer::ReportPage("The images were not tried to the end",
                     "panonav try was interrupted, or stopped with an error. To start over, run "
                     "the same command again.")
      .write(folder, "index.html", "panonav try");
  remove_earlier_memory(trial.memory);
  if (source.camera && !has_dataset_file(input)) {
    trial.camera = folder / "camera.toml";
    write_camera(*trial.camera, {*source.camera, source.mask});
  }
  memorise(observations, source, trial, session);
  localise_all(observations, trial, session);
  measure_motion(observations, trial, session);
  read_map(trial);
  if (trial.has_positions) measure_steps(observations, trial);
  track_all(observations, trial, session);
  return trial;
}

}  // namespace panonav::command
