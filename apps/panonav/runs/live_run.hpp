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
  std::optional<int> count;  ///< pictures, then the run ends
};

/// Adds --count, --camera-width and --camera-height.
void declare_live(Arguments& arguments, LiveArguments& live);

/// Opens a live source (`is_live`) with the image layout that the user states, or else
/// `remembered`. Rejects options for recordings. Notes of the source go to the session, which must
/// outlive it. Throws UsageError, FileError.
[[nodiscard]] std::unique_ptr<recordings::LiveObservations> open_live(
    const Arguments& arguments, const std::string& input, const PictureArguments& pictures,
    const std::optional<PictureSource>& remembered, const LiveArguments& live, Session& session);
/// Rejects options that apply to live sources only; also --count if the verb ends with its input.
void reject_live_options(const Arguments& arguments, const std::string& input, bool count);

/// Counts of a run over a source.
struct LiveCounts {
  std::size_t pictures = 0;
  std::size_t skipped = 0;         ///< pictures that could not be read, or not be used
  std::size_t lines_left_out = 0;  ///< for a slow reader
  /// Of the last pictures of a live source, which may never end: from arrival to answer, and the
  /// part of it that decoding took.
  std::vector<double> delays_ms;
  std::vector<double> decoding_ms;
  recordings::LivePictures::Counts source;
};

/// ", 3 could not be read, 2 came too fast and were dropped": what was out of the ordinary.
/// `moments_left_out`: of a record.
[[nodiscard]] std::string describe_events(const LiveCounts& counts, std::size_t moments_left_out);

/// Processes observations until the source ends, the program is to end (SIGINT, SIGTERM), or the
/// requested number is reached. Printing never delays a live source: a slow reader loses the oldest
/// lines.
class LiveRun {
 public:
  /// All must outlive *this. `part`: which pictures of a live source are taken; of others that is
  /// already chosen.
  LiveRun(ObservationSource& source, const PartArguments& part, const LiveArguments& live,
          Session& session);
  ~LiveRun();
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  /// Returns the line to print of an image that cannot be read (null) or answered; empty: none.
  using Skip = std::function<std::string(const Observation*, const Error&)>;
  /// Prints the line that `answer` returns for each observation, unless it is empty, then calls
  /// `keep`. An Error of the source or of `answer` skips the image, one of `keep` ends the run.
  void run(const std::function<std::string(const Observation&)>& answer,
           const std::function<void(Observation&&)>& keep, const Skip& skip = {});
  /// Waits until all lines are printed: what is to be stored comes before.
  const LiveCounts& finish();
  /// Time to decode the current observation; nullopt if the source is not live.
  [[nodiscard]] std::optional<double> decoding_ms() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::command
