#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace panonav::ros2 {

using Note = std::function<void(const std::string& line)>;  ///< called from any thread

/// Reports warnings, at most one per kind in ten seconds, with the number of suppressed ones.
/// Thread-safe.
class WarningLog {
 public:
  explicit WarningLog(Note note) : note_(std::move(note)) {}

  /// `kind` identifies similar warnings; there must be few kinds.
  void warn(const std::string& kind, const std::string& line) {
    constexpr std::chrono::seconds min_interval(10);
    const std::lock_guard lock(mutex_);
    ++count_;
    const auto now = std::chrono::steady_clock::now();
    const auto [found, is_new] = kinds_.try_emplace(kind);
    auto& [reported, suppressed_count] = found->second;
    if (!is_new && now - reported < min_interval) {
      ++suppressed_count;
      return;
    }
    note_("warning: " + line +
          (suppressed_count > 0 ? " (and " + std::to_string(suppressed_count) + " times before)"
                                : ""));
    found->second = {now, 0};
  }

  /// Returns the number of all warnings, including suppressed ones.
  [[nodiscard]] std::size_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }

 private:
  struct Kind {
    std::chrono::steady_clock::time_point reported;
    std::size_t suppressed_count = 0;  // suppressed warnings since then
  };
  Note note_;
  mutable std::mutex mutex_;
  std::map<std::string, Kind> kinds_;
  std::size_t count_ = 0;
};

}  // namespace panonav::ros2
