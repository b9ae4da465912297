#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/geometry/pose2.hpp"
#include "panonav_viewer/report_page.hpp"

namespace panonav::command {

class Arguments;
class Session;

/// Adds --report, whose help says what is written into the folder ("a page with both views").
void declare_report(Arguments& arguments, std::optional<std::string>& report,
                    std::string_view content);
/// Makes the folder of a report. Throws FileError when something is there that is neither empty nor
/// has a `page` whose generator is "panonav VERB".
void prepare_report_folder(const std::filesystem::path& folder, std::string_view verb,
                           std::string_view page = "index.html");

/// The line of an arrow, with its head, for maps.
[[nodiscard]] std::vector<Point2> arrow(const Pose2& from, double length_m);

/// Tells people to open the report in `folder`; says nothing to machines.
void print_report_path(const std::filesystem::path& folder, Session& session);

}  // namespace panonav::command
