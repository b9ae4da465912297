#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace panonav::ros2 {

using Note = std::function<void(const std::string& line)>;  ///< is called from any thread

/// Reports warnings: of each kind at most one in ten seconds, with the number of those between.
class WarningLog {
 public:
  explicit WarningLog(Note note);
  /// Reports the line, from any thread. `kind`: one of few.
  void warn(std::string_view kind, const std::string& line);
  /// Returns the number of all warnings, reported or not.
  [[nodiscard]] std::size_t count() const;

 private:
  struct Kind {
    std::chrono::steady_clock::time_point reported;
    std::size_t held_back = 0;  // since then
  };
  Note note_;
  mutable std::mutex mutex_;
  std::map<std::string, Kind, std::less<>> kinds_;
  std::size_t count_ = 0;
};

}  // namespace panonav::ros2
