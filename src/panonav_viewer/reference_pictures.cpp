#include "panonav_viewer/reference_pictures.hpp"

#include <utility>

#include "panonav/io/image_file.hpp"

namespace panonav::viewer {

std::string encode_again(std::span<const std::uint8_t> stored) {
  const Image picture = decode_image(stored, "image of a view", {.side_px = 4096});
  const std::vector<std::uint8_t> bytes = encode_jpeg(picture.view());
  return {bytes.begin(), bytes.end()};
}

std::optional<std::future<std::string>> ReferencePictures::read(std::string name,
                                                                std::function<void()> ready) {
  constexpr std::size_t max_waiting = 256;  // as many as the server has connections
  const std::lock_guard lock(mutex_);
  if (is_stopped_ || waiting_.size() >= max_waiting) return std::nullopt;
  std::packaged_task<std::string()> task([this, name = std::move(name)] {
    const std::vector<std::uint8_t> bytes = stored_(name);
    return bytes.empty() ? std::string() : encode_again(bytes);
  });
  auto result = task.get_future();
  waiting_.push_back({std::move(task), std::move(ready)});
  if (!thread_.joinable()) thread_ = std::thread([this] { work(); });
  came_.notify_one();
  return result;
}

void ReferencePictures::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    waiting_.clear();
  }
  came_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void ReferencePictures::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    came_.wait(lock, [this] { return is_stopped_ || !waiting_.empty(); });
    if (is_stopped_) return;
    Task next = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    next.read();
    next.ready();
    lock.lock();
  }
}

}  // namespace panonav::viewer
