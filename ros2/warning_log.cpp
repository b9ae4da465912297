#include "ros2/warning_log.hpp"

#include <utility>

namespace panonav::ros2 {

WarningLog::WarningLog(Note note) : note_(std::move(note)) {}

void WarningLog::warn(std::string_view kind, const std::string& line) {
  constexpr std::chrono::seconds min_interval(10);
  const std::lock_guard lock(mutex_);
  ++count_;
  const auto now = std::chrono::steady_clock::now();
  const auto [found, is_new] = kinds_.try_emplace(std::string(kind));
  Kind& known = found->second;
  if (!is_new && now - known.reported < min_interval) {
    ++known.held_back;
    return;
  }
  note_("warning: " + line +
        (known.held_back > 0 ? " (and " + std::to_string(known.held_back) + " times before)" : ""));
  known = {now, 0};
}

std::size_t WarningLog::count() const {
  const std::lock_guard lock(mutex_);
  return count_;
}

}  // namespace panonav::ros2
