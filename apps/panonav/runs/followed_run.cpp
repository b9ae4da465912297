#include "runs/followed_run.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/motion/path.hpp"
#include "panonav/pipeline/observation_source.hpp"
#include "panonav/route/route_position.hpp"
#include "runs/recording.hpp"
#include "runs/shown_references.hpp"

namespace panonav::command {

namespace {

/// Projects the true position onto the route. Where the route passes several times, as at the two
/// ends of a closed route, returns the pass next to the fix.
RoutePosition find_true_place(std::span<const Pose2> route, Point2 truth,
                              const std::optional<RouteFix>& fix) {
  const RoutePosition nearest = project_onto_route(route, truth);
  if (!fix || route.size() < 2) return nearest;
  const double spacing_m = path_length_m(route) / static_cast<double>(route.size() - 1);
  const auto passes = find_passes(route, truth, std::abs(nearest.lateral_m) + spacing_m);
  const auto distance_to_fix_m = [&](const RoutePosition& pass) {
    return std::abs(pass.along_m - fix->along_m);
  };
  const auto next = std::ranges::min_element(passes, {}, distance_to_fix_m);
  return next == passes.end() ? nearest : *next;
}

void fill_moment(recordings::RunMoment& moment, const FollowedImage& image) {
  moment.sure = image.fix.has_value();
  moment.state = moment.sure ? "on the route" : "not on this route";
  moment.truth.reset();  // a recording's poses may be in another frame than the route's
  if (image.truth) {
    moment.truth = {image.truth->x_m, image.truth->y_m, image.truth->heading_rad};
  }
  if (!image.fix) return;
  moment.pose = image.fix->pose;
  moment.covariance = image.fix->covariance;
  moment.values = {{"origin", std::string(format_origin(image.fix->origin))},
                   {"along_m", format_fixed(image.fix->along_m, 3)},
                   {"lateral_m", format_fixed(image.fix->lateral_m, 3)},
                   {"correlation", format_fixed(image.fix->correlation, 4)},
                   {"changed", std::to_string(image.changed.size())}};
}

}  // namespace

void follow(RouteFollower& follower, const Dataset& run, const std::vector<Pose2>& truth,
            int every_nth, const PanoramaReader* panorama_reader, Session& session,
            const std::function<void(FollowedImage&&)>& report) {
  struct EncodedImage {
    std::vector<float> line;
    std::optional<recordings::RunMoment> moment;
  };
  const auto every = static_cast<std::size_t>(every_nth);
  const std::size_t image_count = (run.entries.size() + every - 1) / every;
  SkippedImages skipped(image_count, session);
  bool is_first = true;
  process_in_order(
      image_count, session.executor(),
      [&](std::size_t i) {
        StageClock clock;
        const Observation observation = read_observation(run.entries[i * every]);
        clock.stage("reading");
        EncodedImage encoded{follower.encode(observation), std::nullopt};
        clock.stage("scanline");
        if (panorama_reader == nullptr) return encoded;
        encoded.moment = recordings::make_moment(observation, i * every);
        encoded.moment->panorama = panorama_reader->convert(encoded.moment->picture->view(),
                                                            observation.tilt.value_or(Tilt{}));
        clock.stage("for viewers");
        clock.add_to(*encoded.moment);
        return encoded;
      },
      [&](std::size_t i, EncodedImage&& encoded) {
        const std::size_t index = i * every;
        const DatasetEntry& entry = run.entries[index];
        StageClock clock;
        RouteFollower::Step step = follower.step(std::move(encoded.line), entry.odometry);
        clock.stage("matching");
        if (encoded.moment) clock.add_to(*encoded.moment);
        FollowedImage image{index,
                            entry.file,
                            entry.stamp_s,
                            std::move(step.line),
                            std::move(step.fix),
                            std::move(step.changed),
                            std::nullopt,
                            std::nullopt,
                            std::move(encoded.moment)};
        const auto& route = follower.tracker().lines().poses();
        if (!truth.empty()) {
          image.truth = truth[index];
          image.true_place = find_true_place(route, truth[index].position(), image.fix);
        }
        if (image.moment) {
          fill_moment(*image.moment, image);
          if (follower.source().assumed_unit_m) {
            image.moment->length_unit = to_string(LengthUnit::view_steps);
          }
          if (std::exchange(is_first, false)) image.moment->plan.assign(route.begin(), route.end());
        }
        report(std::move(image));
      },
      [&](std::size_t, const std::exception_ptr& failure) { skipped.add(failure); });
}

FollowSummary summarise_follow(const std::vector<FollowedImage>& images, bool headings_known) {
  FollowSummary summary;
  summary.images = images.size();
  for (const FollowedImage& image : images) {
    if (!image.fix) continue;
    ++summary.on_route;
    switch (image.fix->origin) {
      case RouteFix::Origin::prediction:
        ++summary.predicted;
        break;
      case RouteFix::Origin::recovery:
        ++summary.recovered;
        break;
      case RouteFix::Origin::search:
        ++summary.searched;
        break;
    }
    if (!image.truth) continue;
    const Pose2& pose = image.fix->pose;
    summary.position_m.push_back(distance(pose.position(), image.truth->position()));
    summary.along_m.push_back(std::abs(image.fix->along_m - image.true_place->along_m));
    summary.lateral_m.push_back(std::abs(image.fix->lateral_m - image.true_place->lateral_m));
    if (headings_known) {
      summary.heading_rad.push_back(
          std::abs(angle_difference(pose.heading_rad, image.truth->heading_rad)));
    }
  }
  return summary;
}

std::vector<std::pair<double, double>> find_changed_sections(
    const std::vector<FollowedImage>& images) {
  std::vector<std::pair<double, double>> stretches;
  bool is_continued = false;
  double last_m = 0.0;  // of the last image with a change
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < images.size(); ++i) {
    if (!images[i - 1].fix || !images[i].fix) continue;
    steps_m.push_back(std::abs(images[i].fix->along_m - images[i - 1].fix->along_m));
  }
  constexpr double max_gap_steps = 10.0;  // median steps between images of one section (chosen)
  const double max_gap_m = steps_m.empty() ? 0.0 : max_gap_steps * median(steps_m);
  for (const FollowedImage& image : images) {
    const bool changed = image.fix && !image.changed.empty();
    if (changed) {
      const double along_m = image.fix->along_m;
      // From the end of a closed route to its start, or after a search.
      const bool has_jumped = is_continued && std::abs(along_m - last_m) > max_gap_m;
      if (!is_continued || has_jumped) stretches.emplace_back(along_m, along_m);
      last_m = along_m;
      stretches.back().first = std::min(stretches.back().first, along_m);
      stretches.back().second = std::max(stretches.back().second, along_m);
    }
    is_continued = changed;
  }
  return stretches;
}

std::string_view to_string(RouteFix::Origin origin) {
  switch (origin) {
    case RouteFix::Origin::prediction:
      return "prediction";
    case RouteFix::Origin::recovery:
      return "recovery";
    case RouteFix::Origin::search:
      return "search";
  }
  return "search";
}

std::string_view format_origin(RouteFix::Origin origin) {
  switch (origin) {
    case RouteFix::Origin::prediction:
      return "predicted";
    case RouteFix::Origin::recovery:
      return "recovered";
    case RouteFix::Origin::search:
      return "found";
  }
  return "found";
}

}  // namespace panonav::command
