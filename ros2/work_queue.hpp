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
#include <vector>

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
  void add(std::function<void()> request);
  /// Takes a picture in place of the one that waits, which is dropped. Returns false, and keeps the
  /// one that waits, when the stamp is not after the last one.
  [[nodiscard]] bool set_picture(std::int64_t stamp_ns, std::span<const std::uint8_t> message);
  /// Waits for work, requests first. `nullopt` once `stop` was called.
  [[nodiscard]] std::optional<Work> next();
  void stop();

  [[nodiscard]] std::size_t dropped() const;  ///< Number of pictures.
  /// Returns the time since the last picture came; before the first, since the queue was made.
  [[nodiscard]] std::chrono::nanoseconds time_without_picture() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopped_ = false;
  std::deque<std::function<void()>> requests_;
  std::optional<std::vector<std::uint8_t>> picture_;
  std::optional<std::int64_t> last_picture_ns_;
  std::chrono::steady_clock::time_point last_picture_came_ = std::chrono::steady_clock::now();
  std::size_t dropped_ = 0;
};

}  // namespace panonav::ros2
