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
/// Creates the folder of a report. Throws FileError if it exists, is not empty and has no `page`
/// that "panonav VERB" wrote.
void prepare_report_folder(const std::filesystem::path& folder, std::string_view verb,
                           std::string_view page = "index.html");

/// Returns the points of a line that draws an arrow with its head; length in metres.
[[nodiscard]] std::vector<Point2> make_arrow_line(const Pose2& from, double length_m);

/// Prints the path of the report's page; prints nothing with --json.
void print_report_path(const std::filesystem::path& folder, Session& session);

}  // namespace panonav::command
