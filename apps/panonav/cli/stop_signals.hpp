#pragma once

#include <array>
#include <csignal>
#include <functional>
#include <thread>

namespace panonav::command {

/// Calls `stop` on another thread when the user or the system asks the program to end; a second
/// time, half a second later or more, ends it at once, also when this object is gone: what the run
/// has to store comes after it. One at a time.
class StopSignals {
 public:
  /// Throws Error.
  explicit StopSignals(std::function<void()> stop);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  std::function<void()> stop_;
  std::array<int, 2> pipe_{-1, -1};
  struct sigaction interrupt_ {};
  struct sigaction terminate_ {};
  std::thread waiting_;
};

}  // namespace panonav::command
