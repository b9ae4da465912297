#include "lab/rows.hpp"

#include <algorithm>
#include <cmath>

#include "lab/statistics.hpp"
#include "panonav/core/statistics.hpp"

namespace panonav::lab {

Figure mean_figure(std::span<const double> values, std::uint64_t seed) {
  return {mean(values), mean_interval(values, seed)};
}

Figure median_figure(std::span<const double> values, std::uint64_t seed) {
  return {median(values), median_interval(values, seed)};
}

Target at_most(double value) {
  return {Comparison::at_most, value};
}

Target at_least(double value) {
  return {Comparison::at_least, value};
}

ResultRow& add_row(Reproduction& result, const std::string& id, const std::string& what,
                   const Figure& ours, const std::string& unit, std::optional<Target> target,
                   std::optional<std::pair<double, double>> published) {
  result.rows.push_back({.id = id,
                         .what = what,
                         .published = published,
                         .ours = ours.value,
                         .interval = ours.interval,
                         .unit = unit,
                         .target = target});
  return result.rows.back();
}

void add_rate(Reproduction& result, const std::string& id, const std::string& what,
              std::size_t successes, std::size_t trials, std::optional<Target> target) {
  add_row(result, id, what, success_rate(successes, trials), "", target).over =
      "of " + std::to_string(trials);
}

void add_median(Reproduction& result, const std::string& id, const std::string& what,
                const std::string& unit, std::span<const double> values,
                std::optional<Target> target, std::optional<std::pair<double, double>> published) {
  add_row(result, id, what, median_figure(values), unit, target, published).over =
      "median of " + std::to_string(values.size());
}

void add_mean(Reproduction& result, const std::string& id, const std::string& what,
              const std::string& unit, std::span<const double> values) {
  add_row(result, id, what, mean_figure(values), unit).over =
      "mean of " + std::to_string(values.size());
}

std::string format_centimetres(double distance_m) {
  const auto millimetres = std::lround(1000.0 * distance_m);
  const auto whole = std::to_string(millimetres / 10);
  return (millimetres % 10 == 0 ? whole : whole + "." + std::to_string(millimetres % 10)) + " cm";
}

std::string format_centimetres_id(double distance_m) {
  std::string text = format_centimetres(distance_m);
  std::ranges::replace(text, '.', '_');
  text.erase(text.size() - 3, 1);
  return text;
}

void add_point(viewer::Series& series, double x, const Figure& y) {
  series.x.push_back(x);
  series.y.push_back(y.value);
  if (!y.interval) return;
  series.y_low.push_back(y.interval->first);
  series.y_high.push_back(y.interval->second);
}

}  // namespace panonav::lab
