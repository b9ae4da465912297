#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panonav::lab {

enum class Comparison { at_most, at_least };

struct Target {
  Comparison comparison = Comparison::at_most;
  double value = 0.0;
  friend bool operator==(const Target&, const Target&) = default;
};

/// One result: the published value, our value, and whether it meets its target.
struct ResultRow {
  std::string id;    ///< short and stable, "m04.fig6.success_15"
  std::string what;  ///< for readers; the same in every run
  std::optional<std::pair<double, double>>
      published;  ///< low, high; equal when the paper gives one number
  double ours = 0.0;
  std::optional<std::pair<double, double>>
      interval;      ///< 95 % confidence interval of `ours`, if it is a statistic
  std::string unit;  ///< "" for pure numbers
  std::optional<Target> target;
  /// Sample of the result, as "median of 120", and further notes.
  std::string over = {};
  /// Reason of a missed target in one plain sentence; empty if unknown.
  std::string reason = {};

  /// True if `ours` is finite and meets the target, if there is one.
  [[nodiscard]] bool holds() const;
};

/// Number of rows with a target, and the number of these that meet it.
struct TargetCount {
  std::size_t judged = 0;
  std::size_t held = 0;
  friend bool operator==(const TargetCount&, const TargetCount&) = default;
};
[[nodiscard]] TargetCount count_targets(std::span<const ResultRow> rows);

/// Formats our value with its interval and unit: "0.02 (0.012 .. 0.036) m".
[[nodiscard]] std::string format_figure(const ResultRow& row);
/// Formats the published range, "5 .. 6"; "-" if there is none.
[[nodiscard]] std::string format_published(const ResultRow& row);
/// Formats the target, "at most 0.02"; "-" if there is none.
[[nodiscard]] std::string format_target(const ResultRow& row);
/// Returns by how much a row misses its target and why: the known reason, that a time (ms, us)
/// depends on the machine, or that no reason is known.
[[nodiscard]] std::string explain_miss(const ResultRow& row);

/// Returns the titles of the columns that `table_cells` fills: what, published, ours, unit, target,
/// holds.
[[nodiscard]] std::span<const std::string> table_header();
/// Returns the table cells of a row as text.
[[nodiscard]] std::vector<std::string> table_cells(const ResultRow& row);

/// Returns the array that `reproduce --json` prints (docs/formats.md). The reason is null for a row
/// that meets its target.
[[nodiscard]] std::string to_json(std::span<const ResultRow> rows);
/// Parses the output of `to_json`; rows may lack `over` and `reason`. Throws FileError with the
/// name `file`, the row and the field.
[[nodiscard]] std::vector<ResultRow> rows_from_json(std::string_view text, std::string_view file);
}  // namespace panonav::lab
