#include "panonav/io/trajectory_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
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
constexpr std::string_view known_formats =
    "TUM (stamp x y z qx qy qz qw), KITTI (12 numbers of a matrix), EuRoC (nanoseconds,x,y,z,qw,"
    "qx,qy,qz), positions (stamp x y z), or a table with the columns stamp_s,x_m,y_m,heading_deg";
constexpr std::string_view view_steps_line = "# unit: view steps";
constexpr std::string_view image_numbers_line = "# stamps: image numbers";
constexpr std::string_view no_stamps_line = "# stamps: none";

using Times = TrajectoryUnits::Times;

/// Sets the units that a comment of `write_trajectory` states; other comments change nothing.
void read_units(std::string_view comment, TrajectoryUnits& units) {
  comment = trim_blanks(comment);
  if (comment == view_steps_line) units.is_metric = false;
  if (comment == image_numbers_line) units.times = Times::image_numbers;
  if (comment == no_stamps_line) units.times = Times::none;
}

/// True if the pose has the stamp of the last one, and counts it.
bool is_repeated(TrajectoryFile& file, double stamp_s) {
  if (file.poses.empty() || stamp_s != file.poses.back().stamp_s) return false;
  ++file.repeated;
  return true;
}

TrajectoryFile read_table(const std::filesystem::path& path) {
  const CsvTable table = CsvTable::read(path);
  TrajectoryFile file{.format = "CSV", .units = {}, .poses = {}};
  file.units.is_metric = !table.has("x_steps");
  const char* const x = file.units.is_metric ? "x_m" : "x_steps";
  const char* const y = file.units.is_metric ? "y_m" : "y_steps";
  std::string time = "stamp_s";
  if (!table.has(time)) {
    const bool has_images = table.has("image") || table.has("file");
    file.units.times = has_images ? Times::image_numbers : Times::none;
    time = table.has("image") ? "image" : "";
  }
  const auto is_empty = [&table](std::size_t row, std::string_view column) {
    return !table.has(column) || table.text(row, column).empty();
  };
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (table.has(x) && is_empty(row, x) && is_empty(row, y)) continue;
    Pose2 pose{table.position(row, x), table.position(row, y), 0.0};
    if (is_empty(row, "heading_deg")) {
      file.has_rotations = false;
    } else {
      pose.heading_rad = wrap_angle(radians(table.number(row, "heading_deg")));
    }
    const double stamp_s = time.empty() ? static_cast<double>(row) : table.number(row, time);
    if (is_repeated(file, stamp_s)) continue;
    if (!file.poses.empty() && stamp_s < file.poses.back().stamp_s) {
      table.fail(row, time, to_text(stamp_s), "the stamp before, or more");
    }
    file.poses.push_back({stamp_s, to_pose3(pose)});
  }
  if (!file.has_rotations) {
    for (StampedPose3& each : file.poses) each.pose.rotation = {};
  }
  return file;
}

/// Numbers of a line, at most as many as any format has.
struct NumberLine {
  static constexpr std::size_t max_numbers = 32;
  std::array<double, max_numbers> numbers{};
  std::size_t count = 0;
  bool has_commas = false;
};

/// Parses the numbers of a line, between blanks or commas; nullopt if anything else is in it.
std::optional<NumberLine> parse_line(std::string_view line) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == ','; };
  NumberLine result;
  result.has_commas = line.find(',') != line.npos;
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && is_blank(line[i])) ++i;
    if (i >= line.size()) return result;
    if (result.count == NumberLine::max_numbers) return std::nullopt;
    double& number = result.numbers[result.count++];
    const auto parsed = std::from_chars(line.data() + i, line.data() + line.size(), number);
    if (parsed.ec != std::errc{} || !std::isfinite(number)) return std::nullopt;
    i = static_cast<std::size_t>(parsed.ptr - line.data());
    if (i < line.size() && !is_blank(line[i])) return std::nullopt;
  }
}

enum class PoseFormat { tum, kitti, euroc, positions };
constexpr std::array<std::string_view, 4> format_names{"TUM", "KITTI", "EuRoC", "positions"};
constexpr std::array<std::string_view, 4> format_lines{
    "stamp x y z qx qy qz qw, eight finite numbers",
    "12 finite numbers, the rows of a 3 x 4 matrix",
    "nanoseconds,x,y,z,qw,qx,qy,qz, eight finite numbers or more",
    "stamp x y z, four finite numbers"};
constexpr std::size_t kitti_numbers = 12;
constexpr std::size_t position_numbers = 4;
constexpr std::size_t pose_numbers = 8;  // of TUM, and the least of EuRoC

/// True if the line begins with nanoseconds, as those of EuRoC do.
bool has_nanoseconds(const NumberLine& line) {
  constexpr double min_nanoseconds = 1e12;  // no clock in seconds runs as long
  return line.has_commas && std::abs(line.numbers[0]) >= min_nanoseconds;
}

std::optional<PoseFormat> identify_format(const NumberLine& line) {
  if (line.has_commas && line.count >= pose_numbers &&
      (line.count > pose_numbers || has_nanoseconds(line))) {
    return PoseFormat::euroc;
  }
  if (line.count == kitti_numbers) return PoseFormat::kitti;
  if (line.count == pose_numbers) return PoseFormat::tum;
  if (line.count == position_numbers) return PoseFormat::positions;
  return std::nullopt;
}

bool has_format(const NumberLine& line, PoseFormat format) {
  if (format == PoseFormat::euroc) return line.count >= pose_numbers;
  if (format == PoseFormat::positions) return line.count == position_numbers;
  return line.count == (format == PoseFormat::kitti ? kitti_numbers : pose_numbers);
}

/// Reports faults of one line.
struct LineReport {
  const std::filesystem::path& path;
  std::size_t number = 0;

  [[noreturn]] void fail(const std::string& fault) const {
    throw FileError(path.string(), "line " + std::to_string(number) + fault);
  }
};

Point3 check_position(const Point3& position, const LineReport& report) {
  for (const auto& [name, value] :
       {std::pair{"x", position.x_m}, std::pair{"y", position.y_m}, std::pair{"z", position.z_m}}) {
    if (is_position(value)) continue;
    report.fail(std::string(": ") + name + " is " + to_text(value) +
                "; allowed: " + std::string(position_range));
  }
  return position;
}

Rotation3 normalise(const Rotation3& q, const LineReport& report) {
  constexpr double length_tolerance = 1e-2;
  const double length = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  if (std::abs(length - 1.0) > length_tolerance) {
    report.fail(": the length of the quaternion is " + to_text(length) + "; allowed: 1");
  }
  return {q.w / length, q.x / length, q.y / length, q.z / length};
}

/// Returns the rotation of the first three columns of KITTI's 3 x 4 matrix.
Rotation3 read_rotation(const NumberLine& line, const LineReport& report) {
  constexpr double tolerance = 1e-2;  // of products of rows, as files have few digits
  const auto& n = line.numbers;
  const std::array<double, 9> m{n[0], n[1], n[2], n[4], n[5], n[6], n[8], n[9], n[10]};
  double fault = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b) {
      double product = a == b ? -1.0 : 0.0;
      for (std::size_t i = 0; i < 3; ++i) product += m[3 * a + i] * m[3 * b + i];
      fault = std::max(fault, std::abs(product));
    }
  }
  const double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) -
                             m[1] * (m[3] * m[8] - m[5] * m[6]) +
                             m[2] * (m[3] * m[7] - m[4] * m[6]);
  if (!(fault <= tolerance)) {
    report.fail(": the rows of the rotation differ from orthonormal by " + to_text(fault) +
                "; allowed: at most " + to_text(tolerance));
  }
  if (determinant < 0.0) report.fail(": the determinant of the rotation is -1; allowed: 1");
  return Rotation3::from_matrix(m);
}

StampedPose3 read_pose(const NumberLine& line, PoseFormat format, std::size_t index,
                       const LineReport& report) {
  constexpr double nanoseconds = 1e9;
  const auto& n = line.numbers;
  if (format == PoseFormat::kitti) {
    return {static_cast<double>(index),
            {check_position({n[3], n[7], n[11]}, report), read_rotation(line, report)}};
  }
  const Point3 position = check_position({n[1], n[2], n[3]}, report);
  if (format == PoseFormat::positions) {
    return {has_nanoseconds(line) ? n[0] / nanoseconds : n[0], {position, {}}};
  }
  if (format == PoseFormat::euroc) {
    return {n[0] / nanoseconds, {position, normalise({n[4], n[5], n[6], n[7]}, report)}};
  }
  return {n[0], {position, normalise({n[7], n[4], n[5], n[6]}, report)}};
}

/// Reads lines of numbers; nullopt if the first line of data names columns instead.
std::optional<TrajectoryFile> read_number_lines(const std::filesystem::path& path,
                                                std::string_view rest) {
  TrajectoryFile file;
  std::optional<PoseFormat> format;
  LineReport report{path, 0};
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    ++report.number;
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) continue;
    if (line[first] == '#') {
      read_units(line, file.units);
      continue;
    }
    const auto numbers = parse_line(line);
    if (!format) {
      const bool is_header = line.find("x_m") != line.npos || line.find("x_steps") != line.npos ||
                             line.find("_m,") != line.npos;
      if (!numbers && is_header) return std::nullopt;
      if (numbers) format = identify_format(*numbers);
      if (!format) report.fail(" is not a pose; allowed: " + std::string(known_formats));
    }
    const auto kind = static_cast<std::size_t>(*format);
    if (!numbers || !has_format(*numbers, *format)) {
      report.fail(" is not a pose in " + std::string(format_names[kind]) +
                  " format; allowed: " + std::string(format_lines[kind]));
    }
    const StampedPose3 pose = read_pose(*numbers, *format, file.poses.size(), report);
    if (is_repeated(file, pose.stamp_s)) continue;
    if (!file.poses.empty() && pose.stamp_s < file.poses.back().stamp_s) {
      report.fail(": stamp is " + to_text(pose.stamp_s) + "; allowed: the stamp before, or more");
    }
    file.poses.push_back(pose);
  }
  if (format) file.format = format_names[static_cast<std::size_t>(*format)];
  if (format == PoseFormat::kitti) file.units.times = Times::none;
  file.has_rotations = format != PoseFormat::positions;
  return file;
}

}  // namespace

TrajectoryFile read_trajectory_file(const std::filesystem::path& path) {
  const auto bytes = read_file(path, trajectory_limit_bytes);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // a byte order mark
  auto file = read_number_lines(path, text);
  if (!file) file = read_table(path);
  if (file->poses.empty()) {
    throw FileError(path.string(), "contains no pose; allowed: one or more");
  }
  return std::move(*file);
}

std::vector<StampedPose> read_trajectory(const std::filesystem::path& path, std::size_t* repeated) {
  const TrajectoryFile file = read_trajectory_file(path);
  if (file.units.times != Times::stamps) {
    const bool counts_images = file.units.times == Times::image_numbers;
    throw FileError(
        path.string(),
        (counts_images ? "has numbers of images instead of stamps (" : "has no stamps (") +
            file.format + " format); allowed: a format with stamps, such as TUM");
  }
  if (!file.has_rotations) {
    throw FileError(path.string(),
                    "has no headings; allowed: a format with rotations, such as "
                    "TUM, or a table with the column 'heading_deg'");
  }
  if (!file.units.is_metric) {
    throw FileError(path.string(),
                    "has lengths in view steps; allowed: metres (panonav scale "
                    "scales a memory, from which the file can be written again)");
  }
  if (repeated != nullptr) *repeated += file.repeated;
  std::vector<StampedPose> trajectory;
  for (const StampedPose3& stamped : file.poses) {
    trajectory.push_back({stamped.stamp_s, to_pose2(stamped.pose)});
  }
  return trajectory;
}

std::string make_trajectory_header(bool is_table, const TrajectoryUnits& units) {
  if (is_table) {
    const std::string time = units.times == Times::stamps          ? "stamp_s"
                             : units.times == Times::image_numbers ? "image"
                                                                   : "view";
    return time + (units.is_metric ? ",x_m,y_m" : ",x_steps,y_steps") + ",heading_deg\n";
  }
  std::string text = "# stamp x y z qx qy qz qw\n";
  if (!units.is_metric) text += std::string(view_steps_line) + "\n";
  if (units.times == Times::image_numbers) text += std::string(image_numbers_line) + "\n";
  if (units.times == Times::none) text += std::string(no_stamps_line) + "\n";
  return text;
}

void write_trajectory(const std::filesystem::path& path, std::span<const StampedPose> trajectory,
                      const TrajectoryUnits& units) {
  const bool table = path.extension() == ".csv";
  std::string text = make_trajectory_header(table, units);
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
