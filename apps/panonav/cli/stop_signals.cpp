#include "cli/stop_signals.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <ctime>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

// Static, as a signal handler cannot reach other variables.
volatile std::sig_atomic_t signal_pipe = -1;
std::atomic<std::int64_t> first_signal_ns = 0;  // 0: not yet

std::int64_t monotonic_time_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

// Handles SIGINT and SIGTERM. Signals within half a second count as one, as some programs signal
// the process and then its group.
void on_signal(int number) {
  constexpr std::int64_t min_repeat_delay_ns = 500'000'000;
  const std::int64_t now_ns = monotonic_time_ns();
  std::int64_t first_ns = 0;
  if (first_signal_ns.compare_exchange_strong(first_ns, now_ns)) {
    const char signal_byte = 's';
    (void)!write(signal_pipe, &signal_byte, 1);
  } else if (now_ns - first_ns >= min_repeat_delay_ns) {
    signal(number, SIG_DFL);
    raise(number);
  }
}

std::string interruption_line;  // complete before the handler that prints it is set

void on_interruption(int number) {
  (void)!write(STDERR_FILENO, interruption_line.data(), interruption_line.size());
  signal(number, SIG_DFL);
  raise(number);
}

}  // namespace

InterruptionNotice::InterruptionNotice(std::string_view verb, std::string_view text) {
  if (text.empty()) return;
  const bool is_terminal = isatty(STDERR_FILENO) != 0;
  interruption_line = is_terminal ? "\r\033[K" : "";  // replaces the progress bar and "^C"
  interruption_line.append("panonav ").append(verb).append(": interrupted. ").append(text) += '\n';
  for (const int number : {SIGINT, SIGTERM}) {
    if (signal(number, on_interruption) == SIG_IGN) signal(number, SIG_IGN);
  }
}

void InterruptionNotice::cancel() noexcept {
  for (const int number : {SIGINT, SIGTERM}) {
    const auto handler = signal(number, SIG_DFL);
    if (handler != on_interruption) signal(number, handler);
  }
}

StopSignals::StopSignals(std::function<void()> stop) : stop_(std::move(stop)) {
  if (pipe2(pipe_.data(), O_CLOEXEC) != 0) throw Error("no pipe can be made");
  signal_pipe = pipe_[1];
  first_signal_ns = 0;
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, &interrupt_);
  sigaction(SIGTERM, &action, &terminate_);
  waiting_thread_ = std::thread([this] {
    char signal_byte = 0;
    while (read(pipe_[0], &signal_byte, 1) < 0) {
    }
    if (signal_byte == 's') stop_();
  });
}

StopSignals::~StopSignals() {
  if (first_signal_ns == 0) {
    sigaction(SIGINT, &interrupt_, nullptr);
    sigaction(SIGTERM, &terminate_, nullptr);
  }
  const char end_byte = 'o';
  (void)!write(pipe_[1], &end_byte, 1);
  waiting_thread_.join();
  signal_pipe = -1;
  close(pipe_[0]);
  close(pipe_[1]);
}

}  // namespace panonav::command
