#include "verbs/run_record.hpp"

#include <filesystem>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

void declare_record(Arguments& arguments, std::optional<std::string>& file) {
  arguments.option("--record FILE", file,
                   "Write what is seen and answered as MCAP, for Rerun, Foxglove and Lichtblick");
}

RunRecord::RunRecord(const std::optional<std::string>& file, std::span<const std::string> read,
                     bool live, Session& session)
    : session_(session) {
  if (!file) return;
  for (const std::string& other : read) {
    std::error_code ignored;
    if (std::filesystem::equivalent(*file, other, ignored)) {
      throw UsageError("--record is " + *file + ", which the run reads; allowed: another file");
    }
  }
  recorder_.emplace(*file, RunRecorderOptions{.wait = !live});
}

void RunRecord::add(RunMoment moment) {
  if (!recorder_ || failed_) return;
  try {
    recorder_->add(std::move(moment));
  } catch (const Error& error) {
    failed_ = true;
    session_.note("the recording ends here: " + readable_line(error.what()));
  }
}

void RunRecord::close() {
  if (!recorder_ || failed_) return;
  try {
    recorder_->close();
  } catch (const Error& error) {
    failed_ = true;
    session_.note("the recording is cut short: " + readable_line(error.what()));
  }
}

std::vector<std::uint8_t> best_match_of(const Place& place, const MemoryFile& file) {
  if (place.matches.empty()) return {};
  const auto view = file.find(place.matches.front().name);
  const auto picture = view ? file.thumbnail(*view) : std::nullopt;
  return picture.value_or(std::vector<std::uint8_t>{});
}

}  // namespace panonav::command
