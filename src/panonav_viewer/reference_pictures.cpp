#include "panonav_viewer/reference_pictures.hpp"

#include <utility>

#include "panonav/io/image_file.hpp"

namespace panonav::viewer {

std::string reencode_as_jpeg(std::span<const std::uint8_t> stored) {
  const Image picture = decode_image(stored, "image of a view", {.side_px = 4096});
  const std::vector<std::uint8_t> bytes = encode_jpeg(picture.view());
  return {bytes.begin(), bytes.end()};
}

std::optional<std::future<std::string>> ReferencePictures::read(std::string name,
                                                                std::function<void()> ready) {
  constexpr std::size_t max_waiting = 256;  // equal to the server's number of connections
  const std::lock_guard lock(mutex_);
  if (is_stopped_ || waiting_tasks_.size() >= max_waiting) return std::nullopt;
  std::packaged_task<std::string()> task([this, name = std::move(name)] {
    const std::vector<std::uint8_t> bytes = stored_(name);
    return bytes.empty() ? std::string() : reencode_as_jpeg(bytes);
  });
  auto result = task.get_future();
  waiting_tasks_.push_back({std::move(task), std::move(ready)});
  if (!thread_.joinable()) thread_ = std::thread([this] { run_tasks(); });
  changed_.notify_one();
  return result;
}

void ReferencePictures::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    waiting_tasks_.clear();
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void ReferencePictures::run_tasks() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return is_stopped_ || !waiting_tasks_.empty(); });
    if (is_stopped_) return;
    Task next = std::move(waiting_tasks_.front());
    waiting_tasks_.pop_front();
    lock.unlock();
    next.read();
    next.ready();
    lock.lock();
  }
}

}  // namespace panonav::viewer
