#include "panonav_recordings/internal/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>

#include "panonav/core/error.hpp"

extern char** environ;  // NOLINT(readability-redundant-declaration)

namespace panonav::recordings {

ChildProcess::ChildProcess(const std::vector<std::string>& arguments) {
  std::array<int, 2> output{-1, -1};
  std::array<int, 2> errors{-1, -1};
  const auto close_all = [&] {
    for (const int end : {output[0], output[1], errors[0], errors[1]}) {
      if (end >= 0) close(end);
    }
  };
  if (pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(errors.data(), O_CLOEXEC) != 0) {
    close_all();
    throw Error("no pipe can be made to the program " + arguments.front());
  }
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors[1], STDERR_FILENO);
  const int error =
      posix_spawnp(&child_, words.front().c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    close_all();
    throw Error("the program " + arguments.front() + " cannot be started");
  }
  close(output[1]);
  close(errors[1]);
  output_ = output[0];
  errors_ = errors[0];
}

ChildProcess::~ChildProcess() {
  close(output_);
  close(errors_);
  stop();
  wait();
}

void ChildProcess::stop() const noexcept {
  if (child_ > 0) kill(child_, SIGKILL);
}

int ChildProcess::wait() {
  if (child_ <= 0) return -1;
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = 0;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace panonav::recordings
