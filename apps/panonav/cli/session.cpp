#include "cli/session.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <utility>

#include "cli/option_values.hpp"
#include "panonav/core/address.hpp"
#include "panonav/core/error.hpp"
#include "panonav_server/place_json.hpp"

namespace panonav::command {

namespace {

bool supports_colours(int descriptor) {
  const char* terminal = std::getenv("TERM");
  return isatty(descriptor) == 1 && std::getenv("NO_COLOR") == nullptr && terminal != nullptr &&
         std::string_view(terminal) != "dumb";
}

// Escapes control sequences, which names may contain, but keeps line ends and the session's own
// styles.
std::string escape_control_characters(std::string_view text) {
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
    result += to_readable_line(text.substr(0, end));
    result += next;
    text.remove_prefix(end + next.size());
  }
  return result;
}

// Returns the time left, estimated from the rate so far, as a text; empty before 5 steps and 2
// seconds have passed.
std::string format_time_left(double elapsed_s, std::size_t done, std::size_t total) {
  if (elapsed_s < 2.0 || total < 10 || done < 5 || 20 * done < total || done >= total) return {};
  const double left_s = elapsed_s * static_cast<double>(total - done) / static_cast<double>(done);
  if (left_s < 90.0) return ", about " + format_fixed(std::max(1.0, left_s), 0) + " s left";
  return ", about " + format_fixed(left_s / 60.0, left_s < 570.0 ? 1 : 0) + " min left";
}

}  // namespace

Session::Session(const SessionOptions& options)
    : options_(options),
      colours_(!options.json && supports_colours(STDOUT_FILENO)),
      executor_(options.threads) {}

void Session::write_line(std::string_view line) {
  const std::lock_guard lock(mutex_);
  erase_bar();
  std::cerr << escape_control_characters(replace_options_by_flags(mask_passwords(line))) << '\n';
}

void Session::print(std::string_view text) {
  const std::lock_guard lock(mutex_);
  erase_bar();
  const std::string line = mask_passwords(text);
  std::cout << (options_.json ? line : escape_control_characters(line)) << '\n';
}

std::string Session::format_length(double length, int digits) const {
  return format_fixed(length, digits) + " " + to_string(length_unit_);
}

std::string Session::json_line(ordered_json document) const {
  server::rename_lengths(document, length_unit_);
  return command::json_line(document);
}

void Session::note(std::string_view line) {
  if (!options_.quiet) write_line(line);
}

void Session::detail(std::string_view line) {
  if (!options_.verbose) return;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  std::string text = "[";
  write_line(text.append(format_fixed(elapsed.count(), 2)).append(" s] ").append(line));
}

ExitCode Session::no_answer(std::string_view line) {
  write_line(line);
  return ExitCode::no_answer;
}

void Session::suggest(std::initializer_list<std::string_view> command, std::string_view lead) {
  if (options_.quiet || options_.json) return;
  std::string line(lead);
  for (const auto word : command) line.append(" ").append(quote_for_shell(word));
  print(line);
}

void Session::draw_bar(std::string_view bar) {
  const std::lock_guard lock(mutex_);
  std::cerr << "\r\033[K" << bar << std::flush;
  bar_drawn_ = true;
}

void Session::clear_bar() {
  const std::lock_guard lock(mutex_);
  erase_bar();
}

void Session::erase_bar() {
  if (!bar_drawn_) return;
  std::cerr << "\r\033[K" << std::flush;
  bar_drawn_ = false;
}

void Session::flush() {
  std::cout.flush();
}

void Session::finish_output() {
  std::cout.flush();
  if (!std::cout) throw FileError("standard output", "cannot be written; is the disk full?");
}

std::string Session::apply_style(std::string_view text, std::string_view code) const {
  if (!colours_) return std::string(text);
  return "\033[" + std::string(code) + "m" + std::string(text) + "\033[0m";
}

std::string Session::bold(std::string_view text) const {
  return apply_style(text, "1");
}
std::string Session::green(std::string_view text) const {
  return apply_style(text, "32");
}
std::string Session::red(std::string_view text) const {
  return apply_style(text, "31");
}

Progress::Progress(Session& session, std::string label, std::size_t total)
    : session_(session),
      label_(std::move(label)),
      total_(total),
      visible_(!session.quiet() && isatty(STDERR_FILENO) == 1) {
  session_.detail(label_ + ": 0 of " + std::to_string(total_));
}

Progress::~Progress() {
  clear();
  const std::chrono::duration<double> elapsed = Clock::now() - start_;
  session_.detail(label_ + ": " + std::to_string(done_) + " of " + std::to_string(total_) + " in " +
                  format_fixed(elapsed.count(), 2) + " s");
}

void Progress::advance(std::size_t steps) {
  done_ += steps;
  if (!visible_) return;
  const auto now = Clock::now();
  using namespace std::chrono_literals;
  if (now - start_ < 1s || now - last_draw_ < 100ms) return;
  last_draw_ = now;
  draw();
}

void Progress::relabel(std::string label) {
  label_ = std::move(label);
  session_.detail(label_);
  if (visible_ && Clock::now() - start_ >= std::chrono::seconds(1)) draw();
}

void Progress::draw() {
  constexpr std::size_t width = 30;
  const std::size_t filled = total_ == 0 ? 0 : std::min(width, width * done_ / total_);
  const std::chrono::duration<double> elapsed = Clock::now() - start_;
  session_.draw_bar(label_ + " [" + std::string(filled, '=') + std::string(width - filled, ' ') +
                    "] " + std::to_string(done_) + "/" + std::to_string(total_) +
                    format_time_left(elapsed.count(), done_, total_));
}

}  // namespace panonav::command
