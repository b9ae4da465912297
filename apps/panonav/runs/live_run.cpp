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
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"

namespace panonav::command {

namespace {

/// Prints lines on a thread of its own, so that a slow reader does not delay the robot: beyond
/// `max_waiting` lines the oldest are dropped and counted.
class LinePrinter {
 public:
  LinePrinter(Session& session, bool wait)
      : session_(session), wait_(wait), thread_([this] { print_lines(); }) {}
  ~LinePrinter() { drain_and_join(); }
  LinePrinter(const LinePrinter&) = delete;
  LinePrinter& operator=(const LinePrinter&) = delete;

  void print(std::string line) {
    std::unique_lock lock(mutex_);
    if (wait_) printed_.wait(lock, [this] { return lines_.size() < max_waiting; });
    if (lines_.size() == max_waiting) {
      lines_.pop_front();
      ++left_out_;
    }
    lines_.push_back(std::move(line));
    came_.notify_one();
  }
  void drain_and_join() {
    if (!thread_.joinable()) return;
    {
      const std::lock_guard lock(mutex_);
      over_ = true;
    }
    came_.notify_one();
    thread_.join();
  }
  [[nodiscard]] std::size_t left_out() const noexcept { return left_out_; }

 private:
  void print_lines() {
    std::unique_lock lock(mutex_);
    while (true) {
      came_.wait(lock, [this] { return over_ || !lines_.empty(); });
      if (lines_.empty()) return;
      const std::string line = std::move(lines_.front());
      lines_.pop_front();
      lock.unlock();
      session_.print(line);
      if (!wait_) session_.flush();
      lock.lock();
      printed_.notify_one();
    }
  }

  static constexpr std::size_t max_waiting = 256;
  Session& session_;
  bool wait_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::condition_variable printed_;
  std::deque<std::string> lines_;
  std::size_t left_out_ = 0;
  bool over_ = false;
  std::thread thread_;
};

/// Says why pictures are skipped: of the first at once, of those after it at most a line a second.
class SkipNotes {
 public:
  explicit SkipNotes(Session& session) : session_(session) {}
  void add(const std::string& why) {
    ++unreported_;
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::seconds(1);
    session_.note(
        "skipped: " + (unreported_ > 1 ? std::to_string(unreported_) + " images, the last: " : "") +
        to_readable_line(why));
    unreported_ = 0;
  }

 private:
  Session& session_;
  std::size_t unreported_ = 0;
  std::chrono::steady_clock::time_point next_;
};

/// Chooses pictures as `select_pictures` does, but one by one.
class LiveSelection {
 public:
  explicit LiveSelection(const Dataset::Selection& selection) : selection_(selection) {}
  [[nodiscard]] bool should_take(double stamp_s) {
    if (!first_s_) first_s_ = stamp_s;
    if (selection_.from_s && stamp_s - *first_s_ < *selection_.from_s) return false;
    if (number_++ % static_cast<std::size_t>(selection_.every) != 0) return false;
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
  std::size_t number_ = 0;
};

double to_milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

}  // namespace

void declare_live(Arguments& arguments, LiveArguments& live) {
  arguments.option("--count N", live.count, 1, "Stop after N images");
  arguments.option("--camera-width", live.camera_width, 1,
                   "Image width that the camera should use");
  arguments.option("--camera-height", live.camera_height, 1,
                   "Image height that the camera should use");
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
  const auto stated = picture_source(pictures);
  if (!stated && !remembered) {
    throw UsageError("set --kind to the type of the images of " + input);
  }
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
  const auto add = [&text](std::uint64_t count, const std::string& what) {
    if (count > 0) text += ", " + std::to_string(count) + " " + what;
  };
  add(counts.skipped + counts.source.damaged, "could not be read");
  add(counts.source.dropped, "were skipped because they came too fast");
  add(counts.source.interruptions, "interruptions of the source");
  add(counts.lines_left_out, "lines were not printed because the reader was too slow");
  add(moments_left_out, "moments were not recorded because the disk was too slow");
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
    // A note would flush the lines first, and so wait for a reader that has stalled.
    if (live != nullptr) tied = std::cerr.tie(nullptr);
  }
  ~Implementation() {
    if (live != nullptr) std::cerr.tie(tied);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void add_delay() {
    constexpr std::size_t max_kept = 100'000;
    if (counts.delays_ms.size() < max_kept) {
      counts.delays_ms.push_back(0.0);
      counts.decoding_ms.push_back(0.0);
    }
    const std::size_t at = delays++ % max_kept;
    const recordings::LiveObservations::Timing timing = live->timing();
    counts.delays_ms[at] = to_milliseconds(std::chrono::steady_clock::now() - timing.arrived);
    counts.decoding_ms[at] = to_milliseconds(timing.decoding);
  }

  ObservationSource& source;
  recordings::LiveObservations* live;  // null: no live source
  LiveSelection selection;
  std::optional<int> count;
  Session& session;
  LiveCounts counts;
  std::size_t delays = 0;
  LinePrinter printer;
  std::ostream* tied = nullptr;  // what the stream of notes flushed before
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
    if (self.live != nullptr) self.add_delay();
    if (!line.empty()) self.printer.print(std::move(line));
    keep(std::move(*observation));
  }
  if (self.live != nullptr) self.live->live().stop();  // what comes from now on is not dropped
}

std::optional<double> LiveRun::decoding_ms() const {
  if (implementation_->live == nullptr) return std::nullopt;
  return to_milliseconds(implementation_->live->timing().decoding);
}

const LiveCounts& LiveRun::finish() {
  auto& self = *implementation_;
  self.printer.drain_and_join();
  self.counts.lines_left_out = self.printer.left_out();
  if (self.live != nullptr) self.counts.source = self.live->live().counts();
  return self.counts;
}

}  // namespace panonav::command
