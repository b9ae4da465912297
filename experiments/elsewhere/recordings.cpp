// Each picture of a recording, turned, asked of the memory of all others.

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "experiments/baselines/rivals.hpp"
#include "experiments/elsewhere/experiments.hpp"
#include "experiments/runs/make_each.hpp"
#include "panonav/core/random.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

namespace panonav {

namespace {

constexpr std::size_t turns = 3;
/// A match counts when it is at most so many times as far as the nearest view.
constexpr double near_factor = 1.5;

struct Recorded {
  std::string file;
  std::optional<Point2> position;
  Panorama panorama;
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

/// The memory file of all pictures, as the command makes it by default.
void memorise(const std::filesystem::path& file, const Dataset& dataset, Executor& executor) {
  Memoriser memoriser(file, {.source = dataset.source, .thumbnails = false});
  std::vector<Observation> observations;
  for (const DatasetEntry& entry : dataset.entries) {
    observations.push_back(read_observation(entry));
  }
  memoriser.add(std::move(observations), executor);
  memoriser.finish(executor);
}

}  // namespace

void reproduce_leave_one_out(const ElsewhereReproductionOptions& options, const std::string& name,
                             Executor& executor, Reproduction& result) {
  const Dataset dataset = read_dataset(options.data / name);
  const std::filesystem::path file = options.out / (name + ".panonav");
  std::filesystem::remove(file);
  memorise(file, dataset, executor);
  const PlaceRecogniser recogniser(file);
  std::vector<Recorded> views;
  for (const DatasetEntry& entry : dataset.entries) {
    views.push_back({entry.file, entry.pose ? std::optional(entry.pose->position()) : std::nullopt,
                     recogniser.encoder().panorama(read_observation(entry))});
  }
  const auto number_of = [&](const std::string& wanted) {
    return static_cast<std::size_t>(std::ranges::find(views, wanted, &Recorded::file) -
                                    views.begin());
  };
  const auto turned = [&](std::size_t i, std::size_t turn) {
    Random random(options.seed + turn, i);
    const auto columns = static_cast<std::uint64_t>(views[i].panorama.columns());
    return turn_columns(views[i].panorama, static_cast<int>(random.index(columns)));
  };

  const std::size_t asked = views.size() * turns;
  struct Answer {
    Place place;
    double milliseconds;
  };
  const auto answers = make_each(executor, asked, [&](std::size_t n) {
    const Observation seen(turned(n / turns, n % turns));
    const double start = thread_seconds();
    Place place = recogniser.localise(seen, {&views[n / turns].file, 1});
    return Answer{std::move(place), 1000.0 * (thread_seconds() - start)};
  });
  std::size_t near_count = 0;
  std::size_t known = 0;
  std::size_t placed = 0;
  std::size_t inside = 0;
  std::vector<double> milliseconds;
  for (std::size_t n = 0; n < asked; ++n) {
    const Place& place = answers[n].place;
    const Recorded& truth = views[n / turns];
    milliseconds.push_back(answers[n].milliseconds);
    near_count += is_near(views, n / turns, number_of(place.matches.at(0).name)) ? 1 : 0;
    known += place.known ? 1 : 0;
    if (!place.position || !place.position->radius_m || !truth.position) continue;
    ++placed;
    const double off_m = distance({place.position->x_m, place.position->y_m}, *truth.position);
    inside += off_m <= *place.position->radius_m ? 1 : 0;
  }
  const std::string id = "elsewhere." + name;
  const std::string what = name + ", each of " + std::to_string(views.size()) +
                           " pictures, turned at random " + std::to_string(turns) +
                           " times, asked of the memory of the others: ";
  const std::string near = views.front().position
                               ? "best match within 1.5 times the distance of the nearest"
                               : "best match is the picture before or after";
  add_rate(result, id + ".near", what + near, near_count, asked,
           name == "ciirc_b670" ? std::optional(at_least(29.0 / 31.0)) : std::nullopt);
  add_rate(result, id + ".known", what + "places known", known, asked);
  if (placed > 0) {
    add_rate(result, id + ".radius", what + "positions within the stated 95 % radius", inside,
             placed, at_least(0.9));
  }
  add_median(result, id + ".time", what + "processor time from the panorama to the answer", "ms",
             milliseconds, at_most(5.0));
  add_row(result, id + ".bytes", what + "size of the memory file, for each view",
          static_cast<double>(std::filesystem::file_size(file)) / static_cast<double>(views.size()),
          "B", at_most(20'000.0));

  const std::vector<std::function<std::unique_ptr<RivalRecogniser>()>> makers{
      [] { return fourier_signature_recogniser(); },
      [] { return pixels_over_all_turns_recogniser(); },
      [] { return patch_normalised_recogniser(); }};
  std::vector<RivalView> references;
  for (const Recorded& view : views) references.push_back({view.panorama});
  for (const auto& make : makers) {
    const auto rival = make();
    rival->memorise(references);
    struct Found {
      std::size_t view;
      double milliseconds;
    };
    const auto found = make_each(executor, asked, [&](std::size_t n) {
      const RivalView query{turned(n / turns, n % turns)};
      const double start = thread_seconds();
      const std::size_t view = rival->nearest(query, n / turns);
      return Found{view, 1000.0 * (thread_seconds() - start)};
    });
    std::size_t count = 0;
    std::vector<double> times;
    for (std::size_t n = 0; n < asked; ++n) {
      count += is_near(views, n / turns, found[n].view) ? 1 : 0;
      times.push_back(found[n].milliseconds);
    }
    std::string key = rival->name();
    std::ranges::replace(key, ' ', '_');
    add_rate(result, id + "." + key + ".near", what + "rival, " + rival->name() + ": " + near,
             count, asked);
    add_median(result, id + "." + key + ".time",
               what + "rival, " + rival->name() + ": processor time", "ms", times);
    add_row(result, id + "." + key + ".bytes", what + "rival, " + rival->name() + ": bytes a view",
            rival->bytes_per_view(), "B");
  }
  std::filesystem::remove(file);
}

}  // namespace panonav
