#include "panonav_recordings/internal/recorded_clock.hpp"

#include <algorithm>
#include <limits>

#include "panonav/core/number_text.hpp"

namespace panonav::recordings {

namespace {

constexpr std::int64_t clock_second_ns = 1'000'000'000;
/// Smallest step back of a clock that is a restart, and largest difference of the delays from stamp
/// to log time on one clock. Late messages and slow connections stay below it (chosen).
constexpr std::int64_t tolerance_ns = clock_second_ns;
/// Stream with more restarts are in no order at all.
constexpr std::size_t max_restarts = 1000;

/// MessageTimes beyond it, which only damaged files have, are moved to it, so that differences fit.
constexpr std::int64_t max_time_ns = 4'000'000'000 * clock_second_ns;

using MessageTimes = std::vector<RecordedTimes>;
using ClockMember = std::int64_t RecordedTimes::*;

/// Adds without overflow: sums of absurd times wrap around.
std::int64_t add_wrapping(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

void limit_times(std::vector<TimedStream>& streams) {
  for (TimedStream& stream : streams) {
    for (RecordedTimes& message : stream.times) {
      message.log_ns = std::clamp(message.log_ns, -max_time_ns, max_time_ns);
      message.stamp_ns = std::clamp(message.stamp_ns, -max_time_ns, max_time_ns);
    }
  }
}

/// Returns the messages with which a clock restarts, in storage order: it is set back, and the next
/// message confirms it.
std::vector<std::size_t> find_restarts(const MessageTimes& times, ClockMember clock) {
  std::vector<std::size_t> restarts;
  std::int64_t latest_ns = std::numeric_limits<std::int64_t>::min();
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto is_behind = [&](std::size_t at) {
      return latest_ns > times[at].*clock && latest_ns - times[at].*clock > tolerance_ns;
    };
    if (i > 0 && i + 1 < times.size() && is_behind(i) && is_behind(i + 1)) {
      restarts.push_back(i);
      latest_ns = times[i].*clock;
    }
    latest_ns = std::max(latest_ns, times[i].*clock);
  }
  if (restarts.size() > max_restarts) restarts.clear();
  return restarts;
}

TimeSpan span_of(const MessageTimes& times, ClockMember clock, std::size_t begin, std::size_t end) {
  TimeSpan span{times[begin].*clock, times[begin].*clock};
  for (std::size_t i = begin; i < end; ++i) {
    span.begin_ns = std::min(span.begin_ns, times[i].*clock);
    span.end_ns = std::max(span.end_ns, times[i].*clock);
  }
  return span;
}

/// Length of the time that both spans contain; negative: the time between them.
std::int64_t overlap_ns(const TimeSpan& a, const TimeSpan& b) {
  return std::min(a.end_ns, b.end_ns) - std::max(a.begin_ns, b.begin_ns);
}

/// Continues log times that restart. Returns the number of restarts.
std::size_t continue_log_times(std::vector<TimedStream>& streams) {
  const auto densest = std::ranges::max_element(
      streams, {}, [](const TimedStream& stream) { return stream.times.size(); });
  const MessageTimes& times = densest->times;
  std::vector<std::uint64_t> cuts;
  std::size_t begin = 0;
  for (const std::size_t restart : find_restarts(times, &RecordedTimes::log_ns)) {
    // Files or chunks in another order than that of their times are no restart.
    const TimeSpan before = span_of(times, &RecordedTimes::log_ns, begin, restart);
    const TimeSpan after = span_of(times, &RecordedTimes::log_ns, restart, times.size());
    if (overlap_ns(before, after) < 0) continue;
    cuts.push_back(times[restart].order);
    begin = restart;
  }
  std::vector<TimeSpan> parts(cuts.size() + 1, TimeSpan{std::numeric_limits<std::int64_t>::max(),
                                                        std::numeric_limits<std::int64_t>::min()});
  const auto part_of = [&](const RecordedTimes& message) {
    return static_cast<std::size_t>(std::ranges::upper_bound(cuts, message.order) - cuts.begin());
  };
  if (cuts.empty()) return 0;
  for (const TimedStream& stream : streams) {
    for (const RecordedTimes& message : stream.times) {
      TimeSpan& part = parts[part_of(message)];
      part.begin_ns = std::min(part.begin_ns, message.log_ns);
      part.end_ns = std::max(part.end_ns, message.log_ns);
    }
  }
  std::vector<std::int64_t> shifts_ns(1, 0);
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::int64_t begin_ns = add_wrapping(parts[i - 1].end_ns, shifts_ns[i - 1]);
    shifts_ns.push_back(add_wrapping(begin_ns, 2 * clock_second_ns - parts[i].begin_ns));
  }
  for (TimedStream& stream : streams) {
    for (RecordedTimes& message : stream.times)
      message.log_ns = add_wrapping(message.log_ns, shifts_ns[part_of(message)]);
  }
  return cuts.size();
}

/// Messages of a stream between restarts of its clock.
struct ClockPart {
  std::size_t begin = 0;
  std::size_t end = 0;
  TimeSpan stamps;
  TimeSpan log;
  std::int64_t delay_ns = 0;  ///< smallest log time minus stamp
};

std::vector<ClockPart> split_at_restarts(const MessageTimes& times) {
  std::vector<std::size_t> begins = find_restarts(times, &RecordedTimes::stamp_ns);
  begins.insert(begins.begin(), 0);
  std::vector<ClockPart> parts;
  for (std::size_t i = 0; i < begins.size(); ++i) {
    ClockPart part{begins[i], i + 1 < begins.size() ? begins[i + 1] : times.size(), {}, {}, 0};
    part.stamps = span_of(times, &RecordedTimes::stamp_ns, part.begin, part.end);
    part.log = span_of(times, &RecordedTimes::log_ns, part.begin, part.end);
    part.delay_ns = std::numeric_limits<std::int64_t>::max();
    for (std::size_t k = part.begin; k < part.end; ++k)
      part.delay_ns = std::min(part.delay_ns, add_wrapping(times[k].log_ns, -times[k].stamp_ns));
    parts.push_back(part);
  }
  return parts;
}

/// True if the delays are the same within a second, or if neither stream restarts and the stamps
/// overlap, as those of a slow connection do.
bool has_same_clock(const ClockPart& part, const ClockPart& images, bool restarts) {
  const std::int64_t difference_ns = add_wrapping(part.delay_ns, -images.delay_ns);
  if (difference_ns >= -tolerance_ns && difference_ns <= tolerance_ns) return true;
  if (overlap_ns(part.log, images.log) < 0) return true;  // nothing shows another clock
  return !restarts && overlap_ns(part.stamps, images.stamps) >= -tolerance_ns;
}

}  // namespace

std::uint64_t storage_order(const MessageLocation& location) {
  return (std::uint64_t{location.file} << 56U) ^ (location.block << 32U) ^ location.offset;
}

std::vector<std::string> unify_clocks(std::vector<TimedStream>& streams, bool use_log_times) {
  for (TimedStream& stream : streams)
    std::ranges::stable_sort(stream.times, {}, &RecordedTimes::order);
  limit_times(streams);
  std::size_t restarts = continue_log_times(streams);
  limit_times(streams);
  std::vector<std::string> warnings;
  if (use_log_times) {
    for (TimedStream& stream : streams)
      for (RecordedTimes& message : stream.times) message.stamp_ns = message.log_ns;
  } else {
    const std::vector<ClockPart> images = split_at_restarts(streams.front().times);
    restarts = std::max(restarts, images.size() - 1);
    for (TimedStream& stream : streams) {
      if (stream.times.empty()) continue;
      const std::vector<ClockPart> parts = split_at_restarts(stream.times);
      bool is_other_clock = false;
      for (const ClockPart& part : parts) {
        const auto nearest = std::ranges::max_element(
            images, {}, [&](const ClockPart& each) { return overlap_ns(each.log, part.log); });
        const bool is_same = has_same_clock(part, *nearest, parts.size() + images.size() > 2);
        is_other_clock = is_other_clock || !is_same;
        const std::int64_t shift_ns =
            add_wrapping(is_same ? nearest->delay_ns : part.delay_ns, -images.front().delay_ns);
        for (std::size_t i = part.begin; i < part.end; ++i)
          stream.times[i].stamp_ns = add_wrapping(stream.times[i].stamp_ns, shift_ns);
      }
      if (is_other_clock) {
        warnings.push_back("the stamps of the " + stream.name +
                           " are of another clock than those of the images; the times of "
                           "recording are used to match them");
      }
    }
  }
  limit_times(streams);
  if (restarts > 0) {
    warnings.push_back("the clock of the images restarts " + format_count(restarts, "time") +
                       "; the parts follow each other, with stamps that continue those of the "
                       "first");
  }
  return warnings;
}

}  // namespace panonav::recordings
