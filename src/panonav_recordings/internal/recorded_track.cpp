#include "panonav_recordings/internal/recorded_track.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::recordings {

namespace {

/// Removes a leading slash: ROS 1 writes both "/odom" and "odom".
std::string normalise_frame_name(std::string_view name) {
  return std::string(name.starts_with('/') ? name.substr(1) : name);
}

}  // namespace

bool RecordedTrack::has_stamps() const {
  return samples_.empty() ||
         std::ranges::any_of(samples_, [](const Sample& each) { return each.times.stamp_ns != 0; });
}

void RecordedTrack::sort(bool use_log_times) {
  for (Sample& each : samples_)
    each.at_ns = use_log_times ? each.times.log_ns : each.times.stamp_ns;
  std::ranges::reverse(samples_);
  std::ranges::stable_sort(samples_, {}, &Sample::at_ns);
  const auto same = [](const Sample& a, const Sample& b) { return a.at_ns == b.at_ns; };
  samples_.erase(std::unique(samples_.begin(), samples_.end(), same), samples_.end());
}

std::optional<ros::Pose> RecordedTrack::at(std::int64_t ns) const {
  constexpr std::int64_t max_gap_ns = 1'000'000'000;
  const auto after = std::ranges::lower_bound(samples_, ns, {}, &Sample::at_ns);
  if (after != samples_.end() && after->at_ns == ns) return after->pose;
  if (samples_.size() < 2) return std::nullopt;
  const auto next = std::clamp(after, samples_.begin() + 1, samples_.end() - 1);
  const Sample& a = *(next - 1);
  const Sample& b = *next;
  const std::int64_t interval = b.at_ns - a.at_ns;
  if (interval > max_gap_ns || ns < a.at_ns - interval || ns > b.at_ns + interval) {
    return std::nullopt;
  }
  return ros::interpolate(a.pose, b.pose,
                          static_cast<double>(ns - a.at_ns) / static_cast<double>(interval));
}

TransformChain::TransformChain(std::string_view top, std::string_view bottom)
    : top_(normalise_frame_name(top)), bottom_(normalise_frame_name(bottom)) {
  if (top_ == bottom_) throw ContractError("odometry frames", top_ + " twice", "two frames");
}

void TransformChain::add(const ros::TransformStamped& transform, std::int64_t log_ns,
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
  link.track.add({log_ns, transform.header.stamp_ns}, transform.transform);
  if (link.is_static) link.track.keep_only_last();
}

bool TransformChain::has_stamps() const {
  return std::ranges::all_of(links_, [](const auto& each) {
    return each.second.is_static || each.second.track.has_stamps();
  });
}

void TransformChain::sort(bool use_log_times) {
  for (auto& [child, link] : links_) link.track.sort(use_log_times);
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
