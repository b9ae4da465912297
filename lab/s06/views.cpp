// [S06] figures 3, 6, 7 and 8: spectra of views, and how views change with distance.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "lab/baselines/rotation_products.hpp"
#include "lab/rows.hpp"
#include "lab/s06/support.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

namespace {

constexpr int max_frequency = s06_components - 1;  // highest frequency of 72 pixels

TurnCorrelation correlate_views(const HomingView& home, const HomingView& current, int highest) {
  TurnCorrelation correlation;
  correlation.highest = highest;
  for (int k = 1; k <= highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    correlation.real[i] = home.a(0, k) * current.a(0, k) + home.b(0, k) * current.b(0, k);
    correlation.imaginary[i] = home.a(0, k) * current.b(0, k) - home.b(0, k) * current.a(0, k);
  }
  return correlation;
}

double energy(const HomingView& view) {
  double sum = 0.0;
  for (int k = 1; k <= max_frequency; ++k) {
    sum += static_cast<double>(view.a(0, k) * view.a(0, k) + view.b(0, k) * view.b(0, k));
  }
  return sum;
}

double true_turn_rad(const Arena& arena, std::size_t goal, std::size_t place) {
  return wrap_angle(arena.homes.views[goal].pose.heading_rad -
                    arena.currents.views[place].pose.heading_rad);
}

// Draws figure 3.
void draw_correlation(const Arena& arena, Reproduction& result) {
  // Choose the place whose two headings differ by nearly 120 degrees, as in the paper.
  std::size_t shown = 0;
  double min_difference = 10.0;
  for (std::size_t i = 0; i < arena.homes.views.size(); ++i) {
    const double off =
        std::abs(std::abs(true_turn_rad(arena, i, i)) - 2.0 * std::numbers::pi / 3.0);
    if (off < min_difference) {
      min_difference = off;
      shown = i;
    }
  }
  const HomingView& home = arena.homes.views[shown].view;
  const HomingView& current = arena.currents.views[shown].view;
  const double max_correlation = std::sqrt(energy(home) * energy(current));
  const TurnCorrelation all = correlate_views(home, current, max_frequency);
  const double truth = true_turn_rad(arena, shown, shown);

  viewer::LinePlot terms{.title = "Terms of the correlation; true turn " +
                                  std::to_string(std::lround(degrees(truth))) + " degrees",
                         .x_label = "turn [degrees]",
                         .y_label = "share of the largest possible correlation"};
  for (int k = 0; k <= 5; ++k) {
    viewer::Series series{.label = k == 0 ? "all" : "k = " + std::to_string(k),
                          .style = viewer::SeriesStyle::lines};
    for (int step = -180; step <= 180; step += 2) {
      const double turn_rad = radians(step);
      TurnCorrelation one = all;
      for (int other = 1; k > 0 && other <= max_frequency; ++other) {
        if (other != k) one.real[other] = one.imaginary[other] = 0.0F;
      }
      series.add(step, static_cast<double>(one.at(static_cast<float>(turn_rad))) / max_correlation);
    }
    terms.series.push_back(std::move(series));
  }
  add_plot(result, "figure_03_correlation.svg",
           "[S06] figure 3a: the first five terms of the correlation of two views from one place, "
           "and the whole. Only the whole has one clear maximum.",
           terms);

  viewer::LinePlot maxima{.title = "Turn at the largest correlation",
                          .x_label = "highest frequency K",
                          .y_label = "error [degrees]"};
  viewer::Series series;
  for (int highest = 1; highest <= 20; ++highest) {
    std::array<float, 1> turn{};
    if (find_highest_peaks(correlate_views(home, current, highest), turn) == 0) continue;
    series.add(highest, degrees(angle_difference(static_cast<double>(turn[0]), truth)));
  }
  maxima.series.push_back(std::move(series));
  add_plot(result, "figure_03_maximum.svg",
           "[S06] figure 3b: the turn of the same two views by their first K frequencies, less the "
           "truth.",
           maxima);
}

// Draws figure 6.
void draw_spectrum(const Arena& arena, Reproduction& result) {
  viewer::Series series{.style = viewer::SeriesStyle::lines_and_points};
  std::vector<double> log_k;
  std::vector<double> log_power;
  for (int k = 1; k <= max_frequency; ++k) {
    std::vector<double> powers;
    for (const auto* const recording : {&arena.homes, &arena.currents}) {
      for (const auto& placed : recording->views) {
        const auto a = static_cast<double>(placed.view.a(0, k));
        const auto b = static_cast<double>(placed.view.b(0, k));
        powers.push_back(a * a + b * b);
      }
    }
    const double mean_power = mean(powers);
    double square = 0.0;
    for (const double power : powers) square += (power - mean_power) * (power - mean_power);
    const double deviation = std::sqrt(square / static_cast<double>(powers.size()));
    series.add(k, mean_power);
    // End the bar above 0, which a logarithmic axis cannot show.
    series.y_low.push_back(std::max(mean_power - deviation, 0.1 * mean_power));
    series.y_high.push_back(mean_power + deviation);
    // Fit only k <= 15: pixels of 5 degrees blur higher frequencies (77 % of the power remains at k
    // = 20).
    if (k <= 15) {
      log_k.push_back(std::log(k));
      log_power.push_back(std::log(mean_power));
    }
  }
  const double mean_k = mean(log_k);
  const double mean_log = mean(log_power);
  double xy = 0.0;
  double xx = 0.0;
  for (std::size_t i = 0; i < log_k.size(); ++i) {
    xy += (log_k[i] - mean_k) * (log_power[i] - mean_log);
    xx += (log_k[i] - mean_k) * (log_k[i] - mean_k);
  }
  const double slope = -xy / xx;
  add_row(result, "s06.spectrum.slope",
          "power falls with frequency to the power of minus this, k = 1 .. 15", slope, "",
          std::nullopt, std::pair(1.8, 1.8));
  viewer::Series line{
      .label = "slope " + to_fixed_text(std::round(100.0 * slope) / 100.0, 6).substr(0, 4),
      .style = viewer::SeriesStyle::lines};
  for (int k = 1; k <= max_frequency; ++k) {
    line.add(k, std::exp(mean_log - slope * (std::log(k) - mean_k)));
  }
  series.label = "mean and standard deviation";
  add_plot(result, "figure_06_spectrum.svg",
           "[S06] figure 6: mean power of the views; a straight line is a power law.",
           viewer::LinePlot{.title = "Power spectrum of all views of the arena",
                            .x_label = "frequency k",
                            .y_label = "squared amplitude",
                            .series = {std::move(series), std::move(line)},
                            .log_x = true,
                            .log_y = true});
}

// Two values per curve, for one pair of places or summed over pairs.
using CurveValues = std::vector<std::pair<double, double>>;

// Sums of values over all pairs of places, binned by distance.
struct PairSums {
  std::vector<CurveValues> sums;  // per distance bin
  std::vector<double> pairs;      // number of pairs per distance bin

  explicit PairSums(std::size_t curves) : sums(bins, CurveValues(curves)), pairs(bins) {}
  void add(const PairSums& other) {
    for (std::size_t i = 0; i < bins; ++i) {
      pairs[i] += other.pairs[i];
      for (std::size_t s = 0; s < sums[i].size(); ++s) {
        sums[i][s].first += other.sums[i][s].first;
        sums[i][s].second += other.sums[i][s].second;
      }
    }
  }
  static constexpr std::size_t bins = 62;
};

// Sums the values that `fill` computes for each pair of places. The result is the same on any
// number of threads.
template <typename Fill>
PairSums sum_pairs(const Arena& arena, std::size_t curves, Executor& executor, Fill fill) {
  const auto& homes = arena.homes.views;
  const auto& currents = arena.currents.views;
  constexpr std::size_t chunk = 64;
  std::vector<PairSums> parts((homes.size() + chunk - 1) / chunk, PairSums(curves));
  executor.for_each_chunk(
      homes.size(), chunk, [&](std::size_t begin, std::size_t end, std::size_t number) {
        PairSums& part = parts[number];
        CurveValues pair_values(curves);
        for (std::size_t g = begin; g < end; ++g) {
          for (std::size_t p = 0; p < currents.size(); ++p) {
            const double away_m = distance(homes[g].pose.position(), currents[p].pose.position());
            const auto bin = static_cast<std::size_t>(away_m / arena.options.spacing_m + 0.5);
            if (bin >= PairSums::bins) continue;
            fill(g, p, pair_values);
            part.pairs[bin] += 1.0;
            for (std::size_t s = 0; s < curves; ++s) {
              part.sums[bin][s].first += pair_values[s].first;
              part.sums[bin][s].second += pair_values[s].second;
            }
          }
        }
      });
  PairSums all(curves);
  for (const PairSums& part : parts) all.add(part);
  return all;
}

// Makes a curve against the distance, from bins with at least 100 pairs.
template <typename Value>
viewer::Series make_curve_by_distance(const Arena& arena, const PairSums& sums,
                                      double max_distance_m, const Value& value) {
  viewer::Series series;
  for (std::size_t i = 0; i < PairSums::bins; ++i) {
    if (sums.pairs[i] < 100.0) continue;
    const double x = static_cast<double>(i) * arena.options.spacing_m;
    if (x > max_distance_m) break;
    series.add(x, value(i));
  }
  return series;
}

// Rotates all views to heading 0, as in the paper.
std::vector<HomingView> rotate_to_north(const ArenaRecording& recording) {
  std::vector<HomingView> views;
  for (const auto& placed : recording.views) {
    views.push_back(rotate(placed.view, -placed.pose.heading_rad));
  }
  return views;
}

// Draws figure 7.
void draw_changes(const Arena& arena, Executor& executor, Reproduction& result) {
  constexpr std::array<int, 6> shown{1, 2, 3, 5, 10, 20};
  const auto homes = rotate_to_north(arena.homes);
  const auto currents = rotate_to_north(arena.currents);
  const auto sums = sum_pairs(
      arena, shown.size() + 1, executor, [&](std::size_t g, std::size_t p, CurveValues& values) {
        double all = 0.0;
        for (int k = 1; k <= max_frequency; ++k) {
          const double da = static_cast<double>(homes[g].a(0, k) - currents[p].a(0, k));
          const double db = static_cast<double>(homes[g].b(0, k) - currents[p].b(0, k));
          all += da * da + db * db;
        }
        for (std::size_t s = 0; s < shown.size(); ++s) {
          const auto ha = static_cast<double>(homes[g].a(0, shown[s]));
          const auto hb = static_cast<double>(homes[g].b(0, shown[s]));
          const auto ca = static_cast<double>(currents[p].a(0, shown[s]));
          const auto cb = static_cast<double>(currents[p].b(0, shown[s]));
          const double lengths = std::sqrt((ha * ha + hb * hb) * (ca * ca + cb * cb));
          const double cosine = lengths > 0.0 ? (ha * ca + hb * cb) / lengths : 0.0;
          values[s] = {(ha - ca) * (ha - ca) + (hb - cb) * (hb - cb), 2.0 * (1.0 - cosine)};
        }
        values[shown.size()] = {all / 5.0, 0.0};
      });
  viewer::LinePlot changes{.title = "Change of Fourier coefficients",
                           .x_label = "distance [m]",
                           .y_label = "mean squared change"};
  viewer::LinePlot phases{.title = "Change of Fourier phases (2: unrelated)",
                          .x_label = "distance [m]",
                          .y_label = "mean of 2 (1 - cos(change))"};
  for (std::size_t s = 0; s <= shown.size(); ++s) {
    const auto add = [&](viewer::LinePlot& plot, double std::pair<double, double>::*value) {
      plot.series.push_back(make_curve_by_distance(arena, sums, 1.0, [&](std::size_t bin) {
        return sums.sums[bin][s].*value / sums.pairs[bin];
      }));
      plot.series.back().style = viewer::SeriesStyle::lines;
      plot.series.back().label =
          s < shown.size() ? "k = " + std::to_string(shown[s]) : "all frequencies / 5";
    };
    add(changes, &std::pair<double, double>::first);
    if (s < shown.size()) add(phases, &std::pair<double, double>::second);
  }
  add_plot(result, "figure_07_coefficients.svg",
           "[S06] figure 7a: change of coefficients with the distance, all pairs of places. It "
           "grows with the square of the distance farther out where frequencies are low.",
           changes);
  add_plot(result, "figure_07_phases.svg",
           "[S06] figure 7b: change of phases. High frequencies soon have nothing to do with each "
           "other.",
           phases);
}

// Returns for each pair of home and current view the shift by whole pixels with the highest
// correlation.
std::vector<std::vector<std::uint8_t>> find_best_shifts(const Arena& arena, Executor& executor) {
  const auto& currents = arena.currents.rows;
  std::vector<float> rows;
  for (const auto& row : currents) {
    double row_mean = 0.0;
    for (const float value : row) row_mean += static_cast<double>(value) / s06_columns;
    for (const float value : row) rows.push_back(value - static_cast<float>(row_mean));
  }
  const std::size_t stride = rotation_products_stride(s06_columns);
  std::vector<std::vector<std::uint8_t>> shifts(arena.homes.rows.size());
  executor.for_each_chunk(shifts.size(), 8, [&](std::size_t begin, std::size_t end, std::size_t) {
    std::vector<float> periodic(s06_columns + stride);
    std::vector<float> products(currents.size() * stride);
    std::vector<float> largest(currents.size());
    for (std::size_t g = begin; g < end; ++g) {
      for (std::size_t i = 0; i < periodic.size(); ++i) {
        periodic[i] = arena.homes.rows[g][i % s06_columns];
      }
      compute_rotation_products(rows, s06_columns, periodic, products, largest,
                                kernels::chosen_instructions());
      for (std::size_t p = 0; p < currents.size(); ++p) {
        const float* const row = products.data() + p * stride;
        shifts[g].push_back(
            static_cast<std::uint8_t>(std::find(row, row + s06_columns, largest[p]) - row));
      }
    }
  });
  return shifts;
}

// Returns the circular standard deviation, in degrees, of `count` errors, given the sums of their
// cosines and sines.
double circular_deviation_deg(const std::pair<double, double>& sums, double count) {
  const double length = std::hypot(sums.first, sums.second) / count;
  return degrees(std::sqrt(std::max(0.0, -2.0 * std::log(length))));
}

// Draws figure 8.
void draw_headings(const Arena& arena, Executor& executor, Reproduction& result) {
  constexpr std::array<int, 5> shown{1, 2, 3, 5, 15};
  const auto shifts = find_best_shifts(arena, executor);
  const auto sums = sum_pairs(
      arena, shown.size() + 1, executor, [&](std::size_t g, std::size_t p, CurveValues& values) {
        const double truth = true_turn_rad(arena, g, p);
        TurnCorrelation correlation =
            correlate_views(arena.homes.views[g].view, arena.currents.views[p].view, shown.back());
        for (std::size_t s = 0; s < shown.size(); ++s) {
          correlation.highest = shown[s];
          const double error = static_cast<double>(sequential_heading(correlation)) - truth;
          values[s] = {std::cos(error), std::sin(error)};
        }
        const double error = -2.0 * std::numbers::pi * shifts[g][p] / s06_columns - truth;
        values[shown.size()] = {std::cos(error), std::sin(error)};
      });
  const auto deviation = [&](std::size_t curve, std::size_t bin) {
    return circular_deviation_deg(sums.sums[bin][curve], sums.pairs[bin]);
  };
  viewer::LinePlot plot{.title = "Error of the heading",
                        .x_label = "distance [m]",
                        .y_label = "circular standard deviation [degrees]"};
  for (std::size_t s = 0; s <= shown.size(); ++s) {
    plot.series.push_back(make_curve_by_distance(
        arena, sums, 0.6, [&](std::size_t bin) { return deviation(s, bin); }));
    plot.series.back().label =
        s < shown.size() ? "K = " + std::to_string(shown[s]) : "all shifts by whole pixels";
    if (s == shown.size()) plot.series.back().style = viewer::SeriesStyle::lines;
  }
  add_plot(result, "figure_08_headings.svg",
           "[S06] figure 8: error of the heading that the phases tell, by the distance of the two "
           "views; all pairs, random headings.",
           plot);
  add_row(result, "s06.heading.at_goal", "error of the heading at no distance, K = 15, 72 pixels",
          deviation(4, 0), "deg", at_most(0.2), std::pair(1.5, 1.5));
  add_row(result, "s06.heading.at_goal_whole_pixels", "the same by all shifts of whole pixels",
          deviation(shown.size(), 0), "deg");
}

}  // namespace

void reproduce_view_figures(const Arena& arena, const Experiments& context) {
  const auto& [options, executor, result] = context;
  draw_correlation(arena, result);
  draw_spectrum(arena, result);
  draw_changes(arena, executor, result);
  draw_headings(arena, executor, result);
}

void reproduce_heading_with_pose_noise(const Arena& arena, Reproduction& result) {
  double cosines = 0.0;
  double sines = 0.0;
  const std::size_t places = arena.homes.views.size();
  for (std::size_t i = 0; i < places; ++i) {
    const double turned = static_cast<double>(sequential_heading(
        correlate_views(arena.homes.views[i].view, arena.currents.views[i].view, 15)));
    const double error = turned - true_turn_rad(arena, i, i);
    cosines += std::cos(error);
    sines += std::sin(error);
  }
  add_row(result, "s06.heading.at_goal_pose_noise",
          "error of the heading at no distance with the tracker's noise (3 mm, 2 degrees in each "
          "recording)",
          circular_deviation_deg({cosines, sines}, static_cast<double>(places)), "deg",
          std::nullopt, std::pair(1.5, 1.5));
}

}  // namespace panonav::lab
