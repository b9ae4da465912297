#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/session.hpp"
#include "panonav_recordings/live_observations.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

/// The arguments for live sources.
struct LiveArguments {
  std::optional<int> camera_width;
  std::optional<int> camera_height;
  std::optional<int> count;  ///< number of images after which the run ends
};

/// Adds --count, --camera-width and --camera-height.
void declare_live(Arguments& arguments, LiveArguments& live);

/// Opens a live source (`is_live`) with the image layout that the user states, or else with
/// `remembered`. Rejects options for recordings. The session prints notes of the source and must
/// outlive the source. Throws UsageError, FileError.
[[nodiscard]] std::unique_ptr<recordings::LiveObservations> open_live(
    const Arguments& arguments, const std::string& input, const PictureArguments& pictures,
    const std::optional<PictureSource>& remembered, const LiveArguments& live, Session& session);
/// Rejects options that apply to live sources only, with `count` also --count.
void reject_live_options(const Arguments& arguments, const std::string& input, bool count);

/// Counts of a run over a source.
struct LiveCounts {
  std::size_t pictures = 0;
  std::size_t skipped = 0;             ///< images that could not be read or answered
  std::size_t dropped_line_count = 0;  ///< lines dropped because the reader was slow
  /// For the last 100,000 images of a live source: time from arrival to answer, and the part of
  /// this time that decoding took.
  std::vector<double> delays_ms;
  std::vector<double> decoding_ms;
  recordings::LivePictures::Counts source;
};

/// Describes skipped, dropped and delayed images: ", 3 could not be read, 1 image
/// skipped because of too fast a rate". `moments_left_out` is the number of moments missing in the
/// record.
[[nodiscard]] std::string describe_events(const LiveCounts& counts, std::size_t moments_left_out);

/// Processes observations until the source ends, a signal (SIGINT, SIGTERM) arrives, or the
/// requested number is reached. Printing never delays a live source: if the reader of the output is
/// slow, the oldest lines are dropped.
class LiveRun {
 public:
  /// All arguments must outlive *this. `part` selects images of a live source; images of other
  /// sources are already selected.
  LiveRun(ObservationSource& source, const PartArguments& part, const LiveArguments& live,
          Session& session);
  ~LiveRun();
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  /// Returns the line to print for an image that cannot be read (then the observation is null) or
  /// answered; empty: no line.
  using Skip = std::function<std::string(const Observation*, const Error&)>;
  /// Prints the line that `answer` returns for each observation, unless it is empty, then calls
  /// `keep`. An Error thrown by the source or by `answer` skips the image; an Error thrown by
  /// `keep` ends the run.
  void run(const std::function<std::string(const Observation&)>& answer,
           const std::function<void(Observation&&)>& keep, const Skip& skip = {});
  /// Waits until all lines are printed and returns the counts. Results must be stored before, as a
  /// stalled reader blocks this call.
  const LiveCounts& finish();
  /// Time to decode the current observation; nullopt if the source is not live.
  [[nodiscard]] std::optional<double> decoding_ms() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::command
