#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/pipeline/run_recorder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::command {

/// Adds --record.
void declare_record(Arguments& arguments, std::optional<std::string>& file);

/// What --record writes of a run. A record that cannot be written any more ends with a note, and
/// the run goes on: its answers are worth more.
class RunRecord {
 public:
  /// Does nothing without a file. Of a live run moments are left out that the disk does not keep up
  /// with. Throws UsageError where the file is one of those that the run reads, FileError where it
  /// cannot be made.
  RunRecord(const std::optional<std::string>& file, std::span<const std::string> read, bool live,
            Session& session);

  [[nodiscard]] bool wanted() const noexcept { return recorder_.has_value(); }
  void add(RunMoment moment);
  /// All that waits is written.
  void close();
  [[nodiscard]] std::size_t left_out() const { return recorder_ ? recorder_->left_out() : 0; }

 private:
  Session& session_;
  std::optional<RunRecorder> recorder_;
  bool failed_ = false;
};

/// The thumbnail of the most similar view, by its name: views that were just learnt have other ids
/// in the file. Empty without one.
[[nodiscard]] std::vector<std::uint8_t> best_match_of(const Place& place, const MemoryFile& file);

}  // namespace panonav::command
