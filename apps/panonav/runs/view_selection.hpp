#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

/// Selects views of a memory by name or position; unset members select all.
struct ViewSelection {
  std::optional<std::string> name;
  std::optional<std::string> near;
};

/// Adds --name and --near.
void declare_selection(Arguments& arguments, ViewSelection& selection);

/// Returns the selected views. Throws UsageError on an invalid circle.
[[nodiscard]] std::vector<ViewRecord> select_views(std::vector<ViewRecord> views,
                                                   const ViewSelection& selection);

}  // namespace panonav::command
