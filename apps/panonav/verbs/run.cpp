#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/pipeline/live_memory.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/run_recorder.hpp"
#include "verbs/localised_query.hpp"
#include "verbs/memorising.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct RunArguments {
  std::string source;
  std::string memory;
  PictureArguments pictures;
  bool learn = false;
  std::optional<double> learn_interval_s;
  std::optional<int> camera_width;
  std::optional<int> camera_height;
  std::optional<int> count;
  std::optional<std::string> record;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
};

volatile std::sig_atomic_t signal_pipe = -1;  // what a handler may use is static

/// Calls `stop` on another thread when the user or the system asks the program to end; a second
/// time ends it at once.
class StopSignals {
 public:
  explicit StopSignals(std::function<void()> stop) : stop_(std::move(stop)) {
    if (pipe2(pipe_.data(), O_CLOEXEC) != 0) throw Error("no pipe can be made");
    signal_pipe = pipe_[1];
    struct sigaction action {};
    action.sa_handler = [](int) {
      const char asked = 's';
      (void)!write(signal_pipe, &asked, 1);
    };
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
    sigaction(SIGINT, &action, &interrupt_);
    sigaction(SIGTERM, &action, &terminate_);
    waiting_ = std::thread([this] {
      char asked = 0;
      while (read(pipe_[0], &asked, 1) < 0) {
      }
      if (asked == 's') stop_();
    });
  }
  ~StopSignals() {
    sigaction(SIGINT, &interrupt_, nullptr);
    sigaction(SIGTERM, &terminate_, nullptr);
    const char over = 'o';
    (void)!write(pipe_[1], &over, 1);
    waiting_.join();
    signal_pipe = -1;
    close(pipe_[0]);
    close(pipe_[1]);
  }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  std::function<void()> stop_;
  std::array<int, 2> pipe_{-1, -1};
  struct sigaction interrupt_ {};
  struct sigaction terminate_ {};
  std::thread waiting_;
};

/// Prints lines on a thread of its own. A reader that is slow does not hold up the robot: beyond
/// `max_waiting` lines the oldest are left out and counted.
class LinePrinter {
 public:
  LinePrinter(Session& session, bool wait)
      : session_(session), wait_(wait), thread_([this] { work(); }) {}
  ~LinePrinter() { finish(); }
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
  void finish() {
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
  void work() {
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

/// How the pictures lie that a new memory is made from, or as those of the memory.
PictureSource source_of(const RunArguments& wanted,
                        const std::optional<PictureSource>& remembered) {
  if (auto stated = picture_source(wanted.pictures)) return *stated;
  if (remembered) return *remembered;
  throw UsageError(wanted.memory + " is a new memory; say what the pictures show with --kind");
}

struct RunCounts {
  std::size_t pictures = 0;
  std::size_t known = 0;
  std::size_t skipped = 0;
  std::vector<double> delays_ms;
};

double now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string line_of(const Observation& seen, const LiveMemory::Answer& answer, Session& session) {
  const LocalisedQuery query{seen.name, 0.0, answer.place.value_or(Place{}), seen.pose, ""};
  if (!session.json()) {
    return (answer.place ? as_text(query, session) : query.file + "  no memory yet") +
           (answer.is_new ? "  learnt" : "");
  }
  auto json = as_json(query, false);
  json["stamp_s"] = or_null(seen.stamp_s);
  json["learnt"] = answer.is_new;
  return json_line(json);
}

/// Records what is seen and answered, in a live run as far as the disk keeps up.
class Recording {
 public:
  Recording(const std::string& file, std::string memory, bool wait, Session& session)
      : recorder_(file, {.wait = wait}), path_(std::move(memory)), session_(session) {}

  void add(const Observation& seen, const LiveMemory::Answer& answer, const LiveMemory& memory) {
    if (failed_) return;
    try {
      write(seen, answer, memory);
    } catch (const FileError& error) {
      failed_ = true;  // the robot goes on
      session_.note("the recording ends here: " + readable_line(error.what()));
    }
  }
  void close() {
    try {
      if (!failed_) recorder_.close();
    } catch (const FileError& error) {
      session_.note("the recording is cut short: " + readable_line(error.what()));
    }
  }
  [[nodiscard]] std::size_t left_out() const { return recorder_.left_out(); }

 private:
  void write(const Observation& seen, const LiveMemory::Answer& answer, const LiveMemory& memory) {
    RunMoment moment;
    moment.stamp_s = seen.stamp_s.value_or(static_cast<double>(moments_));
    ++moments_;
    if (const auto* const picture = std::get_if<Image>(&seen.picture)) moment.picture = *picture;
    moment.truth = seen.pose;
    const PlaceRecogniser* const recogniser = memory.recogniser();
    if (recogniser != nullptr) moment.panorama = recogniser->encoder().panorama(seen);
    if (answer.place) {
      describe(moment, *answer.place);
      if (!answer.place->matches.empty()) {
        moment.best_match = thumbnail(answer.place->matches.front().name);
      }
      // Rarely: the cloud is that of all views.
      if (memory.views() > references_ + references_ / 8) {
        references_ = memory.views();
        recorder_.add_references(recogniser->memory(), moment.stamp_s);
      }
    } else {
      moment.state = "no memory yet";
    }
    recorder_.add(std::move(moment));
  }
  /// By name: views that were just learnt have other ids in the file.
  std::vector<std::uint8_t> thumbnail(const std::string& name) {
    if (!file_) file_ = MemoryFile::open(path_, Access::read_only);
    const auto view = file_->find(name);
    const auto picture = view ? file_->thumbnail(*view) : std::nullopt;
    return picture.value_or(std::vector<std::uint8_t>{});
  }

  RunRecorder recorder_;
  std::string path_;
  Session& session_;
  std::optional<MemoryFile> file_;
  std::size_t moments_ = 0;
  std::size_t references_ = 0;
  bool failed_ = false;
};

void tell(const RunCounts& counts, const LiveMemory& memory, const LivePictures* live,
          std::size_t lines_left_out, std::size_t moments_left_out, const RunArguments& wanted,
          Session& session) {
  const LivePictures::Counts source = live != nullptr ? live->counts() : LivePictures::Counts{};
  std::string line = std::to_string(counts.pictures) + " pictures, " +
                     std::to_string(counts.known) + " of places of " + wanted.memory;
  if (wanted.learn) line += ", " + std::to_string(memory.learnt()) + " views learnt";
  const auto add = [&line](std::uint64_t count, const std::string& what) {
    if (count > 0) line += ", " + std::to_string(count) + " " + what;
  };
  add(counts.skipped + source.damaged, "could not be read");
  add(source.dropped, "came too fast and were dropped");
  add(source.interruptions, "interruptions of the source");
  add(lines_left_out, "lines were not printed for a slow reader");
  add(moments_left_out, "moments were not recorded on a slow disk");
  if (!counts.delays_ms.empty()) {
    line += "; from arrival to answer " + fixed(quantile(counts.delays_ms, 0.5), 1) +
            " ms median, " + fixed(quantile(counts.delays_ms, 0.99), 1) + " ms in 99 %";
  }
  session.note(line);
}

ExitCode run(const Arguments& arguments, const RunArguments& wanted, Session& session) {
  if (wanted.camera_width.has_value() != wanted.camera_height.has_value()) {
    throw UsageError("--camera-width and --camera-height go together");
  }
  const bool live = is_live(wanted.source);
  if (live) {
    arguments.refuse_unused({"--from", "--to", "--every", "--image-topic", "--odometry-topic",
                             "--odometry-frames", "--imu-topic"},
                            "where " + wanted.source + " is a live source");
  } else {
    arguments.refuse_unused({"--camera-width", "--camera-height"},
                            "where " + wanted.source + " is no live source");
  }
  std::optional<PictureSource> remembered;
  if (fs::exists(wanted.memory)) {
    const auto memory = MemoryFile::open(wanted.memory, Access::read_only);
    remembered = memory.header().source;
    require_kept_options(arguments, wanted.signature, wanted.preprocessing, memory);
  } else if (!wanted.learn) {
    throw FileError(wanted.memory, "no such file; --learn makes it");
  }
  std::unique_ptr<ObservationSource> source;
  LivePictures* pictures = nullptr;
  if (live) {
    LiveOptions options;
    if (wanted.camera_width) options.size = ImageSize{*wanted.camera_width, *wanted.camera_height};
    auto observations =
        std::make_unique<LiveObservations>(wanted.source, source_of(wanted, remembered), options);
    pictures = &observations->live();
    source = std::move(observations);
  } else {
    source = std::make_unique<DatasetObservations>(
        open_recording(wanted.source, wanted.pictures, remembered, session), session.executor());
  }
  LiveMemoryOptions options{.learn = wanted.learn,
                            .in_step = !live,
                            .memoriser = {.source = source->pictures(),
                                          .signature = wanted.signature,
                                          .preprocessing = wanted.preprocessing},
                            .localiser = {}};
  if (wanted.learn_interval_s) options.min_interval_s = *wanted.learn_interval_s;
  LiveMemory memory(wanted.memory, options);

  RunCounts counts;
  std::atomic<bool> stopped = false;
  LinePrinter printer(session, !live);
  std::optional<Recording> recording;
  if (wanted.record) recording.emplace(*wanted.record, wanted.memory, !live, session);
  {
    const StopSignals signals([&] {
      stopped = true;
      if (pictures != nullptr) pictures->stop();
    });
    const auto wanted_more = [&] {
      return !stopped &&
             (!wanted.count || counts.pictures < static_cast<std::size_t>(*wanted.count));
    };
    while (wanted_more()) {
      std::optional<Observation> seen;
      LiveMemory::Answer answer;
      try {
        seen = source->next();
        if (!seen) break;
        ++counts.pictures;
        answer = memory.answer(*seen);
      } catch (const Error& error) {
        ++counts.skipped;
        session.note("skipped: " + readable_line(error.what()));
        continue;
      }
      if (live) counts.delays_ms.push_back(1e3 * (now_s() - *seen->stamp_s));
      if (answer.place && answer.place->known) ++counts.known;
      printer.print(line_of(*seen, answer, session));
      if (recording) recording->add(*seen, answer, memory);
      if (answer.is_new) memory.learn(std::move(*seen));
    }
  }
  memory.finish();  // a reader of the lines may never go on
  if (recording) recording->close();
  printer.finish();
  tell(counts, memory, pictures, printer.left_out(), recording ? recording->left_out() : 0, wanted,
       session);
  return counts.pictures > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare_run(Arguments& arguments) {
  auto wanted = std::make_shared<RunArguments>();
  arguments.positional("SOURCE", wanted->source,
                       "Camera (/dev/video0), address (rtsp://, http://, tcp://), - for JPEG "
                       "pictures on standard input, or a recording");
  arguments.required_option("--memory FILE", wanted->memory, "Memory file (NAME.panonav)");
  arguments.flag("--learn", wanted->learn, "Add views of places that the memory does not know");
  arguments.option("--learn-interval-s", wanted->learn_interval_s,
                   "Time between two views that are added, at least; default 0.5");
  arguments.option("--count N", wanted->count, 1, "End after this many pictures");
  arguments.option("--record FILE", wanted->record,
                   "Write what is seen and answered as MCAP, for Rerun, Foxglove and Lichtblick");
  arguments.option("--camera-width", wanted->camera_width, 1,
                   "Wanted width of a camera's pictures");
  arguments.option("--camera-height", wanted->camera_height, 1,
                   "Wanted height of a camera's pictures");
  declare_pictures(arguments, wanted->pictures);
  arguments.options("signature", wanted->signature);
  arguments.options("preprocessing", wanted->preprocessing);
  arguments.uncommon({"--camera-width", "--camera-height"});
  arguments.used_only(
      {"--learn-interval-s"}, [wanted] { return wanted->learn; }, "without --learn");
  return [wanted, &arguments](Session& session) { return run(arguments, *wanted, session); };
}

}  // namespace

Verb run_verb() {
  return {"run", "Memorise and localise in one go on a live camera or a recording",
          "Tells for each picture whether its place is known and where it is. With --learn, views "
          "of places that the memory does not know are added; a new memory begins with 32 views. "
          "Of a live source the newest picture is taken and those between are dropped. Ends with "
          "the source, or on Ctrl-C with everything stored.",
          "  panonav run /dev/video0 --memory walk.panonav --learn --kind equirectangular\n"
          "  panonav run rtsp://192.0.2.7/live --memory walk.panonav --json\n"
          "  panonav run office_run --memory office.panonav --learn",
          declare_run};
}

}  // namespace panonav::command
