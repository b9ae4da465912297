#include "support/command_runner.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <sstream>
#include <stdexcept>

namespace panonav::testing {

namespace {

struct Pipe {
  std::array<int, 2> ends{-1, -1};
  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  }
};

[[noreturn]] void become_panonav(const std::vector<std::string>& arguments,
                                 const CommandOptions& options, int out, int err) {
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  if (options.file_size_limit_bytes) {
    const rlimit limit{*options.file_size_limit_bytes, *options.file_size_limit_bytes};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  std::vector<char*> argv;
  std::string program = PANONAV_COMMAND;
  argv.push_back(program.data());
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  _exit(127);
}

}  // namespace

CommandResult run_panonav(const std::vector<std::string>& arguments,
                          const CommandOptions& options) {
  Pipe out;
  Pipe err;
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) become_panonav(arguments, options, out.ends[1], err.ends[1]);
  close(out.ends[1]);
  close(err.ends[1]);

  CommandResult result;
  const auto start = std::chrono::steady_clock::now();
  bool killed = false;
  std::array<pollfd, 2> polled{pollfd{out.ends[0], POLLIN, 0}, pollfd{err.ends[0], POLLIN, 0}};
  std::array<std::string*, 2> texts{&result.out, &result.err};
  int open_ends = 2;
  while (open_ends > 0) {
    poll(polled.data(), polled.size(), 2);
    for (std::size_t i = 0; i < polled.size(); ++i) {
      if (polled[i].fd < 0 || polled[i].revents == 0) continue;
      std::array<char, 65536> buffer{};
      const auto count = read(polled[i].fd, buffer.data(), buffer.size());
      if (count > 0) {
        texts[i]->append(buffer.data(), static_cast<std::size_t>(count));
      } else {
        close(polled[i].fd);
        polled[i].fd = -1;
        --open_ends;
      }
    }
    const auto elapsed = std::chrono::steady_clock::now() - start;
    if (options.kill_after_ms && !killed &&
        elapsed >= std::chrono::milliseconds(*options.kill_after_ms)) {
      kill(child, SIGKILL);
      killed = true;
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

std::string refusal(const std::vector<std::string>& arguments, const CommandOptions& options) {
  const auto result = run_panonav(arguments, options);
  EXPECT_EQ(result.exit_code, 2) << result.out << result.err;
  const auto said = lines(result.err);
  EXPECT_EQ(said.size(), 1U) << result.err;
  return said.empty() ? std::string() : said.front();
}

void expect_refusal(const std::vector<std::string>& arguments, std::string_view part,
                    const std::source_location& caller) {
  const ::testing::ScopedTrace trace(caller.file_name(), static_cast<int>(caller.line()), "");
  EXPECT_TRUE(contains(refusal(arguments), part));
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> found;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) found.push_back(line);
  return found;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::set<std::string> keys_of(const nlohmann::json& object) {
  std::set<std::string> keys;
  for (const auto& [key, value] : object.items()) keys.insert(key);
  return keys;
}

std::vector<std::string> with(std::vector<std::string> arguments,
                              const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

nlohmann::json answer_of(const std::vector<std::string>& arguments, int exit_code) {
  const auto result = run_panonav(arguments);
  EXPECT_EQ(result.exit_code, exit_code) << result.err;
  return nlohmann::json::parse(result.out);
}

std::vector<nlohmann::json> answers_of(const std::vector<std::string>& arguments, int exit_code) {
  const auto result = run_panonav(arguments);
  EXPECT_EQ(result.exit_code, exit_code) << result.err;
  std::vector<nlohmann::json> parsed;
  for (const auto& line : lines(result.out)) parsed.push_back(nlohmann::json::parse(line));
  return parsed;
}

void run_well(const std::vector<std::string>& arguments) {
  const auto result = run_panonav(arguments);
  ASSERT_EQ(result.exit_code, 0) << arguments.front() << ": " << result.err;
}

}  // namespace panonav::testing
