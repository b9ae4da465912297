#include "cli/stop_signals.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

volatile std::sig_atomic_t signal_pipe = -1;  // what a handler may use is static

}  // namespace

StopSignals::StopSignals(std::function<void()> stop) : stop_(std::move(stop)) {
  if (pipe2(pipe_.data(), O_CLOEXEC) != 0) throw Error("no pipe can be made");
  signal_pipe = pipe_[1];
  struct sigaction action {};
  action.sa_handler = [](int) {
    const char asked = 's';
    (void)!write(signal_pipe, &asked, 1);
  };
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, &interrupt_);
  sigaction(SIGTERM, &action, &terminate_);
  waiting_ = std::thread([this] {
    char asked = 0;
    while (read(pipe_[0], &asked, 1) < 0) {
    }
    if (asked != 's') return;
    stop_();
    // A program that ends others may send a signal to this one and then to its group: one request.
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(500);
    while (std::chrono::steady_clock::now() < until) {
      pollfd again{pipe_[0], POLLIN, 0};
      if (poll(&again, 1, 50) == 1 && read(pipe_[0], &asked, 1) == 1 && asked == 'o') return;
    }
    signal(SIGINT, SIG_DFL);
    signal(SIGTERM, SIG_DFL);
  });
}

StopSignals::~StopSignals() {
  sigaction(SIGINT, &interrupt_, nullptr);
  sigaction(SIGTERM, &terminate_, nullptr);
  const char over = 'o';
  (void)!write(pipe_[1], &over, 1);
  waiting_.join();
  signal_pipe = -1;
  close(pipe_[0]);
  close(pipe_[1]);
}

}  // namespace panonav::command
