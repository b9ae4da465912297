#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/geometry/position_bound.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "reports/report_page.hpp"
#include "reports/track_report.hpp"
#include "runs/live_run.hpp"
#include "runs/picture_layout.hpp"
#include "runs/recording.hpp"
#include "runs/run_record.hpp"
#include "runs/tracked_run.hpp"

namespace panonav::command {

namespace {

/// Standard deviations of the start pose. The defaults are for a robot that was placed on a mark by
/// hand.
struct StartOptions {
  double deviation_m = 0.1;
  double heading_deviation_deg = 5.0;
};

void visit_options(StartOptions& options, OptionVisitor& visitor) {
  using T = StartOptions;
  constexpr OptionTable table{
      option<&T::deviation_m>("standard deviation of x and y of the start pose", 0, 1e6),
      option<&T::heading_deviation_deg>("standard deviation of the start heading", 0, 360),
  };
  table.visit(options, visitor);
}

struct TrackArguments {
  std::string memory;
  std::string dataset;
  std::vector<std::string> inputs;  // `dataset` and the videos that continue it
  RunArguments run;
  int every = 1;
  std::optional<double> start_x_m;
  std::optional<double> start_y_m;
  std::optional<double> start_heading_deg;
  std::optional<std::string> tum;
  std::optional<std::string> report;
  RunRecordArguments record;
  LiveArguments live;
  StartOptions start;
  MonteCarloOptions filter;
  OdometryNoise odometry;
};

void check_arguments(const Arguments& declared, const TrackArguments& arguments) {
  const bool x = arguments.start_x_m.has_value();
  const bool y = arguments.start_y_m.has_value();
  if (x != y || (x && !arguments.start_heading_deg)) {
    throw UsageError(
        "--start-x-m and --start-y-m must be set together and need --start-heading-deg; "
        "--start-heading-deg can be used alone");
  }
  if (!x && declared.is_set("start")) {
    throw UsageError(
        "--start-deviation-m and --start-heading-deviation-deg need --start-x-m, --start-y-m and "
        "--start-heading-deg");
  }
  if (x && !(is_position(*arguments.start_x_m) && is_position(*arguments.start_y_m))) {
    throw UsageError("--start-x-m and --start-y-m are " + to_text(*arguments.start_x_m) + " and " +
                     to_text(*arguments.start_y_m) + "; allowed: " + std::string(position_range));
  }
  if (arguments.filter.min_particles > arguments.filter.max_particles) {
    throw UsageError("--min-particles is " + std::to_string(arguments.filter.min_particles) +
                     "; allowed: at most --max-particles, which is " +
                     std::to_string(arguments.filter.max_particles));
  }
}

void set_start(Tracker& tracker, const TrackArguments& arguments) {
  if (!arguments.start_heading_deg) return;
  const double heading_rad = wrap_angle(radians(*arguments.start_heading_deg));
  if (arguments.start_x_m) {
    tracker.start_at({*arguments.start_x_m, *arguments.start_y_m, heading_rad},
                     arguments.start.deviation_m, radians(arguments.start.heading_deviation_deg));
  } else {
    tracker.start_globally(heading_rad);
  }
}

ordered_json floor_or_null(std::string_view floor) {
  return floor.empty() ? ordered_json() : ordered_json(floor);
}

ordered_json to_json(const PoseMode& mode, bool is_heading_known) {
  const auto heading = is_heading_known ? std::optional(mode.mean.heading_rad) : std::nullopt;
  return {{"weight", mode.weight},
          {"floor", floor_or_null(mode.floor)},
          {"x_m", mode.mean.x_m},
          {"y_m", mode.mean.y_m},
          {"heading_rad", to_json_or_null(heading)},
          {"spread_m", mode.spread_m},
          {"heading_spread_rad", mode.heading_spread_rad},
          {"covariance", mode.covariance}};
}

ordered_json to_json(const TrackedImage& image) {
  const MonteCarloEstimate& estimate = image.estimate;
  auto modes = ordered_json::array();
  const bool is_heading_known = estimate.state != LocalisationState::position_known;
  for (const PoseMode& mode : estimate.modes) modes.push_back(to_json(mode, is_heading_known));
  const auto pose =
      estimate.position
          ? std::optional(ReferencePose{
                estimate.position->x_m, estimate.position->y_m,
                estimate.pose ? std::optional(estimate.pose->heading_rad) : std::nullopt})
          : std::nullopt;
  return {{"file", image.file},
          {"stamp_s", to_json_or_null(image.stamp_s)},
          {"state", to_string(estimate.state)},
          {"floor", floor_or_null(estimate.floor())},
          {"pose", pose_json(pose)},
          {"inside", estimate.p_inside},
          {"probability", estimate.probability},
          {"modes", std::move(modes)},
          {"spread_m", estimate.spread_m},
          {"particles", estimate.particles},
          {"effective_particles", estimate.effective_particles},
          {"resampled", estimate.resampled},
          {"injected", estimate.injected},
          {"difference_here", to_json_or_null(estimate.difference_here)},
          {"difference_anywhere", to_json_or_null(estimate.difference_anywhere)},
          {"ground_truth", pose_json(image.truth)}};
}

std::string format_position(const Pose2& pose, const Session& session) {
  return "x " + session.format_length(pose.x_m, 2) + "  y " + session.format_length(pose.y_m, 2);
}

std::string format_line(const TrackedImage& image, Session& session) {
  const MonteCarloEstimate& estimate = image.estimate;
  std::string line = image.file + "  ";
  const std::string state = format_state(estimate.state);
  if (estimate.state == LocalisationState::lost || estimate.modes.empty()) {
    return line + session.red(state);
  }
  const PoseMode& best = estimate.modes.front();
  const std::string floor = best.floor.empty() ? "" : "  floor " + best.floor;
  if (is_localised(image)) {
    return line + session.green(state) + floor + "  " + format_position(*estimate.pose, session) +
           "  heading " + format_fixed(degrees(estimate.pose->heading_rad), 1) +
           " degrees  spread " + session.format_length(best.spread_m, 2);
  }
  if (is_position_known(image)) {
    return line + session.green(state) + floor + "  " + format_position(best.mean, session) +
           "  spread " + session.format_length(best.spread_m, 2);
  }
  line += session.bold(state) + floor + "  ";
  if (estimate.modes.size() == 1) {
    return line + "an area around " + format_position(best.mean, session) + "  spread " +
           session.format_length(best.spread_m, 2);
  }
  constexpr std::size_t max_shown = 3;
  line += format_count(estimate.modes.size(), "place") + ":";
  for (std::size_t i = 0; i < std::min(max_shown, estimate.modes.size()); ++i) {
    const PoseMode& mode = estimate.modes[i];
    line += (i > 0 ? ",  " : "  ") + format_position(mode.mean, session) + " (" +
            format_fixed(100.0 * mode.weight, 0) + " %)";
  }
  return estimate.modes.size() > max_shown ? line + ", .." : line;
}

void print_summary(const TrackSummary& summary, Session& session) {
  const std::size_t total =
      summary.localised + summary.position_known + summary.ambiguous + summary.lost;
  session.print("localised at " +
                session.bold(std::to_string(summary.localised) + " of " + std::to_string(total)) +
                " images, " +
                (summary.position_known > 0 ? "position known without heading at " +
                                                  std::to_string(summary.position_known) + ", "
                                            : "") +
                "ambiguous at " + std::to_string(summary.ambiguous) + ", lost at " +
                std::to_string(summary.lost) +
                (summary.first_localised
                     ? "; first localised at image " + std::to_string(*summary.first_localised)
                     : "; never localised"));
  if (!summary.errors_m.empty()) {
    session.print((summary.position_known > 0 ? "error of known positions   median "
                                              : "error of localised images  median ") +
                  session.format_length(quantile(summary.errors_m, 0.5), 3) + "  95 % within " +
                  session.format_length(quantile(summary.errors_m, 0.95), 3));
  }
  if (!summary.heading_errors_rad.empty()) {
    session.print("error of their headings    median " +
                  format_fixed(degrees(quantile(summary.heading_errors_rad, 0.5)), 2) +
                  " degrees  95 % within " +
                  format_fixed(degrees(quantile(summary.heading_errors_rad, 0.95)), 2) +
                  " degrees");
  }
}

/// Returns the exit code. If the position was never known, prints why and the next command.
ExitCode conclude(const TrackSummary& summary, const TrackArguments& arguments, Session& session) {
  const std::string why = explain_never_localised(summary, arguments.memory);
  if (why.empty()) return ExitCode::done;
  const ExitCode code = session.no_answer("panonav track: never localised: " + why);
  session.suggest({"panonav", "localise", arguments.memory, arguments.dataset},
                  "To compare each image with the memory:");
  return code;
}

/// Restarts the tracker at the pose that a viewer has set; false if none did.
bool start_at_viewer_pose(Tracker& tracker, RunRecord& record) {
  // Chosen for a click on a map and an arrow drawn next to it.
  constexpr double deviation_m = 0.3;
  constexpr double heading_deviation_deg = 20.0;
  constexpr double unknown_heading_deviation_deg = 180.0;
  const auto clicked = record.take_viewer_input();
  if (!clicked) return false;
  const double heading_rad = wrap_angle(clicked->heading_rad.value_or(0.0));
  tracker.start_at(
      {clicked->x_m, clicked->y_m, heading_rad}, deviation_m,
      radians(clicked->heading_rad ? heading_deviation_deg : unknown_heading_deviation_deg));
  return true;
}

TrackerOptions make_tracker_options(const Arguments& declared, const TrackArguments& arguments,
                                    const PictureSource& source) {
  TrackerOptions options{.filter = arguments.filter, .odometry = {}, .source = source};
  if (declared.is_set("odometry")) options.odometry = arguments.odometry;
  // Reports and records need all views of the memory, so all are loaded.
  if (arguments.report || arguments.record.file || arguments.record.view) {
    options.max_held_views = std::numeric_limits<std::size_t>::max();
  }
  return options;
}

/// Tracks a robot with images of a live source. Motion is computed from the images, as live sources
/// have no odometry.
class LiveTrack {
 public:
  LiveTrack(const Arguments& declared, const TrackArguments& arguments, const MemoryFile& file,
            const PictureSource& source, Session& session)
      : arguments_(arguments),
        session_(session),
        tracker_(file, make_tracker_options(declared, arguments, source)),
        record_(arguments.record, std::span(&arguments.memory, 1), true, session,
                {.memory = arguments.memory, .takes = viewer::ViewerInput::pose}) {
    session.note("panonav track: motion is computed from the images");
    set_start(tracker_, arguments);
    if (record_.is_active()) shown_.emplace(tracker_.memory(), session.length_unit());
    settings_ = {.thumbnail_file = &file, .shown_references = shown_ ? &*shown_ : nullptr};
  }

  /// Moves the tracker by the motion since the image before and localises every N-th image. Returns
  /// the line to print.
  std::string observe(const Observation& observation, std::optional<double> decoding_ms) {
    const std::size_t number = count_++;
    const ViewEncoder& encoder = tracker_.encoder();
    StageClock clock;
    if (decoding_ms) clock.add("reading", *decoding_ms);
    std::optional<Panorama> unwarped;
    if (record_.needs_images()) unwarped = encoder.panorama(observation);
    if (unwarped) clock.stage("unwarping");
    const FourierSignature view =
        unwarped ? encoder.signature(*unwarped) : encoder.signature(observation);
    clock.stage(unwarped ? "signature" : "unwarping and signature");
    tracker_.move_by_image(view);
    clock.stage("visual odometry");
    const bool is_set_by_viewer = start_at_viewer_pose(tracker_, record_);
    if (number % static_cast<std::size_t>(arguments_.every) != 0) return "";
    if (record_.is_active()) {
      moment_ = record_.make_moment(observation, number);
      moment_->panorama = std::move(unwarped);
      moment_->odometry = tracker_.visual_odometry()->pose();
      if (number == 0) shown_->add_to(*moment_);
      clock.add_to(*moment_);
    }
    TrackedImage image = track_image(tracker_, pack(view, encoder.header().full_scale), settings_,
                                     std::move(moment_));
    moment_ = std::move(image.moment);
    if (moment_ && is_set_by_viewer) record_viewer_pose(*moment_);
    image.index = number;
    image.file = observation.name;
    image.stamp_s = observation.stamp_s;
    add(summary_, image);
    const bool is_later = trajectory_.empty() || trajectory_.back().stamp_s < *observation.stamp_s;
    if (arguments_.tum && is_localised(image) && is_later) {
      trajectory_.push_back({*observation.stamp_s, *image.estimate.pose});
    }
    return session_.json() ? session_.json_line(to_json(image)) : format_line(image, session_);
  }
  /// Adds the last observed image to the record.
  void record() {
    if (moment_) record_.add(std::move(*moment_));
    moment_.reset();
  }
  ExitCode finish(LiveRun& loop) {
    if (arguments_.tum) {
      write_trajectory(*arguments_.tum, trajectory_,
                       {.is_metric = session_.length_unit() == LengthUnit::metres});
    }
    record_.close();
    const LiveCounts& counts = loop.finish();
    if (!session_.json()) print_summary(summary_, session_);
    const VisualOdometry* const motion = tracker_.visual_odometry();
    session_.note(format_count(counts.pictures, "image") +
                  (motion ? ", " + describe_visual_motion(*motion) : "") +
                  describe_events(counts, record_.left_out()));
    return conclude(summary_, arguments_, session_);
  }

 private:
  const TrackArguments& arguments_;
  Session& session_;
  Tracker tracker_;
  RunRecord record_;
  std::optional<ShownReferences> shown_;
  TrackSettings settings_;
  std::optional<recordings::RunMoment> moment_;  // moment of the last observed image
  std::size_t count_ = 0;
  TrackSummary summary_;
  std::vector<StampedPose> trajectory_;
};

ExitCode track_live(const Arguments& declared, const TrackArguments& arguments,
                    const MemoryFile& file, Session& session) {
  declared.reject_options({"--report"}, "where " + arguments.dataset + " is a live source");
  const auto source =
      open_live(declared, arguments.dataset, {}, file.header().source, arguments.live, session);
  LiveTrack track(declared, arguments, file, source->pictures(), session);
  LiveRun loop(*source, arguments.run.part, arguments.live, session);
  loop.run(
      [&](const Observation& observation) {
        return track.observe(observation, loop.decoding_ms());
      },
      [&](Observation&&) { track.record(); });
  return track.finish(loop);
}

/// Writes the poses of localised images. `seconds` are the stamps of all images.
void write_localised_poses(const std::string& path, const std::vector<TrackedImage>& images,
                           const std::vector<double>& seconds, const TrajectoryUnits& units) {
  std::vector<StampedPose> trajectory;
  for (const TrackedImage& image : images) {
    if (!is_localised(image)) continue;
    append_pose(trajectory, {seconds[image.index], *image.estimate.pose}, path, image.file);
  }
  write_trajectory(path, trajectory, units);
}

/// Prints a note if the motion is computed from the images.
void note_motion_from_images(const TrackArguments& arguments, const Tracker& tracker,
                             bool has_odometry, Session& session) {
  const bool is_metric = session.length_unit() == LengthUnit::metres;
  if (tracker.takes_narrow_pictures()) {
    if (has_odometry && is_metric) return;
    session.note(describe_unknown_motion(arguments.dataset, arguments.memory, has_odometry));
  } else if (has_odometry && !is_metric) {
    session.note("panonav track: the positions of " + arguments.memory +
                 " are in view steps, so the odometry in metres is not used; motion is computed "
                 "from the images (panonav scale)");
  } else if (!has_odometry) {
    session.note(
        "panonav track: " + to_readable_line(arguments.dataset) +
        " has no odometry (columns odom_x_m,odom_y_m,odom_heading_deg); motion is computed "
        "from the images");
  }
}

ExitCode track_run(const Arguments& declared, const TrackArguments& arguments, Session& session) {
  check_arguments(declared, arguments);
  const auto file = MemoryFile::open(arguments.memory, Access::read_only);
  session.set_length_unit(read_length_unit(file));
  if (recordings::is_live(arguments.dataset)) return track_live(declared, arguments, file, session);
  reject_live_options(declared, arguments.dataset, true);
  Dataset run = open_run(arguments.dataset, arguments.run, file, session);
  if (run.source.kind == PictureKind::pinhole) {
    declared.reject_options({"--report", "--record", "--view"}, "with narrow images (pinhole)");
  }
  std::vector<double> seconds;
  if (arguments.tum)
    seconds = trajectory_stamps(run, "track", arguments.dataset, *arguments.tum, session);
  Tracker tracker(arguments.memory, make_tracker_options(declared, arguments, run.source));
  set_start(tracker, arguments);
  const bool is_metric = session.length_unit() == LengthUnit::metres;
  if (has_incomparable_truth(run, arguments.dataset, file, session)) {
    for (DatasetEntry& entry : run.entries) entry.pose.reset();
  }
  TrackSettings settings{.every = arguments.every};
  note_motion_from_images(arguments, tracker, has_odometry(run), session);
  if (arguments.report) {
    prepare_report_folder(*arguments.report, "track");
    settings.particles_per_image = count_shown_particles(run.entries.size());
  }

  RunRecord record(arguments.record, std::array{arguments.dataset, arguments.memory}, false,
                   session, {.memory = arguments.memory, .takes = viewer::ViewerInput::pose});
  const std::size_t image_count = (run.entries.size() - 1) / settings.every + 1;
  std::optional<ShownReferences> shown_references;
  if (record.is_active() || arguments.report) {
    settings.thumbnail_file = &file;
    settings.shown_references = &shown_references.emplace(tracker.memory(), session.length_unit());
    settings.has_viewer_input = [&] { return start_at_viewer_pose(tracker, record); };
  }
  viewer::RunPage replay_page("panonav track: " + to_readable_line(arguments.dataset), image_count);
  std::vector<TrackedImage> images;
  Progress progress(session, "tracking", image_count);
  track(tracker, run, settings, session, [&](TrackedImage&& image) {
    progress.clear();
    session.print(session.json() ? session.json_line(to_json(image)) : format_line(image, session));
    if (arguments.report) add(replay_page, image);
    if (record.is_active()) record.add(std::move(*image.moment));
    image.moment.reset();
    images.push_back(std::move(image));
    progress.advance();
  });
  progress.clear();
  record.close();

  if (arguments.tum) {
    write_localised_poses(*arguments.tum, images, seconds,
                          find_trajectory_units(run, session.length_unit()));
  }
  const TrackSummary summary = summarise_track(images);
  if (!session.json()) print_summary(summary, session);
  if (const auto* motion = tracker.visual_odometry()) {
    session.note("motion" +
                 std::string(has_odometry(run) && is_metric ? " without odometry: " : ": ") +
                 describe_visual_motion(*motion));
  }
  if (arguments.report) {
    write_track_report(*arguments.report, tracker, images, summary, replay_page);
    print_report_path(*arguments.report, session);
  }
  return conclude(summary, arguments, session);
}

Run declare_track(Arguments& arguments) {
  auto values = std::make_shared<TrackArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.positionals("INPUT", values->inputs,
                        "Data set, folder of images, video (several are joined) or recording with "
                        "images in the order of the run, or a live source (-, /dev/video0, "
                        "rtsp://). If there is no odometry, motion is computed from the images");
  declare_topics(arguments, values->run.topics);
  declare_part(arguments, values->run.part, false);
  declare_gpano(arguments, values->run.ignore_gpano);
  arguments.option("--every N", values->every, 1,
                   "Use only every N-th image; the odometry of skipped images is added up");
  arguments.option("--start-x-m", values->start_x_m,
                   "x coordinate of the start position; by default, the start position is unknown");
  arguments.option("--start-y-m", values->start_y_m, "y coordinate of the start position");
  arguments.option("--start-heading-deg", values->start_heading_deg,
                   "Heading at the start; can be used without a position");
  arguments.option("--tum FILE", values->tum,
                   "Write the estimated poses of all localised images to this file: as CSV if the "
                   "name ends in .csv, otherwise as TUM text");
  declare_record(arguments, values->record);
  declare_view(arguments, values->record);
  declare_live(arguments, values->live);
  declare_report(arguments, values->report, "a page that replays the run");
  arguments.options("start", values->start, "start");
  arguments.options("monte_carlo", values->filter);
  arguments.options("odometry", values->odometry, "odometry");
  arguments.show_in_help({"--seed"});
  arguments.declare_outputs({"--tum"});
  return [values, &arguments](Session& session) {
    values->dataset = values->inputs.front();
    values->run.further_videos.assign(values->inputs.begin() + 1, values->inputs.end());
    return track_run(arguments, *values, session);
  };
}

}  // namespace

Verb track_verb() {
  return {"track",
          VerbGroup::localisation,
          "Track the position of a moving robot from images and odometry",
          "The verb uses Monte-Carlo localisation. The start pose may be unknown. If several "
          "places look similar, all of them are tracked until an image shows which one is correct. "
          "A robot that was moved without odometry (kidnapped) is localised again. With a live "
          "source, tracking continues until you press Ctrl-C. If only its position is "
          "known, no heading is printed. Narrow images (a data set with kind = \"pinhole\") need a "
          "memory made with memorise --narrow. The exit code is 1 if its position was never known.",
          "  panonav track office.panonav run\n"
          "  panonav track office.panonav run --every 10 --report report\n"
          "  panonav track office.panonav run --tum estimate.tum --json\n"
          "  panonav evaluate estimate.tum run/poses.csv --align none",
          declare_track};
}

}  // namespace panonav::command
