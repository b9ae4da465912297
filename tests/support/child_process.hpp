#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>

namespace panonav::testing {

/// Runs `body` in a child process, which may be killed; its return value is the child's exit code,
/// 99 when it throws.
inline pid_t start_child(const std::function<int()>& body) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  int code = 99;
  try {
    code = body();
  } catch (...) {
  }
  std::_Exit(code);
}

/// Waits for a child process and returns its exit code, -1 if a signal ended it.
inline int exit_code_of(pid_t child) {
  int status = 0;
  if (::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

}  // namespace panonav::testing
