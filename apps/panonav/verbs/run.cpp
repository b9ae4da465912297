#include <array>
#include <filesystem>
#include <memory>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/pipeline/live_memory.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "verbs/live_run.hpp"
#include "verbs/localised_query.hpp"
#include "verbs/memorising.hpp"
#include "verbs/recording.hpp"
#include "verbs/run_record.hpp"

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
  std::optional<std::string> record;
  SignatureOptions signature;
  PreprocessingOptions preprocessing;
};

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

/// What a record needs of a run.
class RunMoments {
 public:
  RunMoments(const LiveMemory& memory, std::string path)
      : memory_(memory), path_(std::move(path)) {}

  RunMoment of(const Observation& seen, const LiveMemory::Answer& answer) {
    RunMoment moment = moment_of(seen, number_++);
    const PlaceRecogniser* const recogniser = memory_.recogniser();
    if (recogniser != nullptr) moment.panorama = recogniser->encoder().panorama(seen);
    if (!answer.place) {
      moment.state = "no memory yet";
      return moment;
    }
    describe(moment, *answer.place);
    if (!file_) file_ = MemoryFile::open(path_, Access::read_only);
    moment.best_match = best_match_of(*answer.place, *file_);
    // Rarely: the cloud is that of all views.
    if (memory_.views() > references_ + references_ / 8) {
      references_ = memory_.views();
      moment.references = reference_positions(recogniser->memory());
    }
    return moment;
  }

 private:
  const LiveMemory& memory_;
  std::string path_;
  std::optional<MemoryFile> file_;  // there is none before a new memory's first views
  std::size_t number_ = 0;
  std::size_t references_ = 0;  // that are in the record
};

ExitCode run(const Arguments& arguments, const RunArguments& wanted, Session& session) {
  const bool live = is_live(wanted.source);
  if (!live) refuse_live(arguments, wanted.source, false);
  std::optional<PictureSource> remembered;
  if (fs::exists(wanted.memory)) {
    const auto memory = MemoryFile::open(wanted.memory, Access::read_only);
    remembered = memory.header().source;
    require_kept_options(arguments, wanted.signature, wanted.preprocessing, memory);
  } else if (!wanted.learn) {
    throw FileError(wanted.memory, "no such file; --learn makes it");
  }
  std::unique_ptr<ObservationSource> source;
  if (live) {
    source = open_live(arguments, wanted.source, wanted.pictures, remembered, wanted.live);
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
  RunRecord record(wanted.record, std::array{wanted.source, wanted.memory}, live, session);
  RunMoments moments(memory, wanted.memory);
  std::size_t known = 0;
  LiveMemory::Answer answer;
  LiveRun taking(*source, wanted.pictures.part, wanted.live, session);
  taking.take(
      [&](const Observation& seen) {
        answer = memory.answer(seen);
        if (answer.place && answer.place->known) ++known;
        return line_of(seen, answer, session);
      },
      [&](Observation&& seen) {
        if (record.wanted()) record.add(moments.of(seen, answer));
        if (answer.is_new) memory.learn(std::move(seen));
      });
  memory.finish();  // a reader of the lines may never go on
  record.close();
  const LiveCounts& counts = taking.finish();
  session.note(std::to_string(counts.pictures) + " pictures, " + std::to_string(known) +
               " of places of " + wanted.memory +
               (wanted.learn ? ", " + std::to_string(memory.learnt()) + " views learnt" : "") +
               events_text(counts, record.left_out()));
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
  declare_record(arguments, wanted->record);
  declare_live(arguments, wanted->live);
  declare_pictures(arguments, wanted->pictures);
  arguments.options("signature", wanted->signature);
  arguments.options("preprocessing", wanted->preprocessing);
  arguments.common({"--count"});
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
