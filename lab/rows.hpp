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

/// A measured value, with a 95 % interval if it is a statistic.
struct Figure {
  double value = 0.0;
  std::optional<std::pair<double, double>> interval;
  Figure(double figure) : value(figure) {}  // NOLINT(google-explicit-constructor)
  Figure(double figure, std::pair<double, double> of) : value(figure), interval(of) {}
  Figure(const Proportion& rate)  // NOLINT(google-explicit-constructor)
      : value(rate.value), interval(std::pair(rate.low, rate.high)) {}
};
/// Return the mean or the median with its bootstrap interval.
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
/// Adds the median of values with its interval; the row mentions their number.
void add_median(Reproduction& result, const std::string& id, const std::string& what,
                const std::string& unit, std::span<const double> values,
                std::optional<Target> target = std::nullopt,
                std::optional<std::pair<double, double>> published = std::nullopt);
/// Adds the mean of values with its interval; the row mentions their number.
void add_mean(Reproduction& result, const std::string& id, const std::string& what,
              const std::string& unit, std::span<const double> values);

/// Formats a distance in centimetres: "2.5 cm".
[[nodiscard]] std::string format_centimetres(double distance_m);
/// Formats a distance for row ids: "2_5cm".
[[nodiscard]] std::string format_centimetres_id(double distance_m);

/// Counts the elements of a range that satisfy a predicate.
template <typename Range, typename Predicate>
[[nodiscard]] std::size_t count_where(const Range& range, Predicate predicate) {
  return static_cast<std::size_t>(std::ranges::count_if(range, predicate));
}

/// Appends a point to a curve, with the interval of `y` as error bar.
void add_point(viewer::Series& series, double x, const Figure& y);

/// Writes a plot into the result's folder and adds it to the list of pictures.
template <typename... Plot>
void add_plot(Reproduction& result, const std::string& file, const std::string& caption,
              const Plot&... plot) {
  write_plot(result.out / file, plot...);
  result.pictures.push_back({file, caption});
}

}  // namespace panonav::lab
