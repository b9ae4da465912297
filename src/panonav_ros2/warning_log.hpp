#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace panonav::ros2 {

using Note = std::function<void(const std::string& line)>;  ///< is called from any thread

/// Reports warnings: of each kind at most one in ten seconds, with the number of those between.
/// For several threads.
class WarningLog {
 public:
  explicit WarningLog(Note note) : note_(std::move(note)) {}

  /// `kind`: one of few.
  void warn(const std::string& kind, const std::string& line) {
    constexpr std::chrono::seconds min_interval(10);
    const std::lock_guard lock(mutex_);
    ++count_;
    const auto now = std::chrono::steady_clock::now();
    const auto [found, is_new] = kinds_.try_emplace(kind);
    auto& [reported, held_back] = found->second;
    if (!is_new && now - reported < min_interval) {
      ++held_back;
      return;
    }
    note_("warning: " + line +
          (held_back > 0 ? " (and " + std::to_string(held_back) + " times before)" : ""));
    found->second = {now, 0};
  }

  /// Returns the number of all warnings, reported or not.
  [[nodiscard]] std::size_t count() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }

 private:
  struct Kind {
    std::chrono::steady_clock::time_point reported;
    std::size_t held_back = 0;  // since then
  };
  Note note_;
  mutable std::mutex mutex_;
  std::map<std::string, Kind> kinds_;
  std::size_t count_ = 0;
};

}  // namespace panonav::ros2
