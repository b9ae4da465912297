#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace panonav::viewer {

/// Decodes an image file (PNG, JPEG) and returns its pixels as a new JPEG, so that a browser gets
/// no other bytes of a possibly malicious file. Throws FileError on other files.
[[nodiscard]] std::string reencode_as_jpeg(std::span<const std::uint8_t> stored);

/// Reads pictures of references one after the other on a separate thread, so that neither the page
/// nor other viewers wait for a memory on a slow server. May be called from any thread.
class ReferencePictures {
 public:
  /// Returns the stored picture of the reference `name`; empty if there is none.
  using Read = std::function<std::vector<std::uint8_t>(const std::string& name)>;

  explicit ReferencePictures(Read stored) : stored_(std::move(stored)) {}
  ~ReferencePictures() { stop(); }
  ReferencePictures(const ReferencePictures&) = delete;
  ReferencePictures& operator=(const ReferencePictures&) = delete;

  /// Starts to read the picture of the reference `name` as a JPEG (empty if there is none), and
  /// calls `ready` when the future is ready. Returns nullopt if 256 others are waiting, or after
  /// `stop`.
  [[nodiscard]] std::optional<std::future<std::string>> read(std::string name,
                                                             std::function<void()> ready);
  /// Waits for the picture being read and drops the waiting ones.
  void stop();

 private:
  struct Task {
    std::packaged_task<std::string()> read;
    std::function<void()> ready;
  };

  void run_tasks();

  const Read stored_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Task> waiting_tasks_;
  bool is_stopped_ = false;
  std::thread thread_;
};

}  // namespace panonav::viewer
