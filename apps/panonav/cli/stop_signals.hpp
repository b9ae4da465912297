#pragma once

#include <array>
#include <csignal>
#include <functional>
#include <thread>

namespace panonav::command {

/// Calls `stop` on another thread at the first SIGINT or SIGTERM. A further signal at least half a
/// second later ends the program at once, also after this object is destroyed, as the run may still
/// be storing results. Only one object may exist at a time.
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
  std::thread waiting_thread_;
};

}  // namespace panonav::command
