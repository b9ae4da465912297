#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace panonav {

enum class Comparison { at_most, at_least };

struct Target {
  Comparison comparison = Comparison::at_most;
  double value = 0.0;
  friend bool operator==(const Target&, const Target&) = default;
};

/// One line of "published / ours / holds".
struct ResultRow {
  std::string id;    ///< short and stable, "m04.fig6.success_15"
  std::string what;  ///< for people
  std::optional<std::pair<double, double>>
      published;  ///< low, high; equal when the paper gives one number
  double ours = 0.0;
  std::optional<std::pair<double, double>>
      interval;      ///< 95 % interval of `ours` where it is a statistic
  std::string unit;  ///< "" for pure numbers
  std::optional<Target> target;

  /// True when there is no target or `ours` meets it; false for NaN.
  [[nodiscard]] bool holds() const;
};

/// The array that `reproduce --json` prints (docs/formats.md).
[[nodiscard]] std::string to_json(std::span<const ResultRow> rows);
/// A GitHub-flavoured Markdown table.
[[nodiscard]] std::string to_markdown(std::span<const ResultRow> rows);

}  // namespace panonav
