#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace panonav::recordings {

/// A child process whose output is read through pipes; it is killed with the object. No shell sees
/// the arguments.
class ChildProcess {
 public:
  /// Finds arguments[0] in PATH. Standard input is empty. Throws Error when it cannot be started.
  explicit ChildProcess(const std::vector<std::string>& arguments);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] int output() const noexcept { return output_; }  ///< its standard output
  [[nodiscard]] int errors() const noexcept { return errors_; }  ///< its standard error
  /// Ends it at once; another thread may call while one reads. Its pipes then end, too.
  void stop() const noexcept;
  /// Waits for its end; -1 after a signal.
  int wait();

 private:
  pid_t child_ = 0;
  int output_ = -1;
  int errors_ = -1;
};

}  // namespace panonav::recordings
