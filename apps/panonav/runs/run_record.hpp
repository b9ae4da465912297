#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav/storage/memory_file.hpp"
#include "panonav_recordings/run_recorder.hpp"
#include "panonav_viewer/page.hpp"
#include "panonav_viewer/view_server.hpp"

namespace panonav::command {

/// Where a run is kept and shown.
struct RunRecordArguments {
  std::optional<std::string> file;
  std::optional<std::string> view;  ///< [ADDRESS:]PORT
};

/// Adds --record.
void declare_record(Arguments& arguments, RunRecordArguments& record);
/// Adds --view.
void declare_view(Arguments& arguments, RunRecordArguments& record);

/// What --record writes of a run, and --view shows. A record that cannot be written any more ends
/// with a note, and the run goes on: its answers are worth more.
class RunRecord {
 public:
  /// What viewers may ask of a run, and tell it.
  struct Offers {
    std::string memory;  ///< whose thumbnails they see; empty: none
    viewer::ViewWish takes = viewer::ViewWish::none;
  };

  /// Does nothing where nothing is wanted. Of a live run moments are left out that the disk or a
  /// viewer does not keep up with; any other run waits for both. Throws UsageError where the file
  /// is one of those that the run reads or there is no such address, FileError where the file
  /// cannot be made.
  RunRecord(const RunRecordArguments& wanted, std::span<const std::string> read, bool live,
            Session& session, const Offers& offers);

  /// Moments are added to the page, too, which must outlive the run.
  void also_into(viewer::RunPage& page) noexcept { page_ = &page; }
  /// Whether `add` does anything.
  [[nodiscard]] bool wanted() const noexcept { return recorder_ || viewer_ || page_ != nullptr; }
  /// Whether somebody looks at pictures: a file, or a viewer who is there or waited for.
  [[nodiscard]] bool wants_pictures() const;
  /// What is known of an observation, with its picture where it is wanted.
  [[nodiscard]] recordings::RunMoment make_moment(const Observation& seen,
                                                  std::size_t number) const;
  void add(recordings::RunMoment moment);
  /// What a viewer wished since the last time.
  [[nodiscard]] std::optional<ReferencePose> consume_wish() {
    return viewer_ ? viewer_->consume_wish() : std::nullopt;
  }
  /// All that waits is written, and viewers know that the run has ended.
  void close();
  [[nodiscard]] std::size_t left_out() const { return recorder_ ? recorder_->left_out() : 0; }

 private:
  Session& session_;
  bool live_;
  std::optional<recordings::RunRecorder> recorder_;
  std::optional<viewer::ViewServer> viewer_;
  viewer::RunPage* page_ = nullptr;
  bool failed_ = false;
};

/// The thumbnail of the most similar view, by its name: views that were just added have other ids
/// in the file. Empty without one.
[[nodiscard]] std::vector<std::uint8_t> best_match_of(const Place& place, const MemoryFile& file);

}  // namespace panonav::command
