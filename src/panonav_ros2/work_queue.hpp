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

/// Passes work to the localising thread: requests in order, and the newest image.
class WorkQueue {
 public:
  /// A request, or an image message if `request` is empty.
  struct Work {
    std::function<void()> request;
    std::vector<std::uint8_t> picture;
  };

  /// Appends a request. Throws Error if 16 requests are waiting.
  void add(std::function<void()> request) {
    constexpr std::size_t max_requests = 16;  // more than users send while one is processed
    const std::lock_guard lock(mutex_);
    if (requests_.size() >= max_requests) {
      throw Error("too many requests at a time; this one is left out");
    }
    requests_.push_back(std::move(request));
    changed_.notify_all();
  }

  /// Stores an image message; it replaces one that is still waiting, which is dropped.
  void set_picture(std::span<const std::uint8_t> message) {
    const std::lock_guard lock(mutex_);
    last_picture_came_ = std::chrono::steady_clock::now();
    if (picture_) ++dropped_;
    picture_.emplace(message.begin(), message.end());
    changed_.notify_all();
  }

  /// Waits for work and returns it, requests first; `nullopt` after `stop` was called.
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

  [[nodiscard]] std::size_t dropped() const {  ///< Number of dropped images.
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

  /// Returns the time since the last image arrived; before the first image, since construction.
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
