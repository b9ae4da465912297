#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace panonav::recordings {

/// Runs a program as a child process and reads its output through pipes. The destructor kills it.
/// Arguments are passed without a shell.
class ChildProcess {
 public:
  /// Starts the program `arguments[0]`, searched for in PATH, with an empty standard input. Throws
  /// Error if it cannot be started.
  explicit ChildProcess(const std::vector<std::string>& arguments);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] int output() const noexcept { return output_; }  ///< descriptor of its stdout
  [[nodiscard]] int errors() const noexcept { return errors_; }  ///< descriptor of its stderr
  /// Kills the child at once, so that its pipes end. Another thread may be reading them meanwhile.
  void stop() const noexcept;
  /// Waits for the child to end and returns its exit code; -1 if a signal ended it.
  int wait();

 private:
  pid_t child_ = 0;
  int output_ = -1;
  int errors_ = -1;
};

}  // namespace panonav::recordings
