#pragma once

#include <chrono>
#include <cstddef>
#include <initializer_list>
#include <mutex>
#include <string>
#include <string_view>

#include "cli/verb.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

/// Verbosity and number of threads of a verb.
struct SessionOptions {
  bool json = false;     ///< results as JSON
  bool quiet = false;    ///< results and errors only
  bool verbose = false;  ///< what is done, and when
  int threads = 0;       ///< 0: one per core
};

/// The environment of a verb: its threads, and its output for people and machines.
class Session {
 public:
  explicit Session(const SessionOptions& options);

  /// The caller is a machine: results as JSON, nothing else on standard output.
  [[nodiscard]] bool json() const noexcept { return options_.json; }
  [[nodiscard]] bool quiet() const noexcept { return options_.quiet; }
  [[nodiscard]] Executor& executor() noexcept { return executor_; }

  /// One line on standard output.
  void print(std::string_view line);
  /// One line on standard error that is no error: a warning or a hint. Silent with --quiet.
  void note(std::string_view line);
  /// One line on standard error that the user needs to go on: not silent with --quiet either.
  void prompt(std::string_view line) { write_line(line); }
  /// Prints the line on standard error with --verbose, after the seconds since the start.
  void detail(std::string_view line);
  /// Says why there is no answer, on standard error.
  [[nodiscard]] ExitCode no_answer(std::string_view line);
  /// A command to type, on standard output, its words as a shell wants them. Silent with --quiet.
  void suggest(std::initializer_list<std::string_view> command, std::string_view lead = "Next:");
  /// Flushes standard output.
  void flush();
  /// Throws FileError when standard output could not be written (a full disk behind a redirection).
  void finish_output();

  /// The text in bold or in colour where standard output is a terminal that wants it.
  [[nodiscard]] std::string bold(std::string_view text) const;
  [[nodiscard]] std::string green(std::string_view text) const;
  [[nodiscard]] std::string red(std::string_view text) const;

  /// A line on standard error that the next one takes away; only for terminals.
  void draw_bar(std::string_view bar);
  void clear_bar();

 private:
  [[nodiscard]] std::string apply_style(std::string_view text, std::string_view code) const;
  void write_line(std::string_view line);
  void erase_bar();
  SessionOptions options_;
  bool colours_;
  std::mutex mutex_;  // of what is written: warnings come from any thread
  bool bar_drawn_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Executor executor_;
};

/// Shows a progress bar with the time left on standard error: only on a terminal, only if the work
/// takes longer than a second, and not with --quiet. The destructor removes the bar. With
/// --verbose, begin and end of the work are printed. Not thread-safe: advance it from one thread.
class Progress {
 public:
  Progress(Session& session, std::string label, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);
  /// Changes the label and draws the bar at once.
  void relabel(std::string label);
  /// Takes the bar away until the next advance.
  void clear() { session_.clear_bar(); }

 private:
  using Clock = std::chrono::steady_clock;
  void draw();
  Session& session_;
  std::string label_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool visible_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_draw_ = start_;
};

}  // namespace panonav::command
