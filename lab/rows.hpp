#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "lab/reproduction.hpp"
#include "lab/statistics.hpp"
#include "panonav_viewer/plot.hpp"

namespace panonav::lab {

/// A figure, with its interval where it is a statistic.
struct Figure {
  double value = 0.0;
  std::optional<std::pair<double, double>> interval;
  Figure(double figure) : value(figure) {}  // NOLINT(google-explicit-constructor)
  Figure(double figure, std::pair<double, double> of) : value(figure), interval(of) {}
  Figure(const Proportion& rate)  // NOLINT(google-explicit-constructor)
      : value(rate.value), interval(std::pair(rate.low, rate.high)) {}
};
/// Return mean and median with bootstrap intervals.
[[nodiscard]] Figure mean_figure(std::span<const double> values, std::uint64_t seed = 1);
[[nodiscard]] Figure median_figure(std::span<const double> values, std::uint64_t seed = 1);

[[nodiscard]] Target at_most(double value);
[[nodiscard]] Target at_least(double value);

ResultRow& add_row(Reproduction& result, const std::string& id, const std::string& what,
                   const Figure& ours, const std::string& unit,
                   std::optional<Target> target = std::nullopt,
                   std::optional<std::pair<double, double>> published = std::nullopt);
/// Adds a rate with its Wilson interval and number of trials.
void add_rate(Reproduction& result, const std::string& id, const std::string& what,
              std::size_t successes, std::size_t trials,
              std::optional<Target> target = std::nullopt);
/// Adds a median with its number of values.
void add_median(Reproduction& result, const std::string& id, const std::string& what,
                const std::string& unit, std::span<const double> values,
                std::optional<Target> target = std::nullopt,
                std::optional<std::pair<double, double>> published = std::nullopt);
/// Adds a mean with its number of values.
void add_mean(Reproduction& result, const std::string& id, const std::string& what,
              const std::string& unit, std::span<const double> values);

/// Returns "2.5 cm".
[[nodiscard]] std::string format_centimetres(double distance_m);
/// Returns "2_5cm", for the names of rows.
[[nodiscard]] std::string format_centimetres_id(double distance_m);

/// Counts the elements of a range that fulfil a predicate.
template <typename Range, typename Predicate>
[[nodiscard]] std::size_t count_where(const Range& range, Predicate predicate) {
  return static_cast<std::size_t>(std::ranges::count_if(range, predicate));
}

/// Appends a point to a curve, with its interval as error bar.
void add_point(viewer::Series& series, double x, const Figure& y);

/// Writes a plot into the folder of the result and lists it.
template <typename... Plot>
void add_plot(Reproduction& result, const std::string& file, const std::string& caption,
              const Plot&... plot) {
  write_plot(result.out / file, plot...);
  result.pictures.push_back({file, caption});
}

}  // namespace panonav::lab
