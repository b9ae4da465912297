// Leave-one-out tests on recordings: each image, rotated at random, is localised in the memory of
// all other images.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "lab/elsewhere/experiments.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/orientation_check.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav_simulation/make_each.hpp"

namespace panonav::lab {

namespace {

constexpr std::size_t rotations_per_view = 3;
/// Largest distance of a correct match, as a multiple of the distance to the nearest view.
constexpr double max_near_factor = 1.5;

struct RecordedView {
  std::string file;
  std::optional<Point2> position;
  Panorama panorama;
  Panorama sharp;  ///< at recorded resolution; `panorama` for a mirror
};

/// True if `found` is a correct match of `query`: near in metres, or in a recording without
/// positions the image before or after it.
bool is_near(const std::vector<RecordedView>& views, std::size_t query, std::size_t found) {
  if (!views[query].position) return found + 1 == query || query + 1 == found;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i != query)
      nearest_m = std::min(nearest_m, distance(*views[i].position, *views[query].position));
  }
  return distance(*views[found].position, *views[query].position) <= max_near_factor * nearest_m;
}

/// Memorises all images with the defaults of the command.
PlaceRecogniser memorise(const std::filesystem::path& file, const Dataset& dataset, bool features,
                         Executor& executor) {
  std::filesystem::remove(file);
  {
    Memoriser memoriser(file,
                        {.source = dataset.source, .thumbnails = false, .features = features});
    std::vector<Observation> observations;
    for (const DatasetEntry& entry : dataset.entries) {
      observations.push_back(read_observation(entry));
    }
    memoriser.add(std::move(observations), executor);
    memoriser.finish(executor);
  }
  return PlaceRecogniser(file);
}

/// Removes a file at the end of its scope.
struct TemporaryFile {
  explicit TemporaryFile(std::filesystem::path path) : file(std::move(path)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }
  std::filesystem::path file;
};

/// Returns the image rows that the memory uses, at their recorded resolution; `panorama` for a
/// mirror image.
Panorama read_sharp_view(const DatasetEntry& entry, const PictureSource& source,
                         const Panorama& panorama) {
  const Observation seen = read_observation(entry);
  const auto* const picture = std::get_if<Image>(&seen.picture);
  if (!picture || source.kind == PictureKind::mirror) return panorama;
  return panorama_from_picture(picture->view(), source.layout);
}

/// The best match of a query, and the processor time of the search.
struct TimedMatch {
  std::size_t view = 0;
  double milliseconds = 0.0;
};

/// Localises each image of a recording, rotated at random, in the memory of the other images.
class LeaveOneOut {
 public:
  LeaveOneOut(const ElsewhereExperiments& elsewhere, const Dataset& dataset,
              const PlaceRecogniser& recogniser, const std::string& name)
      : elsewhere_(elsewhere), id_("elsewhere." + name) {
    for (const DatasetEntry& entry : dataset.entries) {
      Panorama panorama = recogniser.encoder().panorama(read_observation(entry));
      Panorama sharp = read_sharp_view(entry, dataset.source, panorama);
      views_.push_back({entry.file,
                        entry.pose ? std::optional(entry.pose->position()) : std::nullopt,
                        std::move(panorama), std::move(sharp)});
    }
    columns_ = static_cast<std::uint64_t>(views_.front().panorama.columns());
    what_ = name + ", each of " + std::to_string(views_.size()) + " pictures, turned at random " +
            std::to_string(rotations_per_view) + " times, asked of the memory of the others: ";
    near_description_ = views_.front().position
                            ? "best match within 1.5 times the distance of the nearest"
                            : "best match is the picture before or after";
  }

  [[nodiscard]] std::size_t size() const { return views_.size(); }

  /// Localises all queries with the recogniser `ours`, excluding the query's own image; writes the
  /// answers to `places`.
  std::vector<TimedMatch> localise_all(const PlaceRecogniser& ours,
                                       std::vector<Place>& places) const {
    places.resize(query_count());
    return simulation::make_each(elsewhere_.executor, query_count(), [&](std::size_t n) {
      const Observation seen(rotated_view(n));
      const double start = simulation::get_thread_cpu_time_s();
      places[n] = ours.localise(seen, {&views_[n / rotations_per_view].file, 1});
      const double spent = 1000.0 * (simulation::get_thread_cpu_time_s() - start);
      const auto match =
          std::ranges::find(views_, places[n].matches.at(0).name, &RecordedView::file);
      return TimedMatch{static_cast<std::size_t>(match - views_.begin()), spent};
    });
  }

  std::vector<TimedMatch> localise_all(RivalRecogniser& rival) const {
    std::vector<RivalView> references;
    for (const RecordedView& view : views_) {
      references.push_back({view.panorama, to_picture(view.sharp)});
    }
    rival.memorise(references);
    return simulation::make_each(elsewhere_.executor, query_count(), [&](std::size_t n) {
      const Panorama& sharp = views_[n / rotations_per_view].sharp;
      const auto turn = static_cast<int>(std::lround(random_rotation_columns(n) * sharp.columns() /
                                                     static_cast<double>(columns_)));
      const RivalView query{rotated_view(n), to_picture(rotate_columns(sharp, turn))};
      const double start = simulation::get_thread_cpu_time_s();
      const std::size_t view = rival.nearest(query, n / rotations_per_view);
      return TimedMatch{view, 1000.0 * (simulation::get_thread_cpu_time_s() - start)};
    });
  }

  void add_near(const std::vector<TimedMatch>& found, std::optional<Target> target) const {
    add_rate(result(), id_ + ".near", what_ + near_description_, count_near(found), query_count(),
             target);
  }

  void add_known_rates(const std::vector<Place>& places) const {
    std::size_t known = 0;
    std::size_t placed = 0;
    std::size_t inside = 0;
    for (std::size_t n = 0; n < query_count(); ++n) {
      const Place& place = places[n];
      const auto& truth = views_[n / rotations_per_view].position;
      known += place.known ? 1 : 0;
      if (!place.position || !place.position->radius_m || !truth) continue;
      ++placed;
      const double off_m = distance({place.position->x_m, place.position->y_m}, *truth);
      inside += off_m <= *place.position->radius_m ? 1 : 0;
    }
    add_rate(result(), id_ + ".known", what_ + "places known", known, query_count());
    if (placed == 0) return;
    add_rate(result(), id_ + ".radius", what_ + "positions within the stated 95 % radius", inside,
             placed, at_least(0.9));
  }

  void add_cost(const std::vector<TimedMatch>& found, double file_bytes) const {
    add_median(result(), id_ + ".time", what_ + "processor time from the panorama to the answer",
               "ms", milliseconds(found), at_most(5.0));
    add_row(result(), id_ + ".bytes", what_ + "size of the memory file, for each view",
            file_bytes / static_cast<double>(size()), "B", at_most(20'000.0));
  }

  /// Adds the results of another method; returns a text of its name and its number of correct
  /// matches.
  std::string add_other(const std::string& other, const std::vector<TimedMatch>& found,
                        double bytes) const {
    std::string key = other;
    std::ranges::replace(key, ' ', '_');
    std::erase(key, ',');
    const std::string id = id_ + "." + key;
    const std::size_t near_count = count_near(found);
    add_rate(result(), id + ".near", what_ + other + ": " + near_description_, near_count,
             query_count());
    add_median(result(), id + ".time", what_ + other + ": processor time", "ms",
               milliseconds(found));
    add_row(result(), id + ".bytes", what_ + other + ": bytes a view", bytes, "B");
    return other + " " + std::to_string(near_count);
  }

 private:
  [[nodiscard]] Reproduction& result() const { return elsewhere_.result; }
  [[nodiscard]] std::size_t query_count() const { return views_.size() * rotations_per_view; }
  [[nodiscard]] int random_rotation_columns(std::size_t n) const {
    Random random(elsewhere_.options.seed + n % rotations_per_view, n / rotations_per_view);
    return static_cast<int>(random.index(columns_));
  }
  [[nodiscard]] Panorama rotated_view(std::size_t n) const {
    return rotate_columns(views_[n / rotations_per_view].panorama, random_rotation_columns(n));
  }
  [[nodiscard]] std::size_t count_near(const std::vector<TimedMatch>& found) const {
    std::size_t count = 0;
    for (std::size_t n = 0; n < found.size(); ++n) {
      count += is_near(views_, n / rotations_per_view, found[n].view) ? 1 : 0;
    }
    return count;
  }
  static std::vector<double> milliseconds(const std::vector<TimedMatch>& found) {
    std::vector<double> times;
    for (const TimedMatch& one : found) times.push_back(one.milliseconds);
    return times;
  }

  const ElsewhereExperiments& elsewhere_;
  std::string id_;
  std::string what_;
  std::string near_description_;
  std::vector<RecordedView> views_;
  std::uint64_t columns_ = 0;
};

}  // namespace

void ElsewhereExperiments::reproduce_leave_one_out(
    const std::filesystem::path& recording, std::vector<std::unique_ptr<RivalRecogniser>> rivals) {
  const Dataset dataset = read_dataset(recording);
  const std::string name = recording.filename().string();
  const TemporaryFile memory{result.out / (name + ".panonav")};
  const PlaceRecogniser by_columns = memorise(memory.file, dataset, false, executor);
  const PlaceRecogniser recogniser = memorise(memory.file, dataset, true, executor);
  const LeaveOneOut pictures(*this, dataset, recogniser, name);
  std::vector<Place> places;
  const auto without_features = pictures.localise_all(by_columns, places);
  const auto ours = pictures.localise_all(recogniser, places);
  pictures.add_near(ours,
                    name == "ciirc_b670" ? std::optional(at_least(29.0 / 31.0)) : std::nullopt);
  const std::size_t judged = result.rows.size() - 1;
  pictures.add_known_rates(places);
  pictures.add_cost(ours, static_cast<double>(std::filesystem::file_size(memory.file)));

  std::string others =
      pictures.add_other("ours without local features", without_features,
                         2.0 * static_cast<double>(recogniser.encoder().header().shape.size()));
  rivals.insert(rivals.begin(), make_patch_normalised_recogniser());
  rivals.insert(rivals.begin(), make_pixels_over_all_rotations_recogniser());
  rivals.insert(rivals.begin(), make_fourier_signature_recogniser());
  for (const auto& rival : rivals) {
    const auto found = pictures.localise_all(*rival);
    others += ", " + pictures.add_other(rival->name(), found, rival->bytes_per_view());
  }
  result.rows[judged].over += "; the others on the same queries: " + others;
}

void ElsewhereExperiments::reproduce_orientation(
    const std::vector<std::filesystem::path>& recordings) {
  const double turn_rad = radians(90.0);
  std::size_t found = 0;
  std::size_t silent = 0;
  std::size_t descriptions = 0;
  for (const std::filesystem::path& folder : recordings) {
    Dataset recording = read_dataset(folder);
    const PictureSource right = recording.source;
    silent += check_orientation(recording, executor).fault ? 0 : 1;
    for (const OrientationFault& off :
         {OrientationFault{true, 0.0}, OrientationFault{false, turn_rad},
          OrientationFault{true, turn_rad}}) {
      recording.source = correct_orientation(right, off).value();
      const auto fault = check_orientation(recording, executor).fault;
      ++descriptions;
      found += fault && fault->is_mirrored == off.is_mirrored &&
                       (fault->turn_rad != 0.0) == (off.turn_rad != 0.0)
                   ? 1
                   : 0;
    }
  }
  const std::string what = "images of real recordings with poses, described ";
  add_rate(result, "elsewhere.orientation.found",
           what + "wrongly (mirrored, turned by 90 degrees, both): what is wrong is reported",
           found, descriptions, at_least(1.0));
  add_rate(result, "elsewhere.orientation.silent", what + "rightly: nothing is reported", silent,
           recordings.size(), at_least(1.0));
}

}  // namespace panonav::lab
