#include "runs/view_selection.hpp"

#include <fnmatch.h>

#include <array>
#include <cmath>
#include <utility>

#include "cli/option_values.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

namespace {

/// Parses "X,Y,METRES" into x, y and radius in metres. Throws UsageError.
std::array<double, 3> parse_circle(const std::string& text) {
  std::array<double, 3> circle{};
  std::size_t begin = 0;
  for (std::size_t i = 0; i < circle.size(); ++i) {
    const std::size_t end = i + 1 < circle.size() ? text.find(',', begin) : text.size();
    if (end == std::string::npos || end < begin) {
      throw UsageError("--near is '" + text + "'; allowed: X,Y,METRES");
    }
    circle[i] = parse_number("--near", std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
  }
  if (!(circle[2] >= 0.0)) throw UsageError("--near is '" + text + "'; allowed: METRES >= 0");
  return circle;
}

}  // namespace

void declare_selection(Arguments& arguments, ViewSelection& selection) {
  arguments.option("--name PATTERN", selection.name,
                   "Use only views whose name matches PATTERN: * is any text, ? is any character");
  arguments.option("--near X,Y,METRES", selection.near,
                   "Use only views within METRES of the position X,Y");
}

std::vector<ViewRecord> select_views(std::vector<ViewRecord> views,
                                     const ViewSelection& selection) {
  if (selection.name) {
    std::erase_if(views, [&](const ViewRecord& view) {
      return ::fnmatch(selection.name->c_str(), view.info.name.c_str(), 0) != 0;
    });
  }
  if (selection.near) {
    const auto [x_m, y_m, radius_m] = parse_circle(*selection.near);
    std::erase_if(views, [&, x_m = x_m, y_m = y_m, radius_m = radius_m](const ViewRecord& view) {
      const auto& pose = view.info.pose;
      return !pose || std::hypot(pose->x_m - x_m, pose->y_m - y_m) > radius_m;
    });
  }
  return views;
}

}  // namespace panonav::command
