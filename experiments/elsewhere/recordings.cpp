// Each picture of a recording, turned, asked of the memory of all others.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "experiments/elsewhere/experiments.hpp"
#include "experiments/runs/make_each.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/view_encoder.hpp"

namespace panonav {

namespace {

constexpr std::size_t turns = 3;
/// A match counts when it is at most so many times as far as the nearest view.
constexpr double near_factor = 1.5;

struct Recorded {
  std::string file;
  std::optional<Point2> position;
  Panorama panorama;
  Panorama sharp;  ///< the same rows as fine as they were recorded; of a mirror the panorama
};

/// Whether `found` is near enough to `asked`: in metres, or in a recording without positions one of
/// the two pictures beside it.
bool is_near(const std::vector<Recorded>& views, std::size_t asked, std::size_t found) {
  if (!views[asked].position) return found + 1 == asked || asked + 1 == found;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i != asked)
      nearest_m = std::min(nearest_m, distance(*views[i].position, *views[asked].position));
  }
  return distance(*views[found].position, *views[asked].position) <= near_factor * nearest_m;
}

/// The memory of all pictures, as the command makes it by default but for what is said.
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

/// Removes a memory file when nobody reads it any more.
struct RemovedInTheEnd {
  explicit RemovedInTheEnd(std::filesystem::path path) : file(std::move(path)) {}
  RemovedInTheEnd(const RemovedInTheEnd&) = delete;
  RemovedInTheEnd& operator=(const RemovedInTheEnd&) = delete;
  ~RemovedInTheEnd() {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }
  std::filesystem::path file;
};

/// The rows of the picture that the memory keeps, as fine as they were recorded.
Panorama sharp_view(const DatasetEntry& entry, const PictureSource& source,
                    const Panorama& panorama) {
  const Observation seen = read_observation(entry);
  const auto* const picture = std::get_if<Image>(&seen.picture);
  if (!picture || source.kind == PictureKind::mirror) return panorama;
  return panorama_from_picture(picture->view(), source.layout);
}

/// What one way of asking finds.
struct Found {
  std::size_t view = 0;
  double milliseconds = 0.0;
};

/// All answers of one way of asking.
struct Asked {
  std::size_t near_count = 0;
  std::vector<double> milliseconds;

  Asked(const std::vector<Recorded>& views, std::span<const Found> found) {
    for (std::size_t n = 0; n < found.size(); ++n) {
      near_count += is_near(views, n / turns, found[n].view) ? 1 : 0;
      milliseconds.push_back(found[n].milliseconds);
    }
  }
};

}  // namespace

void reproduce_leave_one_out(const ElsewhereReproductionOptions& options,
                             const std::filesystem::path& recording,
                             std::vector<std::unique_ptr<RivalRecogniser>> rivals,
                             Executor& executor, Reproduction& result) {
  const Dataset dataset = read_dataset(recording);
  const std::string name = recording.filename().string();
  const RemovedInTheEnd memory{options.out / (name + ".panonav")};
  const PlaceRecogniser by_columns = memorise(memory.file, dataset, false, executor);
  const PlaceRecogniser recogniser = memorise(memory.file, dataset, true, executor);
  const double file_bytes = static_cast<double>(std::filesystem::file_size(memory.file));
  std::vector<Recorded> views;
  for (const DatasetEntry& entry : dataset.entries) {
    Panorama panorama = recogniser.encoder().panorama(read_observation(entry));
    Panorama sharp = sharp_view(entry, dataset.source, panorama);
    views.push_back({entry.file, entry.pose ? std::optional(entry.pose->position()) : std::nullopt,
                     std::move(panorama), std::move(sharp)});
  }
  const auto columns = static_cast<std::uint64_t>(views.front().panorama.columns());
  const auto turn_of = [&](std::size_t n) {
    Random random(options.seed + n % turns, n / turns);
    return static_cast<int>(random.index(columns));
  };
  const auto turned = [&](std::size_t n) {
    return turn_columns(views[n / turns].panorama, turn_of(n));
  };

  const std::size_t asked = views.size() * turns;
  const std::string id = "elsewhere." + name;
  const std::string what = name + ", each of " + std::to_string(views.size()) +
                           " pictures, turned at random " + std::to_string(turns) +
                           " times, asked of the memory of the others: ";
  const std::string near = views.front().position
                               ? "best match within 1.5 times the distance of the nearest"
                               : "best match is the picture before or after";

  std::vector<Place> places(asked);
  const auto ask = [&](const PlaceRecogniser& ours) {
    return Asked(views, make_each(executor, asked, [&](std::size_t n) {
                   const Observation seen(turned(n));
                   const double start = thread_seconds();
                   places[n] = ours.localise(seen, {&views[n / turns].file, 1});
                   const double spent = 1000.0 * (thread_seconds() - start);
                   const auto match =
                       std::ranges::find(views, places[n].matches.at(0).name, &Recorded::file);
                   return Found{static_cast<std::size_t>(match - views.begin()), spent};
                 }));
  };
  const Asked without_features = ask(by_columns);
  const Asked ours = ask(recogniser);
  add_rate(result, id + ".near", what + near, ours.near_count, asked,
           name == "ciirc_b670" ? std::optional(at_least(29.0 / 31.0)) : std::nullopt);
  const std::size_t judged = result.rows.size() - 1;
  std::size_t known = 0;
  std::size_t placed = 0;
  std::size_t inside = 0;
  for (std::size_t n = 0; n < asked; ++n) {
    const Place& place = places[n];
    const Recorded& truth = views[n / turns];
    known += place.known ? 1 : 0;
    if (!place.position || !place.position->radius_m || !truth.position) continue;
    ++placed;
    const double off_m = distance({place.position->x_m, place.position->y_m}, *truth.position);
    inside += off_m <= *place.position->radius_m ? 1 : 0;
  }
  add_rate(result, id + ".known", what + "places known", known, asked);
  if (placed > 0) {
    add_rate(result, id + ".radius", what + "positions within the stated 95 % radius", inside,
             placed, at_least(0.9));
  }
  add_median(result, id + ".time", what + "processor time from the panorama to the answer", "ms",
             ours.milliseconds, at_most(5.0));
  add_row(result, id + ".bytes", what + "size of the memory file, for each view",
          file_bytes / static_cast<double>(views.size()), "B", at_most(20'000.0));

  std::string beside = "the others on the same queries: ";
  const auto add_other = [&](const std::string& other, const Asked& found, double bytes) {
    std::string key = other;
    std::ranges::replace(key, ' ', '_');
    std::erase(key, ',');
    add_rate(result, id + "." + key + ".near", what + other + ": " + near, found.near_count, asked);
    add_median(result, id + "." + key + ".time", what + other + ": processor time", "ms",
               found.milliseconds);
    add_row(result, id + "." + key + ".bytes", what + other + ": bytes a view", bytes, "B");
    beside += (beside.back() == ' ' ? "" : ", ") + other + " " + std::to_string(found.near_count);
  };
  add_other("ours without local features", without_features,
            2.0 * static_cast<double>(recogniser.encoder().header().shape.size()));
  rivals.insert(rivals.begin(), patch_normalised_recogniser());
  rivals.insert(rivals.begin(), pixels_over_all_turns_recogniser());
  rivals.insert(rivals.begin(), fourier_signature_recogniser());
  std::vector<RivalView> references;
  for (const Recorded& view : views) references.push_back({view.panorama, to_picture(view.sharp)});
  for (const auto& rival : rivals) {
    rival->memorise(references);
    const auto found = make_each(executor, asked, [&](std::size_t n) {
      const Panorama& sharp = views[n / turns].sharp;
      const auto turn = static_cast<int>(
          std::lround(turn_of(n) * sharp.columns() / static_cast<double>(columns)));
      const RivalView query{turned(n), to_picture(turn_columns(sharp, turn))};
      const double start = thread_seconds();
      const std::size_t view = rival->nearest(query, n / turns);
      return Found{view, 1000.0 * (thread_seconds() - start)};
    });
    add_other(rival->name(), Asked(views, found), rival->bytes_per_view());
  }
  result.rows[judged].over += "; " + beside;
}

}  // namespace panonav
