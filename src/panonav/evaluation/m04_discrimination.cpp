// [M04] figures 6, 7 and 8: how well dissimilarity tells places apart; and the rivals.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <string>

#include "panonav/evaluation/m04_figures.hpp"
#include "panonav/evaluation/plot.hpp"
#include "panonav/evaluation/rivals.hpp"
#include "panonav/evaluation/statistics.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

constexpr std::array kComponents{2, 5, 15, 50, 256};

std::vector<FourierSignature> signatures_of(const std::vector<PlacedView>& views, int components,
                                            Executor& executor) {
  std::vector<std::optional<FourierSignature>> slots(views.size());
  executor.for_chunks(views.size(), 4, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      slots[i] = compute_signature(views[i].panorama, components);
    }
  });
  std::vector<FourierSignature> result;
  result.reserve(slots.size());
  for (auto& slot : slots) result.push_back(std::move(*slot));
  return result;
}

std::vector<double> dissimilarities(const FourierSignature& query,
                                    const std::vector<FourierSignature>& references,
                                    int components) {
  std::vector<double> values;
  values.reserve(references.size());
  for (const auto& reference : references) {
    values.push_back(dissimilarity_l1(query, reference, components));
  }
  return values;
}

std::size_t index_of_smallest(const std::vector<double>& values) {
  return static_cast<std::size_t>(std::min_element(values.begin(), values.end()) - values.begin());
}

std::pair<double, double> interval_of(const Proportion& p) {
  return {p.low, p.high};
}

// Whether the reference found is the nearest one or touches its cell: a query on the border of two
// cells has two right answers.
bool right_cell(const PlaceRecording& recording, std::size_t found, Point2 position) {
  return distance(recording.references[found].pose.position(), position) <= recording.spacing_m;
}

}  // namespace

void reproduce_discrimination(const std::vector<PlaceRecording>& recordings,
                              const std::filesystem::path& folder, Executor& executor,
                              Reproduction& result) {
  std::array<std::size_t, kComponents.size()> exact{};
  std::array<std::vector<double>, kComponents.size()> errors_m;
  std::array<std::vector<double>, kComponents.size()> contrasts;
  std::size_t trials = 0;
  LinePlot profile{
      .title = "Similarity of one view to the references along a row of the grid ([M04] figure 6)",
      .x_label = "position of the reference [m]",
      .y_label = "similarity (0 .. 1000)",
      .series = {}};
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const PlaceRecording& recording = recordings[r];
    const auto references = signatures_of(recording.references, kComponents.back(), executor);
    const auto queries = signatures_of(recording.queries, kComponents.back(), executor);
    for (std::size_t q = 0; q < queries.size(); ++q) {
      const Point2 position = recording.queries[q].pose.position();
      const std::size_t nearest = recording.nearest_reference(position);
      ++trials;
      for (std::size_t c = 0; c < kComponents.size(); ++c) {
        const auto values = dissimilarities(queries[q], references, kComponents[c]);
        const std::size_t found = index_of_smallest(values);
        exact[c] += found == nearest ? 1 : 0;
        errors_m[c].push_back(distance(recording.references[found].pose.position(), position));
        // How far the right place stands out: its dissimilarity against that of a place chosen
        // blindly.
        contrasts[c].push_back(values[nearest] / median(values));
        if (r == 0 && q == 0) {
          const auto scaled = similarities(values);
          Series line{.label = std::to_string(kComponents[c]) + " components"};
          for (std::size_t i = 0; i < references.size(); ++i) {
            if (std::abs(recording.references[i].pose.y_m -
                         recording.references[nearest].pose.y_m) < 1e-6) {
              line.x.push_back(recording.references[i].pose.x_m);
              line.y.push_back(scaled[i]);
            }
          }
          profile.series.push_back(std::move(line));
        }
      }
    }
  }
  if (!recordings.empty() && !recordings[0].queries.empty()) {
    const double x = recordings[0].queries[0].pose.x_m;
    profile.series.push_back(
        {.label = "true position", .x = {x, x}, .y = {0.0, 1000.0}, .style = SeriesStyle::lines});
  }
  write_plot(folder / "fig06_similarity_profile.png", profile);
  result.pictures.push_back({"fig06_similarity_profile.png",
                             "With 2 components the peak is broad; from 15 on it stands clear at "
                             "the true position, and more components change little."});

  LinePlot rates{.title = "Nearest reference found, by number of components",
                 .x_label = "number of components",
                 .y_label = "share of queries",
                 .series = {Series{.label = "nearest reference"}},
                 .log_x = true,
                 .y_range = std::pair{0.0, 1.0}};
  std::array<Proportion, kComponents.size()> found{};
  for (std::size_t c = 0; c < kComponents.size(); ++c) {
    found[c] = success_rate(exact[c], trials);
    rates.series[0].x.push_back(kComponents[c]);
    rates.series[0].y.push_back(found[c].value);
    rates.series[0].y_low.push_back(found[c].low);
    rates.series[0].y_high.push_back(found[c].high);
    const std::string m = std::to_string(kComponents[c]);
    result.rows.push_back(
        {.id = "m04.fig6.exact_" + m,
         .what = "figure 6: queries whose nearest reference is found with " + m + " components",
         .published = std::nullopt,
         .ours = found[c].value,
         .interval = interval_of(found[c]),
         .unit = "",
         .target = std::nullopt});
    result.rows.push_back(
        {.id = "m04.fig6.contrast_" + m,
         .what = "figure 6: dissimilarity at the right reference over that of a typical one, " + m +
                 " components (median; small is good)",
         .published = std::nullopt,
         .ours = median(contrasts[c]),
         .interval = median_interval(contrasts[c], 1),
         .unit = "",
         .target = std::nullopt});
  }
  write_plot(folder / "fig06_success.png", rates);
  result.pictures.push_back(
      {"fig06_success.png",
       "15 components find the nearest reference about as often as 50 or 256."});
  result.rows.push_back(
      {.id = "m04.fig6.fifteen_against_more",
       .what = "figure 6: success with 15 components less the better of 50 and 256",
       .published = std::pair{0.0, 0.0},
       .ours = found[2].value - std::max(found[3].value, found[4].value),
       .interval = std::nullopt,
       .unit = "",
       .target = Target{Comparison::at_least, -0.02}});
  result.rows.push_back({.id = "m04.fig6.fifteen_against_two",
                         .what = "figure 6: success with 15 components less that with 2",
                         .published = std::nullopt,
                         .ours = found[2].value - found[0].value,
                         .interval = std::nullopt,
                         .unit = "",
                         .target = Target{Comparison::at_least, 0.0}});
  result.rows.push_back(
      {.id = "m04.fig6.error_15",
       .what = "distance from the query to the reference found, 15 components, 25 cm grid (median)",
       .published = std::nullopt,
       .ours = median(errors_m[2]),
       .interval = median_interval(errors_m[2], 1),
       .unit = "m",
       .target = Target{Comparison::at_most, 0.177}});
}

void reproduce_distance_curve(const std::vector<PlaceRecording>& recordings,
                              const std::filesystem::path& folder, Executor& executor,
                              Reproduction& result) {
  // All pairs of references, binned by distance; each scene is scaled by its own saturation level,
  // because the absolute value depends on the place and carries no meaning [M04 section 2.2].
  LinePlot plot{.title = "Dissimilarity against distance ([M04] figure 7)",
                .x_label = "distance between the views [m]",
                .y_label = "dissimilarity, 1 = level of far views",
                .series = {}};
  std::vector<double> linear_ranges;
  std::vector<double> saturation_distances;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const PlaceRecording& recording = recordings[r];
    const auto signatures = signatures_of(recording.references, 15, executor);
    constexpr double kBin = 0.25;
    std::vector<double> sums;
    std::vector<double> counts;
    for (std::size_t i = 0; i < signatures.size(); ++i) {
      for (std::size_t j = i + 1; j < signatures.size(); ++j) {
        const double d = distance(recording.references[i].pose.position(),
                                  recording.references[j].pose.position());
        const auto bin = static_cast<std::size_t>(std::lround(d / kBin));
        if (bin >= sums.size()) {
          sums.resize(bin + 1);
          counts.resize(bin + 1);
        }
        sums[bin] += dissimilarity_l1(signatures[i], signatures[j]);
        counts[bin] += 1.0;
      }
    }
    Series line{.label = "scene " + std::to_string(r + 1)};
    // The level of far views: the mean over the farther half of all distances.
    double far_sum = 0.0;
    double far_count = 0.0;
    for (std::size_t b = sums.size() / 2; b < sums.size(); ++b) {
      far_sum += sums[b];
      far_count += counts[b];
    }
    const double level = far_sum / far_count;
    for (std::size_t b = 1; b < sums.size(); ++b) {
      if (counts[b] < 10) continue;
      line.x.push_back(static_cast<double>(b) * kBin);
      line.y.push_back(sums[b] / counts[b] / level);
    }
    // Linear range: as far as the mean stays within 10 % of the line through the first two bins.
    const double slope = (line.y[1] - line.y[0]) / (line.x[1] - line.x[0]);
    double linear = line.x[1];
    for (std::size_t b = 2; b < line.x.size(); ++b) {
      const double expected = line.y[0] + slope * (line.x[b] - line.x[0]);
      if (std::abs(line.y[b] - expected) > 0.1 * expected) break;
      linear = line.x[b];
    }
    linear_ranges.push_back(linear);
    const auto saturated =
        std::find_if(line.y.begin(), line.y.end(), [](double value) { return value >= 0.95; });
    saturation_distances.push_back(
        saturated == line.y.end() ? line.x.back()
                                  : line.x[static_cast<std::size_t>(saturated - line.y.begin())]);
    if (r < 5) plot.series.push_back(std::move(line));
  }
  write_plot(folder / "fig07_dissimilarity_distance.png", plot);
  result.pictures.push_back(
      {"fig07_dissimilarity_distance.png",
       "Dissimilarity grows steadily with distance, first along a line, and then saturates."});
  const auto row = [&](std::string id, std::string what, const std::vector<double>& values) {
    result.rows.push_back({.id = "m04.fig7." + id,
                           .what = std::move(what),
                           .published = std::nullopt,
                           .ours = median(values),
                           .interval = median_interval(values, 1),
                           .unit = "m",
                           .target = std::nullopt});
  };
  row("linear_range",
      "figure 7: distance up to which dissimilarity stays within 10 % of a line (median over "
      "scenes)",
      linear_ranges);
  row("saturation",
      "figure 7: distance at which dissimilarity reaches 95 % of the level of far views (median "
      "over scenes)",
      saturation_distances);
}

void reproduce_similarity_surface(const PlaceRecording& recording,
                                  const std::filesystem::path& folder, Reproduction& result) {
  if (recording.queries.empty()) return;
  const PlacedView& query = recording.queries.front();
  const FourierSignature wanted = compute_signature(query.panorama);
  std::vector<double> values;
  Point2 low = recording.references.front().pose.position();
  Point2 high = low;
  for (const auto& reference : recording.references) {
    values.push_back(dissimilarity_l1(wanted, compute_signature(reference.panorama)));
    const Point2 p = reference.pose.position();
    low = {std::min(low.x_m, p.x_m), std::min(low.y_m, p.y_m)};
    high = {std::max(high.x_m, p.x_m), std::max(high.y_m, p.y_m)};
  }
  const auto scaled = similarities(values);
  HeatMap map{
      .title =
          "Similarity at every reference view; cross: where the view was taken ([M04] figure 8)",
      .value_label = "similarity"};
  map.spacing_m = recording.spacing_m;
  map.first_cell = low;
  map.columns = static_cast<int>(std::lround((high.x_m - low.x_m) / map.spacing_m)) + 1;
  map.rows = static_cast<int>(std::lround((high.y_m - low.y_m) / map.spacing_m)) + 1;
  map.values.assign(static_cast<std::size_t>(map.columns) * map.rows, std::nan(""));
  for (std::size_t i = 0; i < recording.references.size(); ++i) {
    const Point2 p = recording.references[i].pose.position();
    const auto column = std::lround((p.x_m - low.x_m) / map.spacing_m);
    const auto row = std::lround((p.y_m - low.y_m) / map.spacing_m);
    map.values[static_cast<std::size_t>(row) * map.columns + static_cast<std::size_t>(column)] =
        scaled[i];
  }
  map.crosses = {query.pose.position()};
  write_plot(folder / "fig08_similarity_surface.png", map);
  result.pictures.push_back(
      {"fig08_similarity_surface.png",
       "Similarity is highest around the place where the view was taken and falls on all sides."});
}

void compare_rivals(const std::vector<PlaceRecording>& recordings,
                    const std::filesystem::path& folder, Executor& executor, Reproduction& result) {
  const auto make = [](std::size_t which) {
    switch (which) {
      case 0:
        return fourier_signature_recogniser(15);
      case 1:
        return grey_histogram_recogniser(64);
      case 2:
        return eigenimage_recogniser(15);
      case 3:
        return zero_phase_recogniser();
      default:
        return pixels_over_all_turns_recogniser();
    }
  };
  constexpr std::size_t kRivals = 5;
  LinePlot plot{.title = "Queries answered with a reference within one grid spacing",
                .x_label = "",
                .y_label = "share of queries",
                .series = {Series{.style = SeriesStyle::bars}},
                .y_range = std::pair{0.0, 1.05}};
  for (std::size_t which = 0; which < kRivals; ++which) {
    std::size_t right = 0;
    std::size_t trials = 0;
    double seconds = 0.0;
    double bytes = 0.0;
    std::string name;
    for (const auto& recording : recordings) {
      std::vector<Panorama> references;
      for (const auto& view : recording.references) references.push_back(view.panorama);
      const auto recogniser = make(which);
      recogniser->memorise(references);
      name = recogniser->name();
      bytes = recogniser->bytes_per_view();
      std::vector<std::size_t> found(recording.queries.size());
      const auto start = std::chrono::steady_clock::now();
      executor.for_chunks(found.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t q = begin; q < end; ++q) {
          found[q] = recogniser->nearest(recording.queries[q].panorama);
        }
      });
      seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      for (std::size_t q = 0; q < found.size(); ++q) {
        right += right_cell(recording, found[q], recording.queries[q].pose.position()) ? 1 : 0;
      }
      trials += found.size();
    }
    const Proportion rate = success_rate(right, trials);
    std::string id = name;
    std::replace(id.begin(), id.end(), ' ', '_');
    plot.series[0].x.push_back(static_cast<double>(which));
    plot.series[0].y.push_back(rate.value);
    plot.series[0].y_low.push_back(rate.low);
    plot.series[0].y_high.push_back(rate.high);
    plot.x_tick_labels.push_back(name);
    const auto row = [&](const std::string& what, const std::string& key, double value,
                         std::string unit, std::optional<std::pair<double, double>> interval) {
      result.rows.push_back({.id = "m04.rivals." + id + "." + key,
                             .what = "rivals: " + name + ", " + what,
                             .published = std::nullopt,
                             .ours = value,
                             .interval = interval,
                             .unit = std::move(unit),
                             .target = std::nullopt});
    };
    row("reference within one spacing", "success", rate.value, "", interval_of(rate));
    row("bytes a view", "bytes", bytes, "B", std::nullopt);
    row("time a query, image to answer", "time",
        1000.0 * seconds * executor.threads() / static_cast<double>(trials), "ms", std::nullopt);
  }
  write_plot(folder / "rivals.png", plot);
  result.pictures.push_back(
      {"rivals.png",
       "The Fourier signature beside what the paper argues against, on the same views."});
}

}  // namespace panonav
