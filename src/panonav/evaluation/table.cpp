#include "panonav/evaluation/table.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace panonav {

namespace {

std::string_view symbol(Comparison comparison) {
  return comparison == Comparison::at_most ? "<=" : ">=";
}

// Four significant digits: what a person compares.
std::string shown(double value) {
  if (!std::isfinite(value)) return "none";
  std::array<char, 32> text{};
  if (value == std::round(value) && std::abs(value) < 1e7) {
    std::snprintf(text.data(), text.size(), "%.0f", value);
  } else {
    std::snprintf(text.data(), text.size(), "%.4g", value);
  }
  return text.data();
}

std::string shown(const std::pair<double, double>& range) {
  return range.first == range.second ? shown(range.first)
                                     : shown(range.first) + " .. " + shown(range.second);
}

// A vertical bar would end a cell of the table.
std::string cell(std::string text) {
  for (std::size_t i = text.find('|'); i != std::string::npos; i = text.find('|', i + 2)) {
    text.insert(i, "\\");
  }
  return text;
}

}  // namespace

bool ResultRow::holds() const {
  if (!std::isfinite(ours)) return false;
  if (!target) return true;
  return target->comparison == Comparison::at_most ? ours <= target->value : ours >= target->value;
}

std::string to_json(std::span<const ResultRow> rows) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& row : rows) {
    nlohmann::ordered_json entry;
    entry["id"] = row.id;
    entry["what"] = row.what;
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
      entry["target"] = {{"op", symbol(row.target->comparison)}, {"value", row.target->value}};
    } else {
      entry["target"] = nullptr;
    }
    entry["holds"] = row.holds();
    list.push_back(std::move(entry));
  }
  return list.dump(1) + "\n";
}

std::string to_markdown(std::span<const ResultRow> rows) {
  std::string text = "| what | published | ours | 95 % interval | unit | target | holds |\n";
  text += "|---|---|---|---|---|---|---|\n";
  for (const auto& row : rows) {
    text += "| " + cell(row.what);
    text += " | " + (row.published ? shown(*row.published) : std::string("-"));
    text += " | " + shown(row.ours);
    text += " | " + (row.interval ? shown(*row.interval) : std::string("-"));
    text += " | " + (row.unit.empty() ? std::string("-") : cell(row.unit));
    text += " | " + (row.target ? std::string(symbol(row.target->comparison)) + " " +
                                      shown(row.target->value)
                                : std::string("reported"));
    text += row.target ? (row.holds() ? " | yes |\n" : " | **no** |\n") : " | - |\n";
  }
  return text;
}

}  // namespace panonav
