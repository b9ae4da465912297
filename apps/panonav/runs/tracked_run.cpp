#include "runs/tracked_run.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

bool is_localised(const TrackedImage& image) {
  return image.estimate.state == LocalisationState::localised && image.estimate.pose;
}

bool is_position_known(const TrackedImage& image) {
  return is_localised(image) || image.estimate.state == LocalisationState::position_known;
}

std::optional<double> position_error_m(const TrackedImage& image) {
  if (!image.truth || !image.estimate.position) return std::nullopt;
  return distance(*image.estimate.position, image.truth->position());
}

std::optional<double> heading_error_rad(const TrackedImage& image) {
  if (!image.truth || !image.truth->heading_rad || !image.estimate.pose) return std::nullopt;
  return std::abs(angle_difference(image.estimate.pose->heading_rad, *image.truth->heading_rad));
}

std::string format_state(LocalisationState state) {
  if (state == LocalisationState::position_known) return "position known, heading not";
  return std::string(to_string(state));
}

void add(TrackSummary& summary, const TrackedImage& image) {
  const std::size_t before =
      summary.localised + summary.position_known + summary.ambiguous + summary.lost;
  switch (image.estimate.state) {
    case LocalisationState::localised:
      ++summary.localised;
      break;
    case LocalisationState::position_known:
      ++summary.position_known;
      break;
    case LocalisationState::ambiguous:
      ++summary.ambiguous;
      break;
    case LocalisationState::lost:
      ++summary.lost;
      break;
  }
  if (!is_position_known(image)) return;
  if (const auto error = position_error_m(image)) summary.errors_m.push_back(*error);
  if (!is_localised(image)) return;
  if (!summary.first_localised) summary.first_localised = before + 1;
  if (const auto error = heading_error_rad(image)) summary.heading_errors_rad.push_back(*error);
}

std::string explain_never_localised(const TrackSummary& summary, const std::string& memory) {
  if (summary.localised + summary.position_known > 0) return {};
  const std::size_t total = summary.ambiguous + summary.lost;
  if (total == 0) return "there was no image";
  if (2 * summary.lost >= total) {
    return std::to_string(summary.lost) + " of " + format_count(total, "image") +
           " fit no place of " + memory +
           "; check that the memory is of this place, and that the images are of the same camera, "
           "at the same height and upright";
  }
  return std::to_string(summary.ambiguous) + " of " + format_count(total, "image") +
         " fit several places of " + memory +
         " or a large area; use a longer run, or state where it starts (--start-x-m, --start-y-m, "
         "--start-heading-deg)";
}

std::string describe_unknown_motion(const std::string& run, const std::string& memory,
                                    bool has_odometry) {
  return "panonav track: " + to_readable_line(run) + " has no odometry" +
         (has_odometry ? " in the unit of the memory" : "") +
         ", and narrow images show no motion; each image may be one spacing of the views of " +
         memory + " from the last";
}

TrackSummary summarise_track(const std::vector<TrackedImage>& images) {
  TrackSummary summary;
  for (const TrackedImage& image : images) add(summary, image);
  return summary;
}

TrackedImage track_image(Tracker& tracker, const PackedSignature& view,
                         const TrackSettings& settings,
                         std::optional<recordings::RunMoment> moment) {
  TrackedImage image;
  StageClock clock;
  image.estimate = tracker.observe(view);
  clock.stage("filter");
  image.particles =
      recordings::resample_systematically(tracker.particles(), settings.particles_per_image);
  if (moment) {
    set_localisation(*moment, image.estimate);
    moment->particles = recordings::resample_systematically(tracker.particles(), 500);
    if (moment->panorama) {
      if (settings.shown_references != nullptr)
        settings.shown_references->compare(*moment, tracker.memory(), view);
      const ViewId best = tracker.memory().search(view, {.top = 1}).matches.front().view;
      moment->best_match =
          settings.thumbnail_file->thumbnail(best).value_or(std::vector<std::uint8_t>{});
      const auto& reference = tracker.memory().info(best).pose;
      if (moment->pose && reference && reference->heading_rad) {
        moment->best_match_turn_rad =
            angle_difference(moment->pose->heading_rad, *reference->heading_rad);
      }
    }
    clock.stage("for viewers");
    clock.add_to(*moment);
    image.moment = std::move(moment);
  }
  return image;
}

void record_viewer_pose(recordings::RunMoment& moment) {
  moment.values.emplace_back("event", "a viewer tells where the robot is");
}

void add(viewer::RunPage& page, const TrackedImage& image) {
  recordings::RunMoment moment = *image.moment;
  moment.particles = image.particles;
  constexpr std::size_t max_compared = 50;  // limits the size of the page
  if (moment.comparisons.size() > max_compared) moment.comparisons.resize(max_compared);
  moment.values.insert(moment.values.begin(), {"image", image.file});
  page.add(moment);
}

namespace {

/// A view that the filter observes, and what belongs to the steps since the view before.
struct EncodedImage {
  /// A motion step: the view of its image; nullopt where odometry gives the motion.
  struct Step {
    std::optional<FourierSignature> view;
    std::exception_ptr failure;  ///< of an image that cannot be read
  };
  std::vector<Step> steps;  ///< of the images since then and of this one
  PackedSignature view;
  std::optional<Place> place;  ///< instead of the view of a narrow picture
  std::optional<recordings::RunMoment> moment;
};

/// Returns the index of the first entry after the image that was observed before `index`.
std::size_t find_first_step(std::size_t index, std::size_t every) {
  return index - std::min(index, every - 1);
}

/// Encodes the image itself; its step is the last of `image.steps`.
void encode_observed(const std::vector<DatasetEntry>& entries, std::size_t index,
                     const Tracker& tracker, const TrackSettings& settings, EncodedImage& image) {
  const ViewEncoder& encoder = tracker.encoder();
  StageClock clock;
  const Observation observation = read_observation(entries[index]);
  clock.stage("reading");
  if (tracker.takes_narrow_pictures()) {
    image.place = tracker.localise(observation);
    return;
  }
  std::optional<FourierSignature> signature;
  if (settings.thumbnail_file == nullptr) {
    signature = encoder.signature(observation);
  } else {
    recordings::RunMoment& moment =
        image.moment.emplace(recordings::make_moment(observation, index));
    clock.restart();
    moment.panorama = encoder.panorama(observation);
    clock.stage("unwarping");
    signature = encoder.signature(*moment.panorama);
    clock.stage("signature");
    clock.add_to(moment);
    if (index == 0 && settings.shown_references != nullptr)
      settings.shown_references->add_to(moment);
  }
  image.view = pack(*signature, encoder.header().full_scale);
  if (tracker.needs_view(entries, index)) image.steps.back().view = std::move(*signature);
}

EncodedImage encode(const std::vector<DatasetEntry>& entries, std::size_t index,
                    const Tracker& tracker, const TrackSettings& settings) {
  const ViewEncoder& encoder = tracker.encoder();
  EncodedImage image;
  const auto every = static_cast<std::size_t>(settings.every);
  for (std::size_t i = find_first_step(index, every); i < index; ++i) {
    auto& step = image.steps.emplace_back();
    if (!tracker.needs_view(entries, i)) continue;
    try {
      step.view = encoder.signature(read_observation(entries[i]));
    } catch (const FileError&) {
      step.failure = std::current_exception();
    }
  }
  auto& step = image.steps.emplace_back();
  try {
    encode_observed(entries, index, tracker, settings, image);
  } catch (const FileError&) {
    step.failure = std::current_exception();
  }
  return image;
}

/// Moves the particles by all steps up to the image. Steps without odometry whose images cannot be
/// read are part of the next step.
void move(Tracker& tracker, const Dataset& run, std::size_t index, EncodedImage& image,
          SkippedImages& skipped) {
  const std::size_t first = index + 1 - image.steps.size();
  for (std::size_t i = 0; i < image.steps.size(); ++i) {
    const auto& [view, failure] = image.steps[i];
    if (failure) skipped.add(failure);
    const auto& odometry = run.entries[first + i].odometry;
    if (failure && (!odometry || tracker.length_unit() != LengthUnit::metres)) continue;
    tracker.move(odometry, view ? &*view : nullptr);
  }
  if (!image.moment || image.steps.back().failure) return;
  image.moment->odometry = tracker.odometry();
  const bool is_by_images = !has_odometry(run) || tracker.length_unit() != LengthUnit::metres;
  if (is_by_images) image.moment->odometry = tracker.visual_odometry()->pose();
}

TrackedImage track_place(Tracker& tracker, const Place& place, const TrackSettings& settings) {
  TrackedImage image;
  image.estimate = tracker.observe(place);
  image.particles =
      recordings::resample_systematically(tracker.particles(), settings.particles_per_image);
  return image;
}

}  // namespace

void track(Tracker& tracker, const Dataset& recorded, const TrackSettings& settings,
           Session& session, const std::function<void(TrackedImage&&)>& report) {
  Dataset run = recorded;
  tracker.bridge_pauses(run, session.executor());
  const auto& entries = run.entries;
  SkippedImages skipped(entries.size(), session);
  const auto every = static_cast<std::size_t>(settings.every);
  const std::size_t image_count = (entries.size() + every - 1) / every;
  constexpr std::size_t batch_size = 32;
  for (std::size_t begin = 0; begin < image_count; begin += batch_size) {
    std::vector<EncodedImage> images(std::min(batch_size, image_count - begin));
    parallel_for(session.executor(), images.size(), [&](std::size_t i) {
      images[i] = encode(entries, (begin + i) * every, tracker, settings);
    });
    for (std::size_t i = 0; i < images.size(); ++i) {
      const std::size_t index = (begin + i) * every;
      const bool has_viewer_input = settings.has_viewer_input && settings.has_viewer_input();
      move(tracker, run, index, images[i], skipped);
      if (images[i].steps.back().failure) continue;
      const DatasetEntry& entry = entries[index];
      TrackedImage image = images[i].place ? track_place(tracker, *images[i].place, settings)
                                           : track_image(tracker, images[i].view, settings,
                                                         std::move(images[i].moment));
      if (image.moment && has_viewer_input) record_viewer_pose(*image.moment);
      image.index = index;
      image.file = entry.file;
      image.stamp_s = entry.stamp_s;
      image.truth = entry.pose;
      report(std::move(image));
    }
  }
}

}  // namespace panonav::command
