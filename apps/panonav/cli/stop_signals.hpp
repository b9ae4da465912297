#pragma once

#include <array>
#include <csignal>
#include <functional>
#include <string_view>
#include <thread>

namespace panonav::command {

/// Until `cancel`, prints at SIGINT and SIGTERM "panonav VERB: interrupted. TEXT" before the signal
/// ends the program. Changes nothing if `text` is empty or the signals are ignored. Only one object
/// may exist at a time.
class InterruptionNotice {
 public:
  InterruptionNotice(std::string_view verb, std::string_view text);
  ~InterruptionNotice() { cancel(); }
  InterruptionNotice(const InterruptionNotice&) = delete;
  InterruptionNotice& operator=(const InterruptionNotice&) = delete;

  /// Restores the default reaction, when the results are complete.
  void cancel() noexcept;
};

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
