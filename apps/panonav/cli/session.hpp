#pragma once

#include <chrono>
#include <cstddef>
#include <initializer_list>
#include <mutex>
#include <string>
#include <string_view>

#include "cli/json.hpp"
#include "cli/verb.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/text.hpp"
#include "panonav/pipeline/memory_map.hpp"

namespace panonav::command {

/// Verbosity and number of threads of a verb.
struct SessionOptions {
  bool json = false;     ///< results as JSON
  bool quiet = false;    ///< results and errors only
  bool verbose = false;  ///< each step and its time
  int threads = 0;       ///< 0: one per core
};

/// Provides a verb with its threads and with its text and JSON output.
class Session {
 public:
  explicit Session(const SessionOptions& options);

  /// True if results are printed as JSON; nothing else then goes to standard output.
  [[nodiscard]] bool json() const noexcept { return options_.json; }
  [[nodiscard]] bool quiet() const noexcept { return options_.quiet; }
  [[nodiscard]] Executor& executor() noexcept { return executor_; }

  /// Prints one line on standard output.
  void print(std::string_view line);
  /// Prints a warning or a hint as one line on standard error, not with --quiet.
  void note(std::string_view line);
  /// Prints one line on standard error, also with --quiet: the user needs it to continue.
  void prompt(std::string_view line) { write_line(line); }
  /// With --verbose, prints the seconds since the start and the line on standard error.
  void detail(std::string_view line);
  /// Prints on standard error why there is no answer, and returns that exit code.
  [[nodiscard]] ExitCode no_answer(std::string_view line);
  /// Prints a command for the user to type next, quoted for a shell, on standard output. Prints
  /// nothing with --quiet or --json.
  void suggest(std::initializer_list<std::string_view> command, std::string_view lead = "Next:");
  /// Sets the unit in which the memory of this verb has its lengths; metres by default.
  void set_length_unit(LengthUnit unit) noexcept { length_unit_ = unit; }
  [[nodiscard]] LengthUnit length_unit() const noexcept { return length_unit_; }
  /// Returns a length with its unit, such as "0.21 m" or "0.21 view steps".
  [[nodiscard]] std::string format_length(double length, int digits) const;
  /// Returns the document as one line. If lengths are in view steps, keys that end in "_m" end in
  /// "_steps" instead.
  [[nodiscard]] std::string json_line(ordered_json document) const;

  /// Flushes standard output.
  void flush();
  /// Flushes standard output. Throws FileError if it could not be written, for example to a full
  /// disk.
  void finish_output();

  /// Returns the text in bold or in colour if standard output is a terminal that supports it,
  /// otherwise unchanged.
  [[nodiscard]] std::string bold(std::string_view text) const;
  [[nodiscard]] std::string green(std::string_view text) const;
  [[nodiscard]] std::string red(std::string_view text) const;

  /// Draws a progress bar on standard error, which the next output erases; only for terminals.
  void draw_bar(std::string_view bar);
  void clear_bar();

 private:
  [[nodiscard]] std::string apply_style(std::string_view text, std::string_view code) const;
  void write_line(std::string_view line);
  void erase_bar();
  SessionOptions options_;
  bool colours_;
  std::mutex mutex_;  // guards output, as any thread may print warnings
  bool bar_drawn_ = false;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  LengthUnit length_unit_ = LengthUnit::metres;
  Executor executor_;
};

/// Shows a progress bar with the time left on standard error: only on a terminal, only if the work
/// takes longer than a second, and not with --quiet. The destructor removes the bar. With
/// --verbose, begin and end of the work are printed. Not thread-safe: call `advance` from one
/// thread only.
class Progress {
 public:
  Progress(Session& session, std::string label, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);
  /// Changes the label and draws the bar at once.
  void relabel(std::string label);
  /// Erases the bar until the next `advance`.
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
