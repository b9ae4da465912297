#include "panonav_recordings/internal/recorded_track.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::recordings {

std::string normalise_frame_name(std::string_view name) {
  return std::string(name.starts_with('/') ? name.substr(1) : name);
}

bool RecordedTrack::has_stamps() const {
  return samples_.empty() ||
         std::ranges::any_of(samples_, [](const Sample& each) { return each.times.stamp_ns != 0; });
}

TimedStream RecordedTrack::times(std::string name) const {
  TimedStream stream{std::move(name), {}};
  stream.times.reserve(samples_.size());
  for (const Sample& each : samples_) stream.times.push_back(each.times);
  return stream;
}

void RecordedTrack::sort(std::span<const RecordedTimes> times) {
  std::ranges::stable_sort(samples_, {}, [](const Sample& each) { return each.times.order; });
  for (std::size_t i = 0; i < samples_.size(); ++i) samples_[i].times = times[i];
  const auto stamp = [](const Sample& each) { return each.times.stamp_ns; };
  std::ranges::reverse(samples_);
  std::ranges::stable_sort(samples_, {}, stamp);
  const auto same = [&](const Sample& a, const Sample& b) { return stamp(a) == stamp(b); };
  samples_.erase(std::unique(samples_.begin(), samples_.end(), same), samples_.end());
  constexpr std::int64_t second_ns = 1'000'000'000;
  max_gap_ns_ = second_ns;
  if (samples_.size() < 2) return;
  std::vector<std::int64_t> intervals_ns;
  for (std::size_t i = 1; i < samples_.size(); ++i)
    intervals_ns.push_back(stamp(samples_[i]) - stamp(samples_[i - 1]));
  const auto middle = intervals_ns.begin() + static_cast<std::ptrdiff_t>(intervals_ns.size() / 2);
  std::ranges::nth_element(intervals_ns, middle);
  max_gap_ns_ = std::clamp(std::min(*middle, 2 * second_ns) * 3 / 2, second_ns, 3 * second_ns);
}

std::vector<std::int64_t> RecordedTrack::stamps_ns() const {
  std::vector<std::int64_t> stamps;
  for (const Sample& each : samples_) stamps.push_back(each.times.stamp_ns);
  return stamps;
}

std::optional<TimeSpan> RecordedTrack::span() const {
  if (samples_.empty()) return std::nullopt;
  return TimeSpan{samples_.front().times.stamp_ns, samples_.back().times.stamp_ns};
}

std::optional<ros::Pose> RecordedTrack::at(std::int64_t ns) const {
  const auto stamp = [](const Sample& each) { return each.times.stamp_ns; };
  const auto after = std::ranges::lower_bound(samples_, ns, {}, stamp);
  if (after != samples_.end() && stamp(*after) == ns) return after->pose;
  if (samples_.size() < 2) return std::nullopt;
  const auto next = std::clamp(after, samples_.begin() + 1, samples_.end() - 1);
  const std::int64_t a_ns = stamp(*(next - 1));
  const std::int64_t b_ns = stamp(*next);
  const std::int64_t interval_ns = b_ns - a_ns;
  if (interval_ns > max_gap_ns_ || ns < a_ns - interval_ns || ns > b_ns + interval_ns) {
    return std::nullopt;
  }
  return ros::interpolate((next - 1)->pose, next->pose,
                          static_cast<double>(ns - a_ns) / static_cast<double>(interval_ns));
}

TransformChain::TransformChain(std::string_view top, std::string_view bottom)
    : top_(normalise_frame_name(top)), bottom_(normalise_frame_name(bottom)) {
  if (top_ == bottom_) throw ContractError("odometry frames", top_ + " twice", "two frames");
}

void TransformChain::add(const ros::TransformStamped& transform, const RecordedTimes& times,
                         bool is_static) {
  const std::string child = normalise_frame_name(transform.child_frame_id);
  const std::string parent = normalise_frame_name(transform.header.frame_id);
  auto found = links_.find(child);
  if (found == links_.end()) {
    if (connected_) return;
    links_.try_emplace(child, Link{parent, {}, is_static});
    connect();
    found = links_.find(child);
    if (found == links_.end()) return;
  }
  Link& link = found->second;
  if (link.parent != parent) {
    ++ignored_transform_count_;
    return;
  }
  link.track.add({times.log_ns, transform.header.stamp_ns, times.order}, transform.transform);
  if (link.is_static) link.track.keep_only_last();
}

bool TransformChain::has_stamps() const {
  return std::ranges::all_of(links_, [](const auto& each) {
    return each.second.is_static || each.second.track.has_stamps();
  });
}

std::vector<std::pair<std::string, RecordedTrack*>> TransformChain::moving_tracks() {
  std::vector<std::pair<std::string, RecordedTrack*>> tracks;
  for (auto& [child, link] : links_) {
    if (link.is_static) continue;
    tracks.emplace_back("transforms " + link.parent + " -> " + child, &link.track);
  }
  return tracks;
}

std::optional<TimeSpan> TransformChain::span() const {
  std::optional<TimeSpan> common;
  for (const auto& [child, link] : links_) {
    const auto span = link.is_static ? std::nullopt : link.track.span();
    if (!span) continue;
    if (!common) common = span;
    common->begin_ns = std::max(common->begin_ns, span->begin_ns);
    common->end_ns = std::min(common->end_ns, span->end_ns);
  }
  return common;
}

std::optional<ros::Pose> TransformChain::at(std::int64_t ns) const {
  ros::Pose frame_from_bottom;
  for (std::string frame = bottom_; frame != top_;) {
    const Link& link = links_.at(frame);
    const auto up = link.is_static ? std::optional(link.track.last()) : link.track.at(ns);
    if (!up) return std::nullopt;
    frame_from_bottom = *up * frame_from_bottom;
    frame = link.parent;
  }
  return frame_from_bottom;
}

std::string TransformChain::list_transforms() const {
  std::string text;
  for (const auto& [child, link] : links_) {
    text += (text.empty() ? "" : ", ") + link.parent + " -> " + child;
  }
  return text.empty() ? "none" : to_readable_line(shorten_middle(text, 400));
}

void TransformChain::connect() {
  std::map<std::string, Link> chain;
  std::string frame = bottom_;
  while (frame != top_) {
    const auto link = links_.find(frame);
    if (link == links_.end()) return;
    if (!chain.try_emplace(frame, link->second).second) return;  // a cycle never reaches `top_`
    frame = link->second.parent;
  }
  links_ = std::move(chain);
  connected_ = true;
}

}  // namespace panonav::recordings
