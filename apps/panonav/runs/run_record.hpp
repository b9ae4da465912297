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

/// File and address for recording and viewing a run.
struct RunRecordArguments {
  std::optional<std::string> file;
  std::optional<std::string> view;  ///< [ADDRESS:]PORT
};

/// Adds --record.
void declare_record(Arguments& arguments, RunRecordArguments& record);
/// Adds --view.
void declare_view(Arguments& arguments, RunRecordArguments& record);

/// Writes the record of a run (--record) and shows it (--view). If the record can no longer be
/// written, it ends with a note, and the run continues.
class RunRecord {
 public:
  /// Lists the panels and commands that viewers of a run can use.
  struct Offers {
    std::string memory;  ///< whose thumbnails they see; empty: none
    viewer::ViewerInput takes = viewer::ViewerInput::none;
  };

  /// Does nothing without a file or viewer. Of a live run moments are left out that the disk or a
  /// viewer does not keep up with; any other run waits for both. Throws UsageError where
  /// there is no such address, FileError where the file cannot be made. `read`: what the run reads;
  /// the first names it to viewers.
  RunRecord(const RunRecordArguments& arguments, std::span<const std::string> read, bool live,
            Session& session, const Offers& offers);

  /// Moments are added to the page, too, which must outlive the run.
  void copy_to(viewer::RunPage& page) noexcept { page_ = &page; }
  /// True if `add` has an effect.
  [[nodiscard]] bool is_active() const noexcept { return recorder_ || viewer_ || page_ != nullptr; }
  /// True if a file or a viewer, present or waited for, takes images.
  [[nodiscard]] bool needs_images() const;
  /// Makes the moment of an observation, with its image if `needs_images`.
  [[nodiscard]] recordings::RunMoment make_moment(const Observation& observation,
                                                  std::size_t number) const;
  void add(recordings::RunMoment moment);
  /// Returns the latest input of a viewer since the last call.
  [[nodiscard]] std::optional<ReferencePose> take_viewer_input() {
    return viewer_ ? viewer_->consume_viewer_input() : std::nullopt;
  }
  /// Writes what is waiting and tells viewers that the run has ended.
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
[[nodiscard]] std::vector<std::uint8_t> load_best_match(const Place& place, const MemoryFile& file);

}  // namespace panonav::command
