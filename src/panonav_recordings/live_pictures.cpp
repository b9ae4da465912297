#include "panonav_recordings/live_pictures.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <variant>

#include "panonav/core/address.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav_recordings/internal/decoded_video.hpp"
#include "panonav_recordings/internal/v4l2_camera.hpp"
#include "panonav_recordings/jpeg_stream.hpp"

namespace panonav::recordings {

namespace {

constexpr std::array<std::string_view, 6> schemes{"rtsp://",  "rtmp://", "http://",
                                                  "https://", "tcp://",  "udp://"};

bool is_camera(const std::string& address) {
  return address.starts_with("/dev/video");
}

using Steady = std::chrono::steady_clock;

double unix_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// A picture as received.
struct RawPicture {
  std::variant<std::vector<std::uint8_t>, Image> picture;
  double stamp_s = 0.0;
  Steady::time_point arrived{};
  std::uint64_t lost = 0;  ///< pictures lost before it, if the source reports that
};

/// An open source of pictures.
class Input {
 public:
  virtual ~Input() = default;
  /// Waits for the next picture; `nullopt` at the end and after `stop`. Throws Error if the source
  /// is lost.
  virtual std::optional<RawPicture> take() = 0;
  virtual Image decode(std::span<const std::uint8_t> bytes, const ImageLimits& limits) const {
    return decode_image(bytes, "the image", limits);
  }
  /// Ends a `take` that another thread is in.
  virtual void stop() noexcept {}
};

class StandardInput final : public Input {
 public:
  explicit StandardInput(int stop) : stop_(stop) {}

  std::optional<RawPicture> take() override {
    while (true) {
      if (auto picture = stream_.next())
        return RawPicture{std::move(*picture), unix_time_s(), Steady::now(), 0};
      std::array<pollfd, 2> waits{pollfd{STDIN_FILENO, POLLIN, 0}, pollfd{stop_, POLLIN, 0}};
      if (poll(waits.data(), waits.size(), -1) < 0) continue;
      if (waits[1].revents != 0) return std::nullopt;
      std::array<std::uint8_t, 65536> buffer;
      const auto got = read(STDIN_FILENO, buffer.data(), buffer.size());
      if (got <= 0) return std::nullopt;
      stream_.add(std::span(buffer).first(static_cast<std::size_t>(got)), "standard input");
    }
  }

 private:
  JpegStream stream_;
  int stop_;
};

class CameraInput final : public Input {
 public:
  CameraInput(const std::string& device, const std::optional<ImageSize>& size, int stop)
      : camera_(device, size), stop_(stop) {}
  std::optional<RawPicture> take() override {
    auto frame = camera_.next(stop_);
    if (!frame) return std::nullopt;
    return RawPicture{std::move(frame->bytes), frame->stamp_s, frame->arrived, frame->lost};
  }
  Image decode(std::span<const std::uint8_t> bytes, const ImageLimits& limits) const override {
    return camera_.decode(bytes, limits);
  }

 private:
  V4l2Camera camera_;
  int stop_;
};

class AddressInput final : public Input {
 public:
  AddressInput(const std::string& address, const ImageLimits& limits, double max_silence_s)
      : address_(address),
        max_silence_s_(max_silence_s),
        video_({"-fflags", "nobuffer", "-flags", "low_delay", "-protocol_whitelist",
                "rtsp,rtp,rtmp,http,https,tls,tcp,udp,crypto", "-i", address},
               "", address, limits) {}
  std::optional<RawPicture> take() override {
    const double max_wait_s =
        std::exchange(is_first_, false) ? 3.0 * max_silence_s_ : max_silence_s_;
    auto frame = video_.next(std::chrono::milliseconds(static_cast<int>(1000.0 * max_wait_s)));
    if (frame) return RawPicture{std::move(frame->picture), unix_time_s(), Steady::now(), 0};
    throw FileError(
        address_,
        "was interrupted" +
            (video_.last_error().empty() ? "" : ": " + mask_passwords(video_.last_error())));
  }
  void stop() noexcept override { video_.stop(); }

 private:
  std::string address_;
  double max_silence_s_;
  bool is_first_ = true;
  DecodedVideo video_;
};

/// True if a JPEG file has Huffman tables. Some cameras leave them out, but viewers need them.
bool has_huffman_tables(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 2> begin{0xff, 0xd8};
  constexpr std::array<std::uint8_t, 2> tables{0xff, 0xc4};
  const auto is_at = [&](std::size_t at, const auto& marker) {
    return std::equal(marker.begin(), marker.end(),
                      bytes.begin() + static_cast<std::ptrdiff_t>(at));
  };
  if (bytes.size() < 4 || !is_at(0, begin)) return false;
  for (std::size_t at = 2; at + 4 <= bytes.size() && bytes[at] == 0xff;) {
    if (is_at(at, tables)) return true;
    at += 2 + (static_cast<std::size_t>(bytes[at + 2]) << 8U) + bytes[at + 3];
  }
  return false;
}

}  // namespace

bool is_live(const std::string& address) {
  return address == "-" || is_camera(address) ||
         std::ranges::any_of(schemes,
                             [&](std::string_view scheme) { return address.starts_with(scheme); });
}

struct LivePictures::Implementation {
  Implementation(std::string where, const LiveOptions& live_options)
      : address(std::move(where)), options(live_options) {}

  [[nodiscard]] std::shared_ptr<Input> open() const {
    if (address == "-") return std::make_shared<StandardInput>(stop_event);
    if (is_camera(address)) return std::make_shared<CameraInput>(address, options.size, stop_event);
    return std::make_shared<AddressInput>(address, options.limits, options.max_silence_s);
  }

  /// Receives pictures until the input ends.
  void receive_all() {
    while (auto picture = input->take()) {
      std::unique_lock lock(mutex);
      counts.dropped += picture->lost;
      if (address == "-") consumed.wait(lock, [&] { return !newest || stopped; });
      if (stopped) return;
      if (newest) ++counts.dropped;
      newest = std::pair(std::move(*picture), input);
      if (std::exchange(is_broken_off, false))
        notes.push_back(mask_credentials(address) + " sends images again");
      arrived.notify_one();
    }
  }

  void work() {
    while (!stopped) {
      try {
        receive_all();
        break;
      } catch (const Error& error) {
        const std::lock_guard lock(mutex);
        if (stopped) break;
        ++counts.interruptions;
        if (!std::exchange(is_broken_off, true)) {
          notes.push_back(to_readable_line(error.what()) +
                          "; panonav tries to open it again until images come");
        }
        arrived.notify_one();
      }
      while (!stopped) {
        pollfd wait{stop_event, POLLIN, 0};
        poll(&wait, 1, static_cast<int>(1000.0 * options.reopen_after_s));
        if (stopped) break;
        try {
          auto opened = open();
          const std::lock_guard lock(mutex);
          input = std::move(opened);
          break;
        } catch (const Error&) {  // NOLINT(bugprone-empty-catch): retried by the loop
        }
      }
      // `stop` ended only the input that was open then, not the one opened since.
      if (stopped) break;
    }
    const std::lock_guard lock(mutex);
    ended = true;
    arrived.notify_all();
  }

  std::string address;
  LiveOptions options;
  int stop_event = -1;
  mutable std::mutex mutex;
  std::condition_variable arrived;
  std::condition_variable consumed;
  std::shared_ptr<Input> input;
  std::optional<std::pair<RawPicture, std::shared_ptr<Input>>> newest;
  Counts counts;
  std::vector<std::string> notes;  // for `options.note`; `next` passes them on
  bool is_broken_off = false;
  bool has_been_read = false;  // `next` was called
  std::atomic<bool> stopped = false;
  bool ended = false;
  std::thread thread;
};

LivePictures::LivePictures(std::string address, const LiveOptions& options)
    : implementation_(std::make_unique<Implementation>(std::move(address), options)) {
  auto& self = *implementation_;
  remember_address(self.address);
  if (!is_live(self.address)) {
    throw FileError(self.address,
                    "is not a live source; allowed: -, /dev/video*, rtsp://, rtmp://, http://, "
                    "https://, tcp://, udp://");
  }
  self.stop_event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (self.stop_event < 0) throw Error("no event can be made");
  try {
    self.input = self.open();
    // Only the first image shows that an address can be opened.
    if (self.address != "-" && !is_camera(self.address)) {
      self.newest = std::pair(self.input->take().value(), self.input);
    }
    self.thread = std::thread([&self] { self.work(); });
  } catch (...) {
    close(self.stop_event);
    throw;
  }
}

LivePictures::~LivePictures() {
  stop();
  implementation_->thread.join();
  close(implementation_->stop_event);
}

void LivePictures::stop() noexcept {
  auto& self = *implementation_;
  self.stopped = true;
  const std::uint64_t one = 1;
  (void)!write(self.stop_event, &one, sizeof(one));
  const std::lock_guard lock(self.mutex);
  if (self.input) self.input->stop();
  self.arrived.notify_all();
  self.consumed.notify_all();
}

std::optional<LivePicture> LivePictures::next() {
  auto& self = *implementation_;
  while (true) {
    std::optional<std::pair<RawPicture, std::shared_ptr<Input>>> newest;
    std::vector<std::string> notes;
    {
      std::unique_lock lock(self.mutex);
      if (!std::exchange(self.has_been_read, true)) self.counts.dropped = 0;
      self.arrived.wait(
          lock, [&] { return self.newest || self.ended || self.stopped || !self.notes.empty(); });
      notes.swap(self.notes);
      if (notes.empty()) {
        if (self.stopped || !self.newest) return std::nullopt;
        newest = std::exchange(self.newest, std::nullopt);
        self.consumed.notify_one();
      }
    }
    if (!notes.empty()) {
      if (self.options.note) std::ranges::for_each(notes, self.options.note);
      continue;
    }
    auto& [received, input] = *newest;
    if (auto* const picture = std::get_if<Image>(&received.picture)) {
      return LivePicture{std::move(*picture), {}, received.stamp_s, received.arrived, {}};
    }
    try {
      const auto before = Steady::now();
      auto& bytes = std::get<std::vector<std::uint8_t>>(received.picture);
      LivePicture decoded{input->decode(bytes, self.options.limits),
                          {},
                          received.stamp_s,
                          received.arrived,
                          Steady::now() - before};
      if (has_huffman_tables(bytes)) decoded.encoded = std::move(bytes);
      return decoded;
    } catch (const Error&) {
      const std::lock_guard lock(self.mutex);
      ++self.counts.damaged;
    }
  }
}

LivePictures::Counts LivePictures::counts() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->counts;
}

}  // namespace panonav::recordings
