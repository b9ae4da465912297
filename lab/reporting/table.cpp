#include "lab/reporting/table.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::lab {

namespace {

std::string_view to_symbol(Comparison comparison) {
  return comparison == Comparison::at_most ? "<=" : ">=";
}

// Formats a value with four significant digits.
std::string format_value(double value, const std::string& unit) {
  return format_number(value, unit, 4);
}

// Formats our value with its interval, without its unit.
std::string format_value_and_interval(const ResultRow& row) {
  std::string text = format_value(row.ours, row.unit);
  if (row.interval) {
    text += " (" + format_value(row.interval->first, row.unit) + " .. " +
            format_value(row.interval->second, row.unit) + ")";
  }
  return text;
}

}  // namespace

bool ResultRow::holds() const {
  if (!std::isfinite(ours)) return false;
  if (!target) return true;
  return target->comparison == Comparison::at_most ? ours <= target->value : ours >= target->value;
}

TargetCount count_targets(std::span<const ResultRow> rows) {
  TargetCount count;
  for (const ResultRow& row : rows) {
    count.judged += row.target ? 1 : 0;
    count.held += row.target && row.holds() ? 1 : 0;
  }
  return count;
}

std::string format_figure(const ResultRow& row) {
  return row.unit.empty() ? format_value_and_interval(row)
                          : format_value_and_interval(row) + " " + row.unit;
}

std::string format_published(const ResultRow& row) {
  if (!row.published) return "-";
  const auto& [low, high] = *row.published;
  return format_value(low, row.unit) + (low == high ? "" : " .. " + format_value(high, row.unit));
}

std::string format_target(const ResultRow& row) {
  if (!row.target) return "-";
  return (row.target->comparison == Comparison::at_most ? "at most " : "at least ") +
         format_value(row.target->value, row.unit);
}

std::string explain_miss(const ResultRow& row) {
  if (!row.target) return "it has no target";
  if (!std::isfinite(row.ours)) {
    return row.reason.empty() ? "nothing could be measured" : row.reason;
  }
  std::vector<std::string> parts{"by " +
                                 format_value(std::abs(row.ours - row.target->value), row.unit)};
  ResultRow best_in_interval = row;
  if (row.interval) {
    best_in_interval.ours =
        row.target->comparison == Comparison::at_most ? row.interval->first : row.interval->second;
    if (best_in_interval.holds()) parts.emplace_back("the 95 % interval reaches the target");
  }
  if (!row.reason.empty()) {
    parts.push_back(row.reason);
  } else if (row.unit == "ms" || row.unit == "us") {
    parts.emplace_back("a time depends on the machine and on its other load");
  } else if (parts.size() == 1) {
    parts.emplace_back("no reason is known");
  }
  std::string text = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) text += "; " + parts[i];
  return text;
}

std::span<const std::string> table_header() {
  static const std::array<std::string, 6> header{"what", "published", "ours (95 % interval)",
                                                 "unit", "target",    "holds"};
  return header;
}

std::vector<std::string> table_cells(const ResultRow& row) {
  return {row.over.empty() ? row.what : row.what + " (" + row.over + ")",
          format_published(row),
          format_value_and_interval(row),
          row.unit.empty() ? "-" : row.unit,
          format_target(row),
          !row.target   ? "-"
          : row.holds() ? "yes"
                        : "no"};
}

std::string to_json(std::span<const ResultRow> rows) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& row : rows) {
    nlohmann::ordered_json entry;
    entry["id"] = row.id;
    entry["what"] = row.what;
    entry["over"] = row.over;
    if (!row.published) {
      entry["published"] = nullptr;
    } else if (row.published->first == row.published->second) {
      entry["published"] = row.published->first;
    } else {
      entry["published"] = {row.published->first, row.published->second};
    }
    entry["ours"] = row.ours;  // a value that is not finite becomes null
    if (row.interval) {
      entry["interval"] = {row.interval->first, row.interval->second};
    } else {
      entry["interval"] = nullptr;
    }
    entry["unit"] = row.unit;
    if (row.target) {
      entry["target"] = {{"op", to_symbol(row.target->comparison)}, {"value", row.target->value}};
    } else {
      entry["target"] = nullptr;
    }
    entry["holds"] = row.holds();
    if (row.holds() || row.reason.empty()) {
      entry["reason"] = nullptr;
    } else {
      entry["reason"] = row.reason;
    }
    list.push_back(std::move(entry));
  }
  return list.dump(1) + "\n";
}

}  // namespace panonav::lab
