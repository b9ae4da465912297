#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/pipeline/live_memory.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_address.hpp"
#include "verbs/live_run.hpp"
#include "verbs/localised_query.hpp"
#include "verbs/memorising.hpp"
#include "verbs/recording.hpp"
#include "verbs/run_record.hpp"
#include "verbs/shown_references.hpp"
#include "verbs/tracked_run.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

struct RunArguments {
  std::string source;
  std::string memory;
  PictureArguments pictures;
  bool learn = false;
  std::optional<double> learn_interval_s;
  LiveArguments live;
  RunRecordArguments record;
  std::optional<std::string> route;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
  MemoryUpdateOptions update;
};

/// Whose poses the lines of a route get.
enum class RoutePoses { known, odometry, pictures };

/// Remembers a route beside the views that are learnt, from the moment on when there is a memory.
class RunRouteRecorder {
 public:
  RunRouteRecorder(std::string memory, PictureSource pictures, std::string name, RoutePoses poses)
      : memory_(std::move(memory)), pictures_(std::move(pictures)), poses_(poses) {
    options_.name = std::move(name);
    options_.odometry = poses != RoutePoses::known;
  }

  void add(Observation seen, const LiveMemory& memory) {
    const PlaceRecogniser* const recogniser = memory.recogniser();
    if (recogniser == nullptr) return;
    if (!recorder_) {
      recorder_.emplace(MemoryFile::open(memory_, Access::read_write), pictures_, options_);
    }
    if (poses_ == RoutePoses::pictures) {
      if (!odometry_) odometry_.emplace(visual_odometry(recogniser->memory()));
      odometry_->add(OdometryView(recogniser->encoder().signature(seen)));
      seen.odometry = odometry_->pose();
    }
    if (recorder_->add(seen)) ++lines_;
  }
  /// Lines that were recorded.
  std::size_t finish() {
    if (lines_ > 0) (void)recorder_->finish();
    return lines_;
  }

 private:
  std::string memory_;
  PictureSource pictures_;
  RoutePoses poses_;
  RouteRecorderOptions options_;
  std::optional<RouteRecorder> recorder_;
  std::optional<VisualOdometry> odometry_;
  std::size_t lines_ = 0;
};

ordered_json as_json(const RouteStep& step) {
  if (!step.fix) return {{"on_route", false}};
  return {{"on_route", true},
          {"pose", pose_json(step.fix->pose)},
          {"along_m", step.fix->along_m},
          {"lateral_m", step.fix->lateral_m},
          {"correlation", step.fix->correlation}};
}

std::string as_text(const RouteStep& step, Session& session) {
  if (!step.fix) return session.bad("not on the route");
  return session.good("on the route") + ", along " + format_fixed(step.fix->along_m, 2) +
         " m  beside " + format_fixed(step.fix->lateral_m, 2) + " m";
}

std::string line_of(const Observation& seen, const LiveMemory::Answer& answer,
                    const std::optional<RouteStep>& step, Session& session) {
  const LocalisedQuery query{seen.name, 0.0, answer.place.value_or(Place{}), seen.pose, ""};
  if (!session.json()) {
    return (answer.place ? as_text(query, session) : query.file + "  no memory yet") +
           (answer.is_new ? "  learnt" : "") + (step ? "  " + as_text(*step, session) : "");
  }
  auto json = as_json(query, false);
  json["stamp_s"] = or_null(seen.stamp_s);
  json["learnt"] = answer.is_new;
  if (step) json["route"] = as_json(*step);
  return json_line(json);
}

/// What a record needs of a run.
class RunMoments {
 public:
  RunMoments(const LiveMemory& memory, std::string path)
      : memory_(memory), path_(std::move(path)) {}

  recordings::RunMoment of(const Observation& seen, const LiveMemory::Answer& answer,
                           const RunRecord& record, StageClock& stages) {
    recordings::RunMoment moment = record.moment_of(seen, number_++);
    stages.put(moment);
    const PlaceRecogniser* const recogniser = memory_.recogniser();
    if (record.wants_pictures()) moment.panorama = memory_.panorama();
    if (!answer.place) {
      moment.state = "no memory yet";
      return moment;
    }
    describe(moment, *answer.place);
    StageClock clock;
    if (!file_) file_ = MemoryFile::open(path_, Access::read_only);
    if (record.wants_pictures()) moment.best_match = best_match_of(*answer.place, *file_);
    // Rarely: the cloud is that of all views. A memory that was read anew has other ids.
    if (memory_.views() > references_ + references_ / 8 || recogniser != shown_of_) {
      references_ = memory_.views();
      shown_of_ = recogniser;
      shown_.emplace(recogniser->memory());
      shown_->put(moment);
    }
    if (moment.panorama) {
      shown_->compare(moment, recogniser->memory(), recogniser->encoder().packed(*moment.panorama));
      clock.stage("for viewers");
      clock.put(moment);
    }
    return moment;
  }

 private:
  const LiveMemory& memory_;
  std::string path_;
  std::optional<MemoryFile> file_;  // there is none before a new memory's first views
  std::size_t number_ = 0;
  std::size_t references_ = 0;  // that are in the record
  std::optional<ShownReferences> shown_;
  const PlaceRecogniser* shown_of_ = nullptr;
};

RoutePoses route_poses(const Dataset& recording) {
  const auto all = [&](const auto& has) { return std::ranges::all_of(recording.entries, has); };
  if (all([](const DatasetEntry& e) { return e.pose && e.pose->heading_rad; })) {
    return RoutePoses::known;
  }
  return all([](const DatasetEntry& e) { return e.odometry.has_value(); }) ? RoutePoses::odometry
                                                                           : RoutePoses::pictures;
}

/// Motion that is read from pictures begins anew each time, and so does the frame of its poses.
void refuse_to_go_on(const RunArguments& wanted, RoutePoses poses) {
  if (poses != RoutePoses::pictures || !memory_exists(wanted.memory)) return;
  if (!MemoryFile::open(wanted.memory, Access::read_only).route(*wanted.route)) return;
  throw UsageError("--route is " + *wanted.route + ", which " + wanted.memory +
                   " holds already; allowed without odometry: a new name");
}

/// Where the pictures of a run come from.
struct RunSource {
  std::unique_ptr<ObservationSource> observations;
  RoutePoses poses = RoutePoses::pictures;  ///< by what a route is recorded
};

/// Opens the source as the memory's pictures lie, where there is a memory. Throws FileError where
/// there is none and nothing is learnt.
RunSource open_source(const Arguments& arguments, const RunArguments& wanted, bool is_live,
                      Session& session) {
  std::optional<PictureSource> remembered;
  if (memory_exists(wanted.memory)) {
    const auto memory = MemoryFile::open(wanted.memory, Access::read_only);
    remembered = memory.header().source;
    require_kept_options(arguments, wanted.signature, wanted.preprocessing, memory);
  } else if (!wanted.learn) {
    throw FileError(wanted.memory, "no such file; --learn makes it");
  }
  if (is_live) {
    return {open_live(arguments, wanted.source, wanted.pictures, remembered, wanted.live)};
  }
  Dataset recording = open_recording(wanted.source, wanted.pictures, remembered, session);
  const RoutePoses poses = route_poses(recording);
  return {std::make_unique<DatasetObservations>(std::move(recording), session.executor()), poses};
}

LiveMemoryOptions memory_options(const RunArguments& wanted, const PictureSource& pictures,
                                 bool is_live) {
  LiveMemoryOptions options{.learn = wanted.learn,
                            .update = wanted.update,
                            .in_step = !is_live,
                            .memoriser = {.source = pictures,
                                          .signature = wanted.signature,
                                          .preprocessing = wanted.preprocessing},
                            .localiser = {},
                            .hold = wanted.record.file || wanted.record.view};
  if (wanted.learn_interval_s) options.min_interval_s = *wanted.learn_interval_s;
  return options;
}

ExitCode run(const Arguments& arguments, const RunArguments& wanted, Session& session) {
  const bool live = recordings::is_live(wanted.source);
  if (!live) refuse_live(arguments, wanted.source, false);
  const auto [source, poses] = open_source(arguments, wanted, live, session);
  std::optional<RouteFollower> follower;
  std::optional<RunRouteRecorder> route;
  if (wanted.route && wanted.learn) {
    refuse_to_go_on(wanted, poses);
    route.emplace(wanted.memory, source->pictures(), *wanted.route, poses);
  } else if (wanted.route) {
    follower.emplace(MemoryFile::open(wanted.memory, Access::read_only), source->pictures(),
                     RouteFollowerOptions{.name = wanted.route, .tracker = {}, .fit = {}});
  }
  LiveMemory memory(wanted.memory, memory_options(wanted, source->pictures(), live));
  RunRecord record(wanted.record, std::array{wanted.source, wanted.memory}, live, session,
                   {.memory = wanted.memory});
  RunMoments moments(memory, wanted.memory);
  std::size_t known = 0;
  std::chrono::duration<double, std::milli> unwrapping{};
  LiveMemory::Answer answer;
  std::optional<RouteStep> step;
  StageClock stages;
  LiveRun taking(*source, wanted.pictures.part, wanted.live, session);
  taking.take(
      [&](const Observation& seen) {
        stages = StageClock();
        if (const auto ms = taking.decoding_ms()) stages.add("reading", *ms);
        answer = memory.answer(seen);
        stages.part("unwarping", answer.unwrapping);
        stages.stage("signature, search, ranking");
        if (answer.place && answer.place->known) ++known;
        unwrapping += answer.unwrapping;
        if (follower) {
          step = follower->step(seen);
          stages.stage("route");
        }
        return line_of(seen, answer, step, session);
      },
      [&](Observation&& seen) {
        if (route) route->add(seen, memory);
        if (record.wanted()) record.add(moments.of(seen, answer, record, stages));
        if (answer.is_new) memory.learn(std::move(seen));
      });
  // A reader of the lines may never go on.
  const auto changes = memory.finish("learn from " + wanted.source);
  const std::size_t lines = route ? route->finish() : 0;
  record.close();
  const LiveCounts& counts = taking.finish();
  const auto asked = static_cast<double>(counts.pictures);
  session.note(
      std::to_string(counts.pictures) + " pictures, " + std::to_string(known) + " of places of " +
      wanted.memory +
      (wanted.learn ? ", " + std::to_string(memory.learnt()) + " views learnt" : "") +
      (changes ? ", " + as_text(*changes) : "") +
      (route ? ", " + std::to_string(lines) + " lines of the route" : "") +
      events_text(counts, record.left_out()) +
      (live ? ", unwrapping " + format_fixed(unwrapping.count() / std::max(1.0, asked), 1) + " ms"
            : ""));
  return counts.pictures > 0 ? ExitCode::done : ExitCode::no_answer;
}

Run declare_run(Arguments& arguments) {
  auto wanted = std::make_shared<RunArguments>();
  arguments.positional("SOURCE", wanted->source,
                       "Camera (/dev/video0), address (rtsp://, http://, tcp://), - for JPEG "
                       "pictures on standard input, or a recording");
  arguments.required_option("--memory FILE", wanted->memory, "Memory file (NAME.panonav)");
  arguments.flag("--learn", wanted->learn,
                 "Add views of places that the memory does not know, and keep those of known ones "
                 "true");
  arguments.option("--learn-interval-s", wanted->learn_interval_s,
                   "Time between two views that are added, at least; default 0.5");
  declare_record(arguments, wanted->record);
  declare_view(arguments, wanted->record);
  arguments.option("--route NAME", wanted->route,
                   "Follow this route of the memory; with --learn record it, a line each 0.1 m");
  declare_live(arguments, wanted->live);
  declare_pictures(arguments, wanted->pictures);
  arguments.options("signature", wanted->signature);
  arguments.options("preprocessing", wanted->preprocessing);
  arguments.options("learning", wanted->update);
  arguments.common({"--count"});
  arguments.used_only(
      {"--learn-interval-s", "[learning]"}, [wanted] { return wanted->learn; }, "without --learn");
  return [wanted, &arguments](Session& session) { return run(arguments, *wanted, session); };
}

}  // namespace

Verb run_verb() {
  return {
      "run", "Memorise and localise in one go on a live camera or a recording",
      "Tells for each picture whether its place is known and where it is. With --learn, views "
      "of places that the memory does not know are added; a new memory begins with 32 views. "
      "Where pictures have odometry and views positions, views of known places are kept true: "
      "other "
      "appearances of a place are added, up to --appearances, and what keeps failing is replaced "
      "(panonav history, panonav undo). "
      "Of a live source the newest picture is taken and those between are dropped. --route tells "
      "where the robot is beside a recorded route, or records one with the poses of the "
      "recording, its odometry, or motion read from the pictures. Ends with the source, or on "
      "Ctrl-C with everything stored.",
      "  panonav run /dev/video0 --memory walk.panonav --learn --kind equirectangular\n"
      "  panonav run rtsp://192.0.2.7/live --memory walk.panonav --json\n"
      "  panonav run office_run --memory office.panonav --learn",
      declare_run};
}

}  // namespace panonav::command
