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

/// Returns the pixels of an image file (PNG, JPEG) of others as a JPEG of our own, so that a
/// browser gets nothing else of the file. Throws FileError on other files.
[[nodiscard]] std::string encode_again(std::span<const std::uint8_t> stored);

/// Reads pictures of references on a thread of its own, one after another: a memory on a server may
/// be slow, and neither the page nor other viewers wait for it. Any thread may call.
class ReferencePictures {
 public:
  /// Returns the stored picture of a reference by its name; empty where there is none.
  using Read = std::function<std::vector<std::uint8_t>(const std::string& name)>;

  explicit ReferencePictures(Read stored) : stored_(std::move(stored)) {}
  ~ReferencePictures() { stop(); }
  ReferencePictures(const ReferencePictures&) = delete;
  ReferencePictures& operator=(const ReferencePictures&) = delete;

  /// Begins to read the JPEG of that reference, empty where there is none, and calls `ready` when
  /// it has come; nullopt if 256 others are waiting, or after `stop`.
  [[nodiscard]] std::optional<std::future<std::string>> read(std::string name,
                                                             std::function<void()> ready);
  /// Waits for the picture that is being read, and drops the others.
  void stop();

 private:
  struct Task {
    std::packaged_task<std::string()> read;
    std::function<void()> ready;
  };

  void work();

  const Read stored_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Task> waiting_;
  bool is_stopped_ = false;
  std::thread thread_;
};

}  // namespace panonav::viewer
