// [M04] figures 4 and 5, and table 1 of [M03]: invariance, spectrum and size of the Fourier
// signature.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "lab/m04/experiment.hpp"
#include "lab/m04/support.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/compass.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

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

// Returns the least-squares slope of log power against log k for k = 1 .. last.
double fit_spectrum_exponent(const std::vector<double>& power, int last) {
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

class RotationalInvariance final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor& executor) override {
    // Collect references whose successor in raster order is one spacing away, which excludes row
    // ends.
    std::vector<std::size_t> reference_indices;
    for (std::size_t i = 0;
         i + 1 < place.references.size() && reference_indices.size() < max_places; ++i) {
      const double step =
          distance(place.references[i].pose.position(), place.references[i + 1].pose.position());
      if (step < 1.01 * place.spacing_m) reference_indices.push_back(i);
    }
    Random random(place.seed, 78);
    std::vector<double> turns_rad;
    std::vector<Pose2> turned;
    for (const std::size_t i : reference_indices) {
      turns_rad.push_back(random.uniform(-std::numbers::pi, std::numbers::pi));
      Pose2 pose = place.references[i].pose;
      pose.heading_rad = wrap_angle(pose.heading_rad + turns_rad.back());
      turned.push_back(pose);
    }
    // Take a second picture at the same position with another heading and other noise; a shifted
    // copy of the first one would differ too little.
    const auto repeated_signatures =
        compute_signatures(simulation::capture_views(place, place.rendering, turned,
                                                     place.seed * 100003U + 60000U, {}, executor),
                           m04_components, executor);
    for (std::size_t i = 0; i < reference_indices.size(); ++i) {
      const auto here =
          compute_signature(place.references[reference_indices[i]].panorama, m04_components);
      const auto there =
          compute_signature(place.references[reference_indices[i] + 1].panorama, m04_components);
      ratios_.push_back(dissimilarity_l1(here, repeated_signatures[i]) /
                        dissimilarity_l1(here, there));
      if (const auto reading = compass(repeated_signatures[i], here)) {
        heading_errors_deg_.push_back(
            degrees(std::abs(angle_difference(reading->heading_rad, turns_rad[i]))));
      }
      const auto compass_from_next = compass(repeated_signatures[i], there);
      if (compass_from_next && std::abs(turns_rad[i]) > min_turn_rad) {
        relative_errors_.push_back(std::abs(
            angle_difference(compass_from_next->heading_rad, turns_rad[i]) / turns_rad[i]));
      }
    }
  }

  void report(Reproduction& result) const override {
    add_row(result, "m04.fig4.turn_against_step",
            "figure 4: dissimilarity after a turn on the spot, as a share of that to the next "
            "reference 25 cm away (median)",
            median_figure(ratios_), "", at_most(0.5));
    add_row(result, "m04.fig4.heading_error",
            "figure 4: error of the turn read from the phases (median)",
            median_figure(heading_errors_deg_), "deg", at_most(1.0));
    add_row(result, "m04.heading_error_apart",
            "section 3.4: error of the heading between views 25 cm apart, as a share of the "
            "difference in heading (median)",
            median_figure(relative_errors_), "", at_most(0.1), std::pair{0.1, 0.1});
  }

 private:
  static constexpr std::size_t max_places = 40;
  static constexpr double min_turn_rad = 0.1;  // smaller rotations make relative errors meaningless
  std::vector<double> ratios_;
  std::vector<double> relative_errors_;
  std::vector<double> heading_errors_deg_;
};

class PowerSpectrum final : public Experiment {
 public:
  void add(const simulation::PlaceRecording& place, Executor&) override {
    const int all_components = place.rendering.columns / 2;
    power_sums_.resize(static_cast<std::size_t>(all_components));
    for (const auto& query : place.queries) {
      const auto power = mean_power(query.panorama, all_components);
      double all = 0.0;
      double first = 0.0;
      for (std::size_t k = 1; k < power.size(); ++k) {
        all += power[k];
        if (k < m04_components) first += power[k];
      }
      low_power_fractions_.push_back(first / all);
      for (std::size_t k = 0; k < power.size(); ++k) power_sums_[k] += power[k];
      if (first_power_.empty()) first_power_ = power;
    }
  }

  void report(Reproduction& result) const override {
    require(!low_power_fractions_.empty(), "views", 0.0, ">= 1");
    viewer::LinePlot plot{
        .title = "Power spectrum of the panoramic cylinder, mean over rows ([M04] figure 5)",
        .x_label = "frequency k [cycles per turn]",
        .y_label = "power A_k^2 [squared brightness]",
        .series = {},
        .log_y = true};
    viewer::Series single{.label = "one view", .style = viewer::SeriesStyle::lines_and_points};
    viewer::Series average{.label =
                               "mean of " + std::to_string(low_power_fractions_.size()) + " views"};
    for (int k = 1; k <= shown_frequencies; ++k) {
      single.add(k, first_power_[static_cast<std::size_t>(k)]);
      average.add(k, power_sums_[static_cast<std::size_t>(k)] /
                         static_cast<double>(low_power_fractions_.size()));
    }
    plot.series = {single, average};
    add_plot(result, "fig05_power_spectrum.svg",
             "Power falls steeply with frequency: the first 15 components hold most of it.", plot);
    add_row(result, "m04.fig5.share_15",
            "figure 5: share of the power (without k = 0) in the first 15 components (median)",
            median_figure(low_power_fractions_), "");
    add_row(result, "m04.fig5.slope",
            "slope of the power spectrum, k = 1 .. 30 ([S06] reports about 1.8)",
            -fit_spectrum_exponent(power_sums_, shown_frequencies), "", std::nullopt,
            std::pair{1.8, 1.8});
  }

 private:
  static constexpr int shown_frequencies = 30;
  std::vector<double> power_sums_;
  std::vector<double> first_power_;
  std::vector<double> low_power_fractions_;
};

}  // namespace

void reproduce_memory_table(Reproduction& result) {
  const Image raw(640, 480, 3);
  const int cylinder_channels = 3;
  const Panorama cylinder(80, 512, std::nullopt);
  const PackedSignature packed = pack(compute_signature(cylinder, 15), 1.0F);
  const auto row = [&](std::string id, std::string what, double published, double bits) {
    add_row(result, "m04." + id, what, bits / 1000.0, "kbit", std::nullopt,
            std::pair{published, published});
  };
  row("table1.raw", "[M03] table 1: raw colour image, 640 x 480", 7300.0,
      8.0 * static_cast<double>(raw.pixels().size()));
  row("table1.cylinder", "[M03] table 1: panoramic cylinder, 512 x 80, in colour", 980.0,
      8.0 * cylinder_channels * static_cast<double>(cylinder.values().size()));
  row("table1.signature", "[M03] table 1: Fourier signature, packed", 19.0,
      8.0 * static_cast<double>(packed.magnitudes.size() + packed.phases.size()));
}

std::unique_ptr<Experiment> make_rotational_invariance_experiment() {
  return std::make_unique<RotationalInvariance>();
}
std::unique_ptr<Experiment> make_power_spectrum_experiment() {
  return std::make_unique<PowerSpectrum>();
}

}  // namespace panonav::lab
