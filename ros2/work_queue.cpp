#include "ros2/work_queue.hpp"

#include <utility>

#include "panonav/core/error.hpp"
#include "ros2/motion_history.hpp"

namespace panonav::ros2 {

void WorkQueue::add(std::function<void()> request) {
  constexpr std::size_t max_requests = 16;  // more than people send while one is worked on
  const std::lock_guard lock(mutex_);
  if (requests_.size() >= max_requests) {
    throw Error("too many requests at a time; this one is left out");
  }
  requests_.push_back(std::move(request));
  changed_.notify_all();
}

bool WorkQueue::set_picture(std::int64_t stamp_ns, std::span<const std::uint8_t> message) {
  const std::lock_guard lock(mutex_);
  if (last_picture_ns_ && stamp_ns <= *last_picture_ns_ &&
      stamp_ns > *last_picture_ns_ - MotionHistory::late_ns) {
    return false;
  }
  last_picture_ns_ = stamp_ns;
  last_picture_came_ = std::chrono::steady_clock::now();
  if (picture_) ++dropped_;
  picture_.emplace(message.begin(), message.end());
  changed_.notify_all();
  return true;
}

std::optional<WorkQueue::Work> WorkQueue::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return is_stopped_ || picture_ || !requests_.empty(); });
  if (is_stopped_) return std::nullopt;
  if (requests_.empty()) return Work{{}, *std::exchange(picture_, std::nullopt)};
  Work work{std::move(requests_.front()), {}};
  requests_.pop_front();
  return work;
}

void WorkQueue::stop() {
  const std::lock_guard lock(mutex_);
  is_stopped_ = true;
  changed_.notify_all();
}

std::size_t WorkQueue::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::chrono::nanoseconds WorkQueue::time_without_picture() const {
  const std::lock_guard lock(mutex_);
  return std::chrono::steady_clock::now() - last_picture_came_;
}

}  // namespace panonav::ros2
