#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "panonav/pipeline/view_list.hpp"

namespace panonav::command {

/// Which views of a memory a user wants to see; all unless something is said.
struct ViewSelection {
  std::optional<std::string> name;
  std::optional<std::string> near;
};

/// Adds --name and --near.
void declare_selection(Arguments& arguments, ViewSelection& selection);

/// Throws UsageError on values that are not understood.
[[nodiscard]] std::vector<ViewRecord> select_views(std::vector<ViewRecord> views,
                                                   const ViewSelection& selection);

}  // namespace panonav::command
