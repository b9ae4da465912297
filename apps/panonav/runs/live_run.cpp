#include "runs/live_run.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iostream>
#include <mutex>
#include <thread>
#include <utility>

#include "cli/stop_signals.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "runs/picture_layout.hpp"

namespace panonav::command {

namespace {

/// Prints lines on a separate thread. Without `wait`, a slow reader of the output does not delay
/// the robot: if more than `max_queued_lines` wait, the oldest are dropped and counted.
class LinePrinter {
 public:
  LinePrinter(Session& session, bool wait)
      : session_(session), waits_for_reader_(wait), thread_([this] { print_lines(); }) {}
  ~LinePrinter() { drain_and_join(); }
  LinePrinter(const LinePrinter&) = delete;
  LinePrinter& operator=(const LinePrinter&) = delete;

  void print(std::string line) {
    std::unique_lock lock(mutex_);
    if (waits_for_reader_) printed_.wait(lock, [this] { return lines_.size() < max_queued_lines; });
    if (lines_.size() == max_queued_lines) {
      lines_.pop_front();
      ++dropped_lines_;
    }
    lines_.push_back(std::move(line));
    line_added_.notify_one();
  }
  void drain_and_join() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      is_closing_ = true;
    }
    line_added_.notify_one();
    thread_.join();
  }
  [[nodiscard]] std::size_t dropped_line_count() const noexcept { return dropped_lines_; }

 private:
  void print_lines() {
    std::unique_lock lock(mutex_);
    while (true) {
      line_added_.wait(lock, [this] { return is_closing_ || !lines_.empty(); });
      if (lines_.empty()) return;
      const std::string line = std::move(lines_.front());
      lines_.pop_front();
      lock.unlock();
      session_.print(line);
      if (!waits_for_reader_) session_.flush();
      lock.lock();
      printed_.notify_one();
    }
  }

  static constexpr std::size_t max_queued_lines = 256;
  Session& session_;
  bool waits_for_reader_;
  std::mutex mutex_;
  std::condition_variable line_added_;
  std::condition_variable printed_;
  std::deque<std::string> lines_;
  std::size_t dropped_lines_ = 0;
  bool is_closing_ = false;
  std::thread thread_;
};

/// Prints why images are skipped: at once for the first, then at most one line per second.
class SkipNotes {
 public:
  explicit SkipNotes(Session& session) : session_(session) {}
  void add(const std::string& why) {
    ++unreported_;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    session_.note(
        "skipped: " + (unreported_ > 1 ? format_count(unreported_, "image") + ", the last: " : "") +
        to_readable_line(why));
    unreported_ = 0;
  }

 private:
  Session& session_;
  std::size_t unreported_ = 0;
  std::chrono::steady_clock::time_point next_;
};

/// Selects images one by one, as `select_pictures` does for a data set.
class LiveSelection {
 public:
  explicit LiveSelection(const Dataset::Selection& selection) : selection_(selection) {}
  [[nodiscard]] bool should_take(double stamp_s) {
    if (!first_s_) first_s_ = stamp_s;
    if (selection_.from_s && stamp_s - *first_s_ < *selection_.from_s) return false;
    if (image_count_++ % static_cast<std::size_t>(selection_.every) != 0) return false;
    const bool near = last_kept_s_ && stamp_s >= *last_kept_s_ && selection_.every_s &&
                      stamp_s - *last_kept_s_ < *selection_.every_s;
    if (!near) last_kept_s_ = stamp_s;
    return !near;
  }
  [[nodiscard]] bool is_past_end(double stamp_s) const {
    return selection_.to_s && first_s_ && stamp_s - *first_s_ > *selection_.to_s;
  }

 private:
  Dataset::Selection selection_;
  std::optional<double> first_s_;
  std::optional<double> last_kept_s_;
  std::size_t image_count_ = 0;
};

double to_milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

}  // namespace

void declare_live(Arguments& arguments, LiveArguments& live) {
  arguments.option("--count N", live.count, 1, "Stop after N images");
  arguments.option("--camera-width", live.camera_width, 1,
                   "Image width in pixels that is requested from the camera");
  arguments.option("--camera-height", live.camera_height, 1,
                   "Image height in pixels that is requested from the camera");
  arguments.hide_from_help({"--count", "--camera-width", "--camera-height"});
}

std::unique_ptr<recordings::LiveObservations> open_live(
    const Arguments& arguments, const std::string& input, const PictureArguments& pictures,
    const std::optional<PictureSource>& remembered, const LiveArguments& live, Session& session) {
  arguments.reject_options(
      {"--image-topic", "--odometry-topic", "--odometry-frames", "--imu-topic", "--recursive"},
      "where " + input + " is a live source");
  if (live.camera_width.has_value() != live.camera_height.has_value()) {
    throw UsageError("--camera-width and --camera-height must be used together");
  }
  const auto stated = make_picture_source(pictures, session);
  if (!stated && !remembered) {
    throw UsageError("set --kind to the type of the images of " + input);
  }
  if (!remembered) note_default_band(*stated, elevation_flag, session);
  if (stated && remembered) note_other_camera(*stated, *remembered, input, session);
  recordings::LiveOptions options;
  options.note = [&session](const std::string& line) { session.note(line); };
  if (live.camera_width) options.size = ImageSize{*live.camera_width, *live.camera_height};
  return std::make_unique<recordings::LiveObservations>(input, stated ? *stated : *remembered,
                                                        options);
}

void reject_live_options(const Arguments& arguments, const std::string& input, bool count) {
  const std::string why = "where " + input + " is not a live source";
  arguments.reject_options({"--camera-width", "--camera-height"}, why);
  if (count) arguments.reject_options({"--count"}, why);
}

std::string describe_events(const LiveCounts& counts, std::size_t moments_left_out) {
  std::string text;
  const auto add = [&text](std::uint64_t count, std::string_view noun, std::string_view what) {
    if (count > 0) text.append(", ").append(format_count(count, noun)).append(what);
  };
  const std::uint64_t unread = counts.skipped + counts.source.damaged;
  if (unread > 0) text += ", " + std::to_string(unread) + " could not be read";
  add(counts.source.dropped, "image", " skipped because of too fast a rate");
  add(counts.source.interruptions, "interruption", " of the source");
  add(counts.dropped_line_count, "line", " not printed because the reader was too slow");
  add(moments_left_out, "moment", " not recorded because the disk was too slow");
  if (!counts.delays_ms.empty()) {
    text += "; from arrival to answer " + format_fixed(quantile(counts.delays_ms, 0.5), 1) +
            " ms median (decoding " + format_fixed(quantile(counts.decoding_ms, 0.5), 1) + "), " +
            format_fixed(quantile(counts.delays_ms, 0.99), 1) + " ms in 99 %";
  }
  return text;
}

struct LiveRun::Implementation {
  Implementation(ObservationSource& from, const PartArguments& part, const LiveArguments& arguments,
                 Session& its_session)
      : source(from),
        live(dynamic_cast<recordings::LiveObservations*>(&from)),
        selection(to_selection(part)),
        count(arguments.count),
        session(its_session),
        printer(session, live == nullptr) {
    // Unties standard error from standard output: otherwise each note would flush the output first
    // and wait for a stalled reader.
    if (live != nullptr) previously_tied = std::cerr.tie(nullptr);
  }
  ~Implementation() {
    if (live != nullptr) std::cerr.tie(previously_tied);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void store_delay() {
    constexpr std::size_t max_stored_delays = 100'000;
    if (counts.delays_ms.size() < max_stored_delays) {
      counts.delays_ms.push_back(0.0);
      counts.decoding_ms.push_back(0.0);
    }
    const std::size_t at = delay_count++ % max_stored_delays;
    const recordings::LiveObservations::Timing timing = live->timing();
    counts.delays_ms[at] = to_milliseconds(std::chrono::steady_clock::now() - timing.arrived);
    counts.decoding_ms[at] = to_milliseconds(timing.decoding);
  }

  ObservationSource& source;
  recordings::LiveObservations* live;  // null: the source is not live
  LiveSelection selection;
  std::optional<int> count;
  Session& session;
  LiveCounts counts;
  std::size_t delay_count = 0;
  LinePrinter printer;
  std::ostream* previously_tied = nullptr;  // stream to which std::cerr was tied
};

LiveRun::LiveRun(ObservationSource& source, const PartArguments& part, const LiveArguments& live,
                 Session& session)
    : implementation_(std::make_unique<Implementation>(source, part, live, session)) {}
LiveRun::~LiveRun() = default;

void LiveRun::run(const std::function<std::string(const Observation&)>& answer,
                  const std::function<void(Observation&&)>& keep, const Skip& skip) {
  auto& self = *implementation_;
  LiveCounts& counts = self.counts;
  std::atomic<bool> stopped = false;
  const StopSignals signals([&] {
    stopped = true;
    if (self.live != nullptr) self.live->live().stop();
  });
  SkipNotes notes(self.session);
  while (!stopped && (!self.count || counts.pictures < static_cast<std::size_t>(*self.count))) {
    std::optional<Observation> observation;
    std::string line;
    try {
      observation = self.source.next();
      if (!observation) break;
      if (self.live != nullptr) {
        if (self.selection.is_past_end(*observation->stamp_s)) break;
        if (!self.selection.should_take(*observation->stamp_s)) continue;
      }
      ++counts.pictures;
      line = answer(*observation);
    } catch (const Error& error) {
      ++counts.skipped;
      notes.add(error.what());
      if (skip) line = skip(observation ? &*observation : nullptr, error);
      if (!line.empty()) self.printer.print(std::move(line));
      continue;
    }
    if (self.live != nullptr) self.store_delay();
    if (!line.empty()) self.printer.print(std::move(line));
    keep(std::move(*observation));
  }
  if (self.live != nullptr) self.live->live().stop();  // later images do not count as dropped
}

std::optional<double> LiveRun::decoding_ms() const {
  if (implementation_->live == nullptr) return std::nullopt;
  return to_milliseconds(implementation_->live->timing().decoding);
}

const LiveCounts& LiveRun::finish() {
  auto& self = *implementation_;
  self.printer.drain_and_join();
  self.counts.dropped_line_count = self.printer.dropped_line_count();
  if (self.live != nullptr) self.counts.source = self.live->live().counts();
  return self.counts;
}

}  // namespace panonav::command
