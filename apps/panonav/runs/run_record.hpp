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

/// Writes the record of a run (--record) and shows it in a browser (--view). If writing fails, the
/// session prints a note and the run continues without the record.
class RunRecord {
 public:
  /// Lists the panels and commands that viewers of a run can use.
  struct ViewerOptions {
    std::string memory;  ///< memory whose thumbnails are shown; empty: none
    viewer::ViewerInput takes = viewer::ViewerInput::none;
  };

  /// Opens the file and starts the page, if requested. If the disk or a viewer is too slow, a live
  /// run leaves out moments; any other run waits. `inputs`: of the run; the first one
  /// is the title of the page. Throws UsageError on an invalid address, FileError if the file
  /// cannot be created.
  RunRecord(const RunRecordArguments& arguments, std::span<const std::string> inputs, bool live,
            Session& session, const ViewerOptions& viewer_options);

  /// Adds all following moments to the page, too. The page must outlive this object.
  void copy_to(viewer::RunPage& page) noexcept { page_ = &page; }
  /// True if `add` has an effect.
  [[nodiscard]] bool is_active() const noexcept { return recorder_ || viewer_ || page_ != nullptr; }
  /// True if moments need images: there is a file, a page or a viewer, or a run waits for a viewer.
  [[nodiscard]] bool needs_images() const;
  /// Makes the moment of an observation, with its image if `needs_images`.
  [[nodiscard]] recordings::RunMoment make_moment(const Observation& observation,
                                                  std::size_t number) const;
  void add(recordings::RunMoment moment);
  /// Returns the latest input of a viewer since the last call; nullopt if there is none.
  [[nodiscard]] std::optional<ReferencePose> take_viewer_input() {
    return viewer_ ? viewer_->consume_viewer_input() : std::nullopt;
  }
  /// Writes pending moments, ends the connections to viewers and closes the file.
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

/// Returns the thumbnail of the most similar view; empty if there is none. Finds the view by
/// name, as views that were just added have other ids in the file.
[[nodiscard]] std::vector<std::uint8_t> load_best_match(const Place& place, const MemoryFile& file);

}  // namespace panonav::command
