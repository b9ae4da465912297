#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav::ros2 {

/// Hands work to the thread that localises: requests in their order, and the newest picture.
class WorkQueue {
 public:
  /// A request, or the message of a picture where that is empty.
  struct Work {
    std::function<void()> request;
    std::vector<std::uint8_t> picture;
  };

  /// Appends a request. Throws Error when 16 of them wait.
  void add(std::function<void()> request) {
    constexpr std::size_t max_requests = 16;  // more than people send while one is worked on
    const std::lock_guard lock(mutex_);
    if (requests_.size() >= max_requests) {
      throw Error("too many requests at a time; this one is left out");
    }
    requests_.push_back(std::move(request));
    changed_.notify_all();
  }

  /// Takes a picture in place of the one that waits, which is dropped.
  void set_picture(std::span<const std::uint8_t> message) {
    const std::lock_guard lock(mutex_);
    last_picture_came_ = std::chrono::steady_clock::now();
    if (picture_) ++dropped_;
    picture_.emplace(message.begin(), message.end());
    changed_.notify_all();
  }

  /// Waits for work, requests first. `nullopt` once `stop` was called.
  [[nodiscard]] std::optional<Work> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_stopped_ || picture_ || !requests_.empty(); });
    if (is_stopped_) return std::nullopt;
    if (requests_.empty()) return Work{{}, *std::exchange(picture_, std::nullopt)};
    Work work{std::move(requests_.front()), {}};
    requests_.pop_front();
    return work;
  }

  void stop() {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    changed_.notify_all();
  }

  [[nodiscard]] std::size_t dropped() const {  ///< Number of pictures.
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

  /// Returns the time since the last picture arrived; before the first, since the queue was made.
  [[nodiscard]] std::chrono::nanoseconds time_without_picture() const {
    const std::lock_guard lock(mutex_);
    return std::chrono::steady_clock::now() - last_picture_came_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopped_ = false;
  std::deque<std::function<void()>> requests_;
  std::optional<std::vector<std::uint8_t>> picture_;
  std::chrono::steady_clock::time_point last_picture_came_ = std::chrono::steady_clock::now();
  std::size_t dropped_ = 0;
};

}  // namespace panonav::ros2
