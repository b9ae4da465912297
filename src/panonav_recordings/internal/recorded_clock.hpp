#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "panonav_recordings/recording.hpp"

namespace panonav::recordings {

/// Times of a message: when it was recorded, and the stamp of its header.
struct RecordedTimes {
  std::int64_t log_ns = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t order = 0;  ///< position in the files of the recording, from `storage_order`
};

/// Returns a number that ascends with the position of a message in the files of a recording.
[[nodiscard]] std::uint64_t storage_order(const MessageLocation& location);

/// The times of the messages of one topic, or of one link of transforms.
struct TimedStream {
  std::string name;  ///< as in "the stamps of the odometry"
  std::vector<RecordedTimes> times;
};

/// Converts the times of all streams to one clock that never restarts; the first stream are the
/// images, one or more. Stamps that are set back by more than a second begin a new part. Log times
/// that restart continue two seconds after the part before. Parts of the images are shifted so that
/// their smallest delay from stamp to log time is that of the first part; parts of other streams
/// like the images recorded at the same time, or, if their delay shows another clock
/// (`has_same_clock`), to the same smallest delay.
///
/// `use_log_times`: the headers have no stamps; log times replace them. Returns warnings, one line
/// each. Cost: linear, and a sort of each stream by `order`.
[[nodiscard]] std::vector<std::string> unify_clocks(std::vector<TimedStream>& streams,
                                                    bool use_log_times);

}  // namespace panonav::recordings
