#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>

#include "panonav/core/executor.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

/// What a verb needs of its surroundings: threads, and how to speak to people and to machines.
class Session {
 public:
  /// `former_keys`: keys of JSON are printed with their names of the last version.
  Session(bool json, int threads, bool former_keys = false);

  /// The caller is a machine: results as JSON, nothing else on standard output.
  [[nodiscard]] bool json() const noexcept { return json_; }
  [[nodiscard]] Executor& executor() noexcept { return executor_; }

  /// One line on standard output.
  void print(std::string_view line);
  /// One line on standard error that is no error: a warning, or what to do next.
  void note(std::string_view line);
  /// Throws FileError when standard output could not be written (a full disk behind a redirection).
  void finish_output();

  /// The text in bold or in colour where standard output is a terminal that wants it.
  [[nodiscard]] std::string strong(std::string_view text) const;
  [[nodiscard]] std::string good(std::string_view text) const;
  [[nodiscard]] std::string bad(std::string_view text) const;

 private:
  [[nodiscard]] std::string styled(std::string_view text, std::string_view code) const;
  bool json_;
  bool former_keys_;
  bool colours_;
  Executor executor_;
};

/// A bar on standard error, only where that is a terminal and only once the work has taken longer
/// than a second. The bar is gone when the object is. Not thread-safe: advance it from one thread.
class Progress {
 public:
  Progress(std::string label, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);
  /// What runs now; drawn at once.
  void relabel(std::string label);
  /// Takes the bar away until the next advance, so that a line can be printed.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;
  void draw();
  std::string label_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_draw_ = start_;
};

}  // namespace panonav::command
