#include "panonav/io/trajectory_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/internal/csv_table.hpp"

namespace panonav {

namespace {

constexpr std::size_t trajectory_limit_bytes = 256U << 20U;

std::vector<StampedPose> read_csv(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  std::vector<StampedPose> trajectory;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const Pose2 pose{table.position(row, "x_m"), table.position(row, "y_m"),
                     wrap_angle(radians(table.number(row, "heading_deg")))};
    const double stamp_s = table.number(row, "stamp_s");
    if (!trajectory.empty() && stamp_s <= trajectory.back().stamp_s) {
      table.fail(row, "stamp_s", to_text(stamp_s), "more than the stamp before");
    }
    trajectory.push_back({stamp_s, pose});
  }
  if (trajectory.empty()) throw FileError(path.string(), "contains no pose; allowed: one or more");
  return trajectory;
}

// Parses the eight numbers of a line of TUM text; false if it has others.
bool parse_line(std::string_view line, std::array<double, 8>& numbers) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == ','; };
  std::size_t count = 0;
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && is_blank(line[i])) ++i;
    if (i >= line.size()) return count == numbers.size();
    if (count == numbers.size()) return false;
    const auto result = std::from_chars(line.data() + i, line.data() + line.size(), numbers[count]);
    if (result.ec != std::errc{} || !std::isfinite(numbers[count])) return false;
    i = static_cast<std::size_t>(result.ptr - line.data());
    if (i < line.size() && !is_blank(line[i])) return false;
    ++count;
  }
}

}  // namespace

std::vector<StampedPose> read_trajectory(const std::filesystem::path& path) {
  if (path.extension() == ".csv") return read_csv(path);
  const auto bytes = read_file(path, trajectory_limit_bytes);
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<StampedPose> trajectory;
  std::size_t number = 0;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++number;
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    const std::string where = "line " + std::to_string(number);
    std::array<double, 8> n{};
    if (!parse_line(line, n)) {
      throw FileError(
          path.string(),
          where + " is not a pose; allowed: stamp x y z qx qy qz qw, eight finite numbers");
    }
    for (const std::size_t axis : {1U, 2U}) {
      if (is_position(n[axis])) continue;
      throw FileError(path.string(), where + (axis == 1U ? ": x is " : ": y is ") +
                                         to_text(n[axis]) +
                                         "; allowed: " + std::string(position_range));
    }
    const double norm = std::sqrt(n[4] * n[4] + n[5] * n[5] + n[6] * n[6] + n[7] * n[7]);
    if (std::abs(norm - 1.0) > 1e-2) {
      throw FileError(path.string(), where + ": the length of the quaternion is " + to_text(norm) +
                                         "; allowed: 1");
    }
    const double heading = std::atan2(2.0 * (n[7] * n[6] + n[4] * n[5]),
                                      n[7] * n[7] + n[4] * n[4] - n[5] * n[5] - n[6] * n[6]);
    if (!trajectory.empty() && n[0] <= trajectory.back().stamp_s) {
      throw FileError(path.string(), where + ": stamp is " + to_text(n[0]) +
                                         "; allowed: more than the stamp before");
    }
    trajectory.push_back({n[0], {n[1], n[2], wrap_angle(heading)}});
  }
  if (trajectory.empty()) throw FileError(path.string(), "contains no pose; allowed: one or more");
  return trajectory;
}

void write_trajectory(const std::filesystem::path& path, std::span<const StampedPose> trajectory) {
  const bool table = path.extension() == ".csv";
  std::string text = table ? "stamp_s,x_m,y_m,heading_deg\n" : "# stamp x y z qx qy qz qw\n";
  for (const auto& [stamp_s, pose] : trajectory) {
    if (table) {
      text += to_text(stamp_s) + "," + to_text(pose.x_m) + "," + to_text(pose.y_m) + "," +
              to_text(to_exact_degrees(pose.heading_rad)) + "\n";
    } else {
      text += to_text(stamp_s) + " " + to_text(pose.x_m) + " " + to_text(pose.y_m) + " 0 0 0 " +
              to_text(std::sin(0.5 * pose.heading_rad)) + " " +
              to_text(std::cos(0.5 * pose.heading_rad)) + "\n";
    }
  }
  write_file(path, text);
}

}  // namespace panonav
