#include "cli/session.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <utility>

#include "cli/json.hpp"
#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

bool wants_colours(int descriptor) {
  const char* terminal = std::getenv("TERM");
  return isatty(descriptor) == 1 && std::getenv("NO_COLOR") == nullptr && terminal != nullptr &&
         std::string_view(terminal) != "dumb";
}

// A name may hold anything, also what a terminal takes for a command. Lines and our own styles
// stay.
std::string readable(std::string_view text) {
  constexpr std::array<std::string_view, 5> kept{"\n", "\033[0m", "\033[1m", "\033[31m",
                                                 "\033[32m"};
  std::string result;
  while (!text.empty()) {
    std::size_t end = text.size();
    std::string_view next;
    for (const std::string_view mark : kept) {
      if (const auto at = text.find(mark); at < end) {
        end = at;
        next = mark;
      }
    }
    result += readable_line(text.substr(0, end));
    result += next;
    text.remove_prefix(end + next.size());
  }
  return result;
}

}  // namespace

Session::Session(bool json, int threads, bool former_keys)
    : json_(json),
      former_keys_(json && former_keys),
      colours_(!json && wants_colours(STDOUT_FILENO)),
      executor_(threads) {
  if (former_keys_) note("--former-keys: the next version will no longer know these keys");
}

void Session::print(std::string_view line) {
  if (former_keys_) {
    std::cout << with_former_keys(line) << '\n';
  } else if (json_) {
    std::cout << line << '\n';
  } else {
    std::cout << readable(line) << '\n';
  }
}

void Session::note(std::string_view line) {
  std::cerr << line << '\n';
}

void Session::finish_output() {
  std::cout.flush();
  if (!std::cout) throw FileError("standard output", "cannot be written; is the disk full?");
}

std::string Session::styled(std::string_view text, std::string_view code) const {
  if (!colours_) return std::string(text);
  return "\033[" + std::string(code) + "m" + std::string(text) + "\033[0m";
}

std::string Session::strong(std::string_view text) const {
  return styled(text, "1");
}
std::string Session::good(std::string_view text) const {
  return styled(text, "32");
}
std::string Session::bad(std::string_view text) const {
  return styled(text, "31");
}

Progress::Progress(std::string label, std::size_t total)
    : label_(std::move(label)), total_(total), terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  clear();
}

void Progress::advance(std::size_t steps) {
  done_ += steps;
  if (!terminal_) return;
  const auto now = Clock::now();
  using namespace std::chrono_literals;
  if (now - start_ < 1s || now - last_draw_ < 100ms) return;
  last_draw_ = now;
  draw();
}

void Progress::relabel(std::string label) {
  label_ = std::move(label);
  if (terminal_ && Clock::now() - start_ >= std::chrono::seconds(1)) draw();
}

void Progress::draw() {
  constexpr std::size_t width = 30;
  const std::size_t filled = total_ == 0 ? 0 : std::min(width, width * done_ / total_);
  std::cerr << "\r\033[K" << label_ << " [" << std::string(filled, '=')
            << std::string(width - filled, ' ') << "] " << done_ << '/' << total_ << std::flush;
  drawn_ = true;
}

void Progress::clear() {
  if (!drawn_) return;
  std::cerr << "\r\033[K" << std::flush;
  drawn_ = false;
}

}  // namespace panonav::command
