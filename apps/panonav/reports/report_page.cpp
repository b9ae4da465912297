#include "reports/report_page.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

bool is_made_by(const std::filesystem::path& page, std::string_view generator) {
  std::ifstream file(page, std::ios::binary);
  std::string head(1024, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.find("<meta name=\"generator\" content=\"" + std::string(generator) + "\">") !=
         std::string::npos;
}

/// True if the folder is empty or contains only temporary files of the page that a killed process
/// has left.
bool is_replaceable(const std::filesystem::path& folder, const std::string& page) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("." + page + ".") || !name.ends_with("tmp")) return false;
  }
  return !error;
}

}  // namespace

void declare_report(Arguments& arguments, std::optional<std::string>& report,
                    std::string_view content) {
  arguments.option(
      "--report FOLDER", report,
      "Write into this folder " + std::string(content) +
          "; the folder must be new or empty, or contain an earlier report, which is replaced");
  arguments.declare_outputs({"--report"});
}

void prepare_report_folder(const std::filesystem::path& folder, std::string_view verb,
                           std::string_view page) {
  namespace fs = std::filesystem;
  std::error_code error;
  const bool exists = fs::exists(folder, error);
  const std::string extension = folder.extension().string();
  if (!exists && (extension == ".html" || extension == ".htm")) {
    throw FileError(folder.string(), "is the name of a page; allowed: a folder, such as " +
                                         folder.stem().string() + ", which gets the page " +
                                         std::string(page));
  }
  const bool is_earlier_report = is_made_by(folder / page, "panonav " + std::string(verb));
  if (exists && (!fs::is_directory(folder, error) ||
                 (!is_earlier_report && !is_replaceable(folder, std::string(page))))) {
    throw FileError(
        folder.string(),
        "exists and was not made by panonav " + std::string(verb) +
            "; allowed: a new or empty folder, or the folder of an earlier report of this verb");
  }
  fs::create_directories(folder, error);
  if (error) throw FileError(folder.string(), "cannot be created: " + error.message());
}

std::vector<Point2> make_arrow_line(const Pose2& from, double length_m) {
  const auto move_along = [](const Point2& start, double towards_rad, double distance_m) {
    return Point2{start.x_m + distance_m * std::cos(towards_rad),
                  start.y_m + distance_m * std::sin(towards_rad)};
  };
  constexpr double barb_rad = 0.85 * std::numbers::pi;  // angle between arrow and barb
  const Point2 tip = move_along(from.position(), from.heading_rad, length_m);
  return {from.position(), tip, move_along(tip, from.heading_rad + barb_rad, 0.3 * length_m), tip,
          move_along(tip, from.heading_rad - barb_rad, 0.3 * length_m)};
}

void print_report_path(const std::filesystem::path& folder, Session& session) {
  if (session.json()) return;
  session.print("Open " + session.bold((folder / "index.html").string()) + " in a browser.");
}

}  // namespace panonav::command
