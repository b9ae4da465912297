// [M04] figures 4 and 5, and table 1 of [M03]: what the Fourier signature is and keeps.

#include <algorithm>
#include <cmath>
#include <string>

#include "panonav/core/random.hpp"
#include "panonav/evaluation/m04_figures.hpp"
#include "panonav/evaluation/plot.hpp"
#include "panonav/evaluation/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {

namespace {

std::vector<double> mean_power(const Panorama& view, int components) {
  const FourierSignature signature = compute_signature(view, components);
  std::vector<double> power(static_cast<std::size_t>(components));
  for (int k = 0; k < components; ++k) {
    for (int y = 0; y < signature.rows(); ++y) {
      const double magnitude = signature.magnitude(y, k);
      power[static_cast<std::size_t>(k)] += magnitude * magnitude / signature.rows();
    }
  }
  return power;
}

// Slope of log power against log k, k = 1 .. last, by least squares.
double spectrum_slope(const std::vector<double>& power, int last) {
  double n = 0.0;
  double sx = 0.0;
  double sy = 0.0;
  double sxx = 0.0;
  double sxy = 0.0;
  for (int k = 1; k <= last; ++k) {
    const double x = std::log(k);
    const double y = std::log(power[static_cast<std::size_t>(k)]);
    n += 1.0;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace

void reproduce_memory_table(Reproduction& result) {
  const Image raw(640, 480, 3);
  const int cylinder_channels = 3;
  const Panorama cylinder(80, 512, std::nullopt);
  const PackedSignature packed = pack(compute_signature(cylinder, 15), 1.0F);
  const auto row = [&](std::string id, std::string what, double published, double bits) {
    result.rows.push_back({.id = "m04." + id,
                           .what = std::move(what),
                           .published = std::pair{published, published},
                           .ours = bits / 1000.0,
                           .interval = std::nullopt,
                           .unit = "kbit",
                           .target = Target{Comparison::at_most, published * 1.015}});
  };
  row("table1.raw", "[M03] table 1: raw colour image, 640 x 480", 7300.0,
      8.0 * static_cast<double>(raw.pixels().size()));
  row("table1.cylinder", "[M03] table 1: panoramic cylinder, 512 x 80, in colour", 980.0,
      8.0 * cylinder_channels * static_cast<double>(cylinder.values().size()));
  row("table1.signature", "[M03] table 1: Fourier signature, packed", 19.0,
      8.0 * static_cast<double>(packed.magnitudes.size() + packed.phases.size()));
}

void reproduce_rotational_invariance(const std::vector<PlaceRecording>& recordings,
                                     std::uint64_t seed, Reproduction& result) {
  std::vector<double> ratios;
  std::vector<double> heading_errors_deg;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const auto& views = recordings[r].references;
    Random random(seed, r);
    for (std::size_t i = 0; i + 1 < views.size(); ++i) {
      // The next reference of the raster is the neighbour one spacing away, where it is not a new
      // row.
      if (distance(views[i].pose.position(), views[i + 1].pose.position()) >
          1.01 * recordings[r].spacing_m) {
        continue;
      }
      const double turn_rad = random.uniform(-3.14159, 3.14159);
      Pose2 turned = views[i].pose;
      turned.heading_rad = wrap_angle(turned.heading_rad + turn_rad);
      const FourierSignature here = compute_signature(views[i].panorama);
      const FourierSignature there = compute_signature(views[i + 1].panorama);
      // A second picture at the same place: other noise and another heading, not a shifted copy.
      const FourierSignature again =
          compute_signature(recordings[r].take(turned, seed * 1000003U + i));
      ratios.push_back(dissimilarity_l1(here, again) / dissimilarity_l1(here, there));
      if (const auto reading = compass(again, here)) {
        heading_errors_deg.push_back(
            degrees(std::abs(angle_difference(reading->heading_rad, turn_rad))));
      }
      if (ratios.size() % 40 == 0) break;  // 40 places of each scene are enough
    }
  }
  result.rows.push_back(
      {.id = "m04.fig4.turn_against_step",
       .what = "figure 4: dissimilarity after a turn on the spot, as a share of that to the next "
               "reference 25 cm away (median)",
       .published = std::nullopt,
       .ours = median(ratios),
       .interval = median_interval(ratios, seed),
       .unit = "",
       .target = Target{Comparison::at_most, 0.5}});
  result.rows.push_back({.id = "m04.fig4.heading_error",
                         .what = "figure 4: error of the turn read from the phases (median)",
                         .published = std::nullopt,
                         .ours = median(heading_errors_deg),
                         .interval = median_interval(heading_errors_deg, seed),
                         .unit = "deg",
                         .target = Target{Comparison::at_most, 1.0}});
}

void reproduce_power_spectrum(const std::vector<PlaceRecording>& recordings,
                              const std::filesystem::path& folder, Reproduction& result) {
  constexpr int kAll = 256;
  constexpr int kShown = 30;
  std::vector<double> total(kAll);
  std::vector<double> shares;
  std::size_t views = 0;
  for (const auto& recording : recordings) {
    for (const auto& query : recording.queries) {
      const auto power = mean_power(query.panorama, kAll);
      double all = 0.0;
      double first = 0.0;
      for (int k = 1; k < kAll; ++k) {
        all += power[static_cast<std::size_t>(k)];
        if (k < 15) first += power[static_cast<std::size_t>(k)];
      }
      shares.push_back(first / all);
      for (int k = 0; k < kAll; ++k) {
        total[static_cast<std::size_t>(k)] += power[static_cast<std::size_t>(k)];
      }
      ++views;
    }
  }
  const auto one = mean_power(recordings.front().queries.front().panorama, kAll);
  LinePlot plot{
      .title = "Power spectrum of the panoramic cylinder, mean over rows ([M04] figure 5)",
      .x_label = "frequency k [cycles per turn]",
      .y_label = "power A_k^2 [squared brightness]",
      .series = {},
      .log_y = true};
  Series single{.label = "one view", .style = SeriesStyle::lines_and_points};
  Series average{.label = "mean of " + std::to_string(views) + " views"};
  for (int k = 1; k <= kShown; ++k) {
    single.x.push_back(k);
    single.y.push_back(one[static_cast<std::size_t>(k)]);
    average.x.push_back(k);
    average.y.push_back(total[static_cast<std::size_t>(k)] / static_cast<double>(views));
  }
  plot.series = {single, average};
  write_plot(folder / "fig05_power_spectrum.png", plot);
  result.pictures.push_back(
      {"fig05_power_spectrum.png",
       "Power falls steeply with frequency: the first 15 components hold most of it."});
  result.rows.push_back(
      {.id = "m04.fig5.share_15",
       .what = "figure 5: share of the power (without k = 0) in the first 15 components (median)",
       .published = std::nullopt,
       .ours = median(shares),
       .interval = median_interval(shares, 1),
       .unit = "",
       .target = Target{Comparison::at_least, 0.5}});
  result.rows.push_back(
      {.id = "m04.fig5.slope",
       .what = "slope of the power spectrum, k = 1 .. 30 ([S06] reports about 1.8)",
       .published = std::pair{1.8, 1.8},
       .ours = -spectrum_slope(total, kShown),
       .interval = std::nullopt,
       .unit = "",
       .target = std::nullopt});
}

}  // namespace panonav
