#include "runs/localised_run.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <utility>

#include "cli/json.hpp"
#include "panonav/core/address.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/gpano.hpp"
#include "panonav/io/rig_pictures.hpp"
#include "panonav/mapping/visual_odometry.hpp"
#include "panonav/pipeline/live_memory.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/pipeline/route_follower.hpp"
#include "panonav/pipeline/route_recorder.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/pipeline/visual_motion.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav_recordings/recording.hpp"
#include "reports/localise_report.hpp"
#include "reports/report_page.hpp"
#include "runs/localised_query.hpp"
#include "runs/memorising.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

namespace {

/// Source of the poses of a route's lines.
enum class RoutePoses { known, odometry, images };

/// Records a route while views are added; begins when the memory has its first views.
class RunRouteRecorder {
 public:
  RunRouteRecorder(std::string memory, PictureSource source, std::string name, RoutePoses poses)
      : memory_(std::move(memory)), source_(std::move(source)), poses_(poses) {
    options_.name = std::move(name);
    options_.odometry = poses != RoutePoses::known;
  }

  void add(Observation observation, const LiveMemory& memory) {
    const PlaceRecogniser* const recogniser = memory.recogniser();
    if (recogniser == nullptr) return;
    if (!recorder_) {
      auto file = MemoryFile::open(memory_, Access::read_write);
      if (poses_ == RoutePoses::images) {
        options_.is_in_map_unit = has_positions_from_map(file);
        if (read_length_unit(file) == LengthUnit::view_steps) {
          options_.assumed_unit_m = read_assumed_unit_m(file);
        }
      }
      recorder_.emplace(std::move(file), source_, options_);
    }
    if (poses_ == RoutePoses::images) {
      if (!odometry_) odometry_.emplace(visual_odometry(recogniser->memory()));
      odometry_->add(OdometryView(recogniser->encoder().signature(observation)));
      observation.odometry = odometry_->pose();
    }
    if (recorder_->add(observation)) ++lines_;
  }
  /// Returns the number of lines that were recorded.
  std::size_t finish() {
    if (lines_ > 0) (void)recorder_->finish();
    return lines_;
  }

 private:
  std::string memory_;
  PictureSource source_;
  RoutePoses poses_;
  RouteRecorderOptions options_;
  std::optional<RouteRecorder> recorder_;
  std::optional<VisualOdometry> odometry_;
  std::size_t lines_ = 0;
};

/// Chooses poses that half of the images have, as `find_drive_poses` does.
RoutePoses choose_route_poses(const Dataset& recording) {
  const auto& entries = recording.entries;
  const auto known = 10 * std::ranges::count_if(entries, [](const DatasetEntry& e) {
                       return e.pose && e.pose->heading_rad;
                     });
  const auto moved = 10 * std::ranges::count_if(entries, [](const DatasetEntry& e) {
                       return e.odometry.has_value();
                     });
  const auto half = static_cast<std::ptrdiff_t>(5 * entries.size());
  if (known >= half && 10 * known >= 9 * moved) return RoutePoses::known;
  return moved >= half ? RoutePoses::odometry : RoutePoses::images;
}

/// Throws UsageError if an existing route would be continued with motion from images: each run has
/// a new frame of poses then.
void reject_route_continuation(const LocaliseArguments& arguments, RoutePoses poses) {
  if (poses != RoutePoses::images || !memory_exists(arguments.memory)) return;
  if (!MemoryFile::open(arguments.memory, Access::read_only).route(*arguments.route)) return;
  throw UsageError("--route is " + *arguments.route + ", which " + arguments.memory +
                   " already contains; allowed without odometry: a new name");
}

ordered_json to_json(const RouteFollower::Step& step) {
  if (!step.fix) return {{"on_route", false}};
  return {{"on_route", true},
          {"pose", pose_json(step.fix->pose)},
          {"along_m", step.fix->along_m},
          {"lateral_m", step.fix->lateral_m},
          {"correlation", step.fix->correlation}};
}

std::string format_line(const RouteFollower::Step& step, Session& session) {
  if (!step.fix) return session.red("not on the route");
  return session.green("on the route") + ", along " + session.format_length(step.fix->along_m, 2) +
         "  lateral " + session.format_length(step.fix->lateral_m, 2);
}

/// Makes the moments of a run for its record.
class RunMoments {
 public:
  RunMoments(const LiveMemory& memory, std::string path)
      : memory_(memory), path_(std::move(path)) {}

  recordings::RunMoment make(const Observation& observation, const LiveMemory::Answer& answer,
                             const RunRecord& record, StageClock& stages) {
    recordings::RunMoment moment = record.make_moment(observation, moment_count_++);
    stages.add_to(moment);
    const PlaceRecogniser* const recogniser = memory_.recogniser();
    if (record.needs_images()) moment.panorama = memory_.panorama();
    if (!answer.place) {
      moment.state = "no memory yet";
      return moment;
    }
    set_localisation(moment, *answer.place);
    StageClock clock;
    if (!file_) file_ = MemoryFile::open(path_, Access::read_only);
    if (record.needs_images()) moment.best_match = load_best_match(*answer.place, *file_);
    // Adds all views to the record again only after one eighth more were added, as this costs time,
    // or if the memory was read again and has new ids.
    if (memory_.views() > recorded_view_count_ + recorded_view_count_ / 8 ||
        recogniser != shown_recogniser_) {
      recorded_view_count_ = memory_.views();
      shown_recogniser_ = recogniser;
      shown_.emplace(recogniser->memory(), read_length_unit(*file_));
      shown_->add_to(moment);
    }
    if (moment.panorama) {
      shown_->compare(moment, recogniser->memory(), recogniser->encoder().packed(*moment.panorama));
      clock.stage("for viewers");
      clock.add_to(moment);
    }
    return moment;
  }

 private:
  const LiveMemory& memory_;
  std::string path_;
  std::optional<MemoryFile> file_;  // nullopt before the first views of a new memory
  std::size_t moment_count_ = 0;
  std::size_t recorded_view_count_ = 0;  // number of views in the record
  std::optional<ShownReferences> shown_;
  const PlaceRecogniser* shown_recogniser_ = nullptr;
};

/// Returns the layout of the memory's images; nullopt if there is no memory yet and --add creates
/// it. Throws FileError if there is no memory otherwise, an error on options that differ
/// from those of the memory.
std::optional<PictureSource> find_remembered_source(const Arguments& declared,
                                                    const LocaliseArguments& arguments) {
  if (!memory_exists(arguments.memory)) {
    if (arguments.add) return std::nullopt;
    throw FileError(arguments.memory, "no such file; with --add it is created");
  }
  const auto memory = MemoryFile::open(arguments.memory, Access::read_only);
  require_components(declared, arguments, memory.header());
  require_stored_options(declared, arguments.signature, arguments.preprocessing, memory);
  require_stored_band(arguments.pictures, memory);
  return memory.header().source;
}

LiveMemoryOptions make_memory_options(const LocaliseArguments& arguments,
                                      const PictureSource& source, bool is_live) {
  LiveMemoryOptions options{.add = arguments.add,
                            .update = arguments.update,
                            .update_options = arguments.update_options,
                            .in_step = !is_live,
                            .memoriser = {.source = source,
                                          .signature = arguments.signature,
                                          .preprocessing = arguments.preprocessing},
                            .localiser = arguments.localiser,
                            .hold = arguments.record.file || arguments.record.view};
  if (arguments.areas) options.areas = arguments.accuracy;
  if (arguments.add_interval_s) options.min_interval_s = *arguments.add_interval_s;
  return options;
}

/// One run over a source whose images are answered in order.
class LocalisedRun {
 public:
  LocalisedRun(const Arguments& declared, const LocaliseArguments& arguments, Session& session)
      : arguments_(arguments), session_(session), live_(recordings::is_live(input())) {
    open_source(declared);
    memory_.emplace(arguments.memory, make_memory_options(arguments, pictures_, live_));
    if (recording_) {
      estimate_missing_odometry();
      has_truth_ =
          !memory_exists(arguments.memory) ||
          !has_incomparable_truth(*recording_, input(),
                                  MemoryFile::open(arguments.memory, Access::read_only), session);
    }
    if (arguments.route) open_route();
    if (recording_) {
      if (arguments.report) recording_copy_ = recording_;
      for (const DatasetEntry& entry : recording_->entries) files_.push_back(entry.file);
      source_ = std::make_unique<DatasetObservations>(std::move(*recording_), session.executor());
    }
  }

  ExitCode run() {
    std::vector<std::string> input_paths = arguments_.inputs;
    input_paths.push_back(arguments_.memory);
    RunRecord record(arguments_.record, input_paths, live_, session_,
                     {.memory = arguments_.memory});
    RunMoments moments(*memory_, arguments_.memory);
    LiveRun loop(*source_, arguments_.pictures.part, arguments_.live, session_);
    StageClock stages;
    loop.run(
        [&](const Observation& observation) {
          stages = StageClock();
          if (const auto ms = loop.decoding_ms()) stages.add("reading", *ms);
          return answer_observation(observation, stages);
        },
        [&](Observation&& observation) {
          if (arguments_.out) table_ += csv_row(query_);
          if (arguments_.report) queries_.push_back(query_);
          if (route_) route_->add(observation, *memory_);
          if (record.is_active()) {
            recordings::RunMoment moment = moments.make(observation, answer_, record, stages);
            moment.truth = query_.pose;
            record.add(std::move(moment));
          }
          if (answer_.is_new) memory_->add(std::move(observation));
        },
        [&](const Observation* observation, const Error& error) {
          return live_ ? "" : skip_image(observation, error);
        });
    if (next_image_ > 0 && skipped_count_ == next_image_) std::rethrow_exception(first_failure_);
    // Writes the report before an update, which may drop views that the report shows, but after
    // added views are stored, as they have thumbnails only then.
    if (arguments_.report && !arguments_.add) write_report();
    const std::string changes = finish();
    record.close();
    const LiveCounts& counts = loop.finish();
    if (arguments_.report && arguments_.add) write_report();
    if (has_report_) print_report_path(*arguments_.report, session_);
    session_.note(format_count(counts.pictures, "image") + ", " + std::to_string(known_count_) +
                  (known_count_ == 1 ? " shows a place of " : " show places of ") +
                  arguments_.memory + changes + describe_events(counts, record.left_out()) +
                  (live_ ? ", unwrapping " +
                               format_fixed(unwrapping_.count() /
                                                std::max(1.0, static_cast<double>(counts.pictures)),
                                            1) +
                               " ms"
                         : ""));
    if (!why_unchanged_.empty()) {
      session_.note("no view of " + arguments_.memory + " was updated: " + why_unchanged_);
    }
    if (has_changed_) session_.suggest({"panonav", "undo", arguments_.memory}, "To revert this:");
    return (arguments_.add ? counts.pictures : known_count_) > 0 ? ExitCode::done
                                                                 : ExitCode::no_answer;
  }

 private:
  [[nodiscard]] const std::string& input() const { return arguments_.inputs.front(); }

  void open_source(const Arguments& declared) {
    const auto remembered = find_remembered_source(declared, arguments_);
    if (live_) {
      auto live =
          open_live(declared, input(), arguments_.pictures, remembered, arguments_.live, session_);
      pictures_ = live->pictures();
      source_ = std::move(live);
      return;
    }
    recording_ = open_queries(arguments_, remembered, session_);
    pictures_ = recording_->source;
    poses_ = choose_route_poses(*recording_);
  }

  /// Estimates missing odometry from the images; --update needs it.
  void estimate_missing_odometry() {
    const bool has_odometry = std::ranges::all_of(
        recording_->entries, [](const DatasetEntry& entry) { return entry.odometry.has_value(); });
    const PlaceRecogniser* const recogniser = memory_->recogniser();
    if (!arguments_.update || has_odometry || recogniser == nullptr) return;
    session_.note("motion to images without odometry is computed from the images: " +
                  add_visual_odometry(*recording_, recogniser->memory(), recogniser->encoder(),
                                      session_.executor()));
  }

  void open_route() {
    if (arguments_.add) {
      reject_route_continuation(arguments_, poses_);
      route_.emplace(arguments_.memory, pictures_, *arguments_.route, poses_);
    } else {
      follower_.emplace(MemoryFile::open(arguments_.memory, Access::read_only), pictures_,
                        RouteFollowerOptions{.name = arguments_.route, .tracker = {}, .fit = {}});
    }
  }

  /// Adds a row to table and report for an image that cannot be read or answered; returns the line
  /// to print.
  std::string skip_image(const Observation* observation, const Error& error) {
    if (!first_failure_) first_failure_ = std::current_exception();
    ++skipped_count_;
    const std::string file = observation != nullptr ? observation->name : files_.at(next_image_++);
    const LocalisedQuery unreadable{file, 0.0, {}, {}, error.what()};
    if (arguments_.out) table_ += csv_row(unreadable);
    if (arguments_.report) queries_.push_back(unreadable);
    return session_.json() ? session_.json_line(command::to_json(unreadable, arguments_.areas))
                           : "";
  }

  /// Localises the observation and returns the line to print.
  std::string answer_observation(const Observation& observation, StageClock& stages) {
    ++next_image_;
    answer_ = memory_->answer(observation);
    stages.part("unwarping", answer_.unwrapping);
    stages.stage("signature, search, ranking");
    unwrapping_ += answer_.unwrapping;
    query_ = {observation.name, 0.0, answer_.place.value_or(Place{}),
              has_truth_ ? observation.pose : std::nullopt, ""};
    if (query_.place.known) ++known_count_;
    std::optional<RouteFollower::Step> step;
    if (follower_) {
      step = follower_->step(observation);
      stages.stage("route");
    }
    if (!session_.json()) {
      return (answer_.place ? format_line(query_, session_) : query_.file + "  no memory yet") +
             (answer_.is_new ? "  added" : "") + (step ? "  " + format_line(*step, session_) : "");
    }
    auto json = command::to_json(query_, arguments_.areas);
    json["stamp_s"] = to_json_or_null(observation.stamp_s);
    if (arguments_.add) json["added"] = answer_.is_new;
    if (step) json["route"] = to_json(*step);
    return session_.json_line(std::move(json));
  }

  /// Stores pending changes and returns their summary. Called before all lines are printed, as a
  /// stalled reader of the output would block then.
  std::string finish() {
    std::string text;
    const auto changes = memory_->finish("update from " + mask_credentials(input()));
    if (arguments_.add) text += ", " + format_count(memory_->added(), "view") + " added";
    if (changes) {
      has_changed_ = changes->certain > 0;
      text += "; " + summarise(*changes) + "; " + std::to_string(changes->certain) + " of " +
              format_count(changes->observations, "place") + " certain";
      why_unchanged_ = explain_uncertainty(*changes);
    }
    if (route_) text += ", " + format_count(route_->finish(), "line") + " of the route";
    if (arguments_.out)
      write_file(*arguments_.out, make_csv_header(session_.length_unit()) + table_);
    return text;
  }

  void write_report() {
    const PlaceRecogniser* const recogniser = memory_->recogniser();
    if (recogniser == nullptr) {
      session_.note("no report: there was no memory for a comparison");
      return;
    }
    const auto& entries = recording_copy_->entries;
    const auto file = MemoryFile::open(arguments_.memory, Access::read_only);
    write_localise_report(*arguments_.report, file, *recogniser, queries_, [&](std::size_t i) {
      const auto entry = std::ranges::find(entries, queries_[i].file, &DatasetEntry::file);
      return recogniser->encoder().panorama(read_observation(*entry));
    });
    has_report_ = true;
  }

  const LocaliseArguments& arguments_;
  Session& session_;
  bool live_;
  bool has_truth_ = true;  // poses of the recording are in the frame of the memory
  PictureSource pictures_;
  RoutePoses poses_ = RoutePoses::images;
  std::optional<Dataset> recording_;       // nullopt for a live source; moved into source_
  std::optional<Dataset> recording_copy_;  // for a report
  std::vector<std::string> files_;         // files of the recording's images
  std::unique_ptr<ObservationSource> source_;
  std::optional<LiveMemory> memory_;
  std::optional<RouteFollower> follower_;
  std::optional<RunRouteRecorder> route_;
  LiveMemory::Answer answer_;  // to the current image
  LocalisedQuery query_;       // the same answer for lines and tables
  std::vector<LocalisedQuery> queries_;
  std::string table_;
  std::size_t known_count_ = 0;
  std::size_t next_image_ = 0;     // index of the next image of the recording
  std::size_t skipped_count_ = 0;  // unanswered images of the recording
  std::exception_ptr first_failure_;
  bool has_report_ = false;
  bool has_changed_ = false;
  std::string why_unchanged_;  // by an update
  std::chrono::duration<double, std::milli> unwrapping_{};
};

}  // namespace

void require_components(const Arguments& declared, const LocaliseArguments& arguments,
                        const MemoryHeader& header) {
  const int components = arguments.localiser.components;
  const bool is_set_to_zero = components == 0 && declared.is_set("localiser", "components");
  if (is_set_to_zero || components > header.shape.components) {
    throw ContractError("components", components,
                        "1 to " + std::to_string(header.shape.components) + ", the memory's");
  }
}

Dataset open_queries(const LocaliseArguments& arguments,
                     const std::optional<PictureSource>& remembered, Session& session) {
  PictureArguments pictures = arguments.pictures;
  pictures.check = PictureArguments::Check::none;
  const auto open = [&](const std::string& input) {
    return open_recording(input, pictures, remembered, session);
  };
  const auto reader = find_dataset_reader(arguments.inputs.front());
  if (reader && reader->name == "video") {
    pictures.further_videos.assign(arguments.inputs.begin() + 1, arguments.inputs.end());
  }
  if (arguments.inputs.size() == 1 || !pictures.further_videos.empty()) {
    return open(arguments.inputs.front());
  }
  const PartArguments& part = arguments.pictures.part;
  if (part.from_s || part.to_s || part.every) {
    throw UsageError(
        "--from, --to and --every can be used with one recording, not with several images");
  }
  std::error_code ignored;
  std::optional<Dataset> queries;
  for (const std::string& input : arguments.inputs) {
    if (std::filesystem::is_directory(input, ignored) || recordings::is_recording(input)) {
      throw UsageError(input +
                       " is a folder or recording; allowed: one of these, or several images");
    }
    if (!queries && std::filesystem::exists(input, ignored)) queries = open(input);
  }
  if (!queries) queries = open(arguments.inputs.front());  // throws, as the file is missing
  queries->entries.clear();
  for (const std::string& input : arguments.inputs) {
    DatasetEntry entry;
    entry.file = escape_name(input);
    entry.path = input;
    queries->entries.push_back(std::move(entry));
  }
  join_entries(*queries);
  if (!pictures.ignore_gpano) apply_gpano(*queries);
  note_unusable(*queries, session);
  return std::move(*queries);
}

ExitCode localise_in_order(const Arguments& declared, const LocaliseArguments& arguments,
                           Session& session) {
  const std::string& input = arguments.inputs.front();
  const bool live = recordings::is_live(input);
  declared.reject_options({"--turn-randomly", "--exclude-same-file"},
                          live ? "where " + input + " is a live source"
                               : "with --add, --update, --route, --record and --view");
  if (live) {
    declared.reject_options({"--report"}, "where " + input + " is a live source");
  } else {
    reject_live_options(declared, input, false);
  }
  if (arguments.inputs.size() > 1 && live) {
    throw UsageError(input + " is a live source; allowed: one of these, or several images");
  }
  if (arguments.inputs.size() > 1 && (arguments.add || arguments.update || arguments.route)) {
    throw UsageError(
        "--add, --update and --route can be used with one recording, not with several images");
  }
  if (memory_exists(arguments.memory)) {
    session.set_length_unit(
        read_length_unit(MemoryFile::open(arguments.memory, Access::read_only)));
  }
  if (arguments.report) prepare_report_folder(*arguments.report, "localise");
  return LocalisedRun(declared, arguments, session).run();
}

}  // namespace panonav::command
