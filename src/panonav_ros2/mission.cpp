#include "panonav_ros2/mission.hpp"

#include <ctime>
#include <fstream>
#include <istream>
#include <locale>
#include <system_error>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"

namespace panonav::ros2 {

namespace {

std::string to_line(const Pose2& pose) {
  return to_text(pose.x_m) + " " + to_text(pose.y_m) + " " + to_text(pose.heading_rad) + "\n";
}

std::istream& operator>>(std::istream& in, Pose2& pose) {
  return in >> pose.x_m >> pose.y_m >> pose.heading_rad;
}

std::optional<Mission> read_mission(std::istream& in) {
  Mission mission;
  std::string kind;
  in >> mission.map_from_odom >> kind;
  if (kind == "goal") {
    in >> mission.goal.emplace();
  } else if (kind == "repeat") {
    in >> mission.along_m.emplace() >> mission.min_correlation >> std::ws;
    std::getline(in, mission.route);
  } else {
    return std::nullopt;
  }
  if (!in || (!mission.goal && mission.route.empty())) return std::nullopt;
  return mission;
}

/// A time since the boot of the system, and which boot.
struct BootTime {
  std::string boot;  ///< boot id; empty: unknown
  double seconds = 0.0;
};

BootTime read_boot_time() {
  BootTime now;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> now.boot;
  timespec clock{};
  if (clock_gettime(CLOCK_BOOTTIME, &clock) != 0) now.boot.clear();
  now.seconds = static_cast<double>(clock.tv_sec) + 1e-9 * static_cast<double>(clock.tv_nsec);
  return now;
}

/// Returns why a mission written at that time is not continued; empty if it is continued.
std::string find_rejection_reason(const BootTime& written, double file_age_s, double max_age_s) {
  const BootTime now = read_boot_time();
  if (now.boot.empty() || written.boot != now.boot) {
    return " was written before the system was started";
  }
  for (const double age_s : {now.seconds - written.seconds, file_age_s}) {
    if (!(age_s >= 0.0)) return " has a time in the future; check the clock";
    if (age_s > max_age_s) return " is " + format_fixed(age_s, 0) + " s old";
  }
  return "";
}

}  // namespace

MissionFile::MissionFile(const std::filesystem::path& memory, double max_age_s)
    : path_(memory.string() + ".mission"), max_age_s_(max_age_s) {}

void MissionFile::store_if_due(const Mission& mission, const std::optional<Pose2>& map_from_odom) {
  const auto now = std::chrono::steady_clock::now();
  if (max_age_s_ <= 0.0 || now - stored_ < std::chrono::seconds(1)) return;
  stored_ = now;
  if (!map_from_odom) return;
  const std::string target = mission.goal
                                 ? "goal " + to_line(*mission.goal)
                                 : "repeat " + to_text(mission.along_m.value_or(0.0)) + " " +
                                       to_text(mission.min_correlation) + " " + mission.route;
  const BootTime written = read_boot_time();
  std::string text = to_line(*map_from_odom) + target;
  if (mission.goal) text.pop_back();
  write_file(path_, text + "\nwritten " + written.boot + " " + to_text(written.seconds) + "\n");
}

void MissionFile::remove() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
  stored_ = {};
}

std::optional<Mission> MissionFile::load(WarningLog& log) {
  namespace fs = std::filesystem;
  std::error_code code;
  const auto written = fs::last_write_time(path_, code);
  if (code) return std::nullopt;
  const double age_s =
      std::chrono::duration<double>(fs::file_time_type::clock::now() - written).count();
  std::ifstream in(path_);
  in.imbue(std::locale::classic());  // independent of the host program's locale
  auto mission = read_mission(in);
  std::string word;
  BootTime at;
  std::string fault = " is damaged";
  if (mission && in >> word >> at.boot >> at.seconds && word == "written") {
    fault = find_rejection_reason(at, age_s, max_age_s_);
    if (fault.empty()) return mission;
  }
  log.warn("mission", path_.string() + fault + "; the robot does not continue");
  remove();
  return std::nullopt;
}

}  // namespace panonav::ros2
