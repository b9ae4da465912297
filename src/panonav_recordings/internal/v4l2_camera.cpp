#include "panonav_recordings/internal/v4l2_camera.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav_recordings/ros_messages.hpp"

namespace panonav::recordings {

namespace {

/// Pixel formats in order of preference.
constexpr std::array<std::uint32_t, 5> supported_formats{
    V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_JPEG, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_UYVY, V4L2_PIX_FMT_GREY};

bool is_supported(std::uint32_t pixels) {
  return std::ranges::find(supported_formats, pixels) != supported_formats.end();
}

bool try_ioctl(int descriptor, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ioctl(descriptor, request, argument);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

int open_device(const std::string& device) {
  const int descriptor = open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) {
    throw FileError(device, std::string("cannot be opened: ") + std::strerror(errno));
  }
  v4l2_capability capability{};
  const bool is_v4l2 = try_ioctl(descriptor, VIDIOC_QUERYCAP, &capability);
  const std::uint32_t capabilities = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                         ? capability.device_caps
                                         : capability.capabilities;
  if (!is_v4l2 || (capabilities & V4L2_CAP_VIDEO_CAPTURE) == 0 ||
      (capabilities & V4L2_CAP_STREAMING) == 0) {
    close(descriptor);
    throw FileError(device, "is not a camera that streams images");
  }
  return descriptor;
}

std::vector<std::uint32_t> list_pixel_formats(int descriptor) {
  constexpr std::uint32_t max_formats = 64;
  std::vector<std::uint32_t> formats;
  for (v4l2_fmtdesc format{}; format.index < max_formats; ++format.index) {
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (!try_ioctl(descriptor, VIDIOC_ENUM_FMT, &format)) break;
    formats.push_back(format.pixelformat);
  }
  return formats;
}

std::string format_name(std::uint32_t pixels) {
  std::string name;
  for (int byte = 0; byte < 4; ++byte) {
    const char c = static_cast<char>((pixels >> (8 * byte)) & 0x7fU);
    name += c >= ' ' && c != 0x7f ? c : '?';
  }
  return name;
}

double seconds(const timespec& time) {
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Returns how far the wall clock is now ahead of the monotonic clock, by which drivers stamp
/// frames, in seconds.
double wall_minus_monotonic_s() {
  timespec wall{};
  timespec monotonic{};
  clock_gettime(CLOCK_REALTIME, &wall);
  clock_gettime(CLOCK_MONOTONIC, &monotonic);
  return seconds(wall) - seconds(monotonic);
}

}  // namespace

std::vector<CameraFormat> list_camera_formats(const std::filesystem::path& device) {
  const int descriptor = open_device(device.string());
  std::vector<CameraFormat> formats;
  for (const std::uint32_t pixels : list_pixel_formats(descriptor)) {
    CameraFormat format{format_name(pixels), is_supported(pixels), {}};
    constexpr std::uint32_t max_sizes = 256;
    for (v4l2_frmsizeenum size{}; size.index < max_sizes; ++size.index) {
      size.pixel_format = pixels;
      if (!try_ioctl(descriptor, VIDIOC_ENUM_FRAMESIZES, &size)) break;
      if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) break;
      format.sizes.push_back(
          {static_cast<int>(size.discrete.width), static_cast<int>(size.discrete.height)});
    }
    formats.push_back(std::move(format));
  }
  close(descriptor);
  return formats;
}

V4l2Camera::V4l2Camera(std::string device, const std::optional<ImageSize>& size)
    : device_(std::move(device)), descriptor_(open_device(device_)) {
  try {
    start(size);
  } catch (...) {
    for (const auto& [data, length] : buffers_) munmap(data, length);
    close(descriptor_);
    throw;
  }
}

void V4l2Camera::start(const std::optional<ImageSize>& size) {
  const auto offered = list_pixel_formats(descriptor_);
  const auto* const chosen = std::ranges::find_if(supported_formats, [&](std::uint32_t pixels) {
    return std::ranges::find(offered, pixels) != offered.end();
  });
  if (chosen == supported_formats.end()) {
    std::string names;
    for (const std::uint32_t pixels : offered)
      names += (names.empty() ? "" : ", ") + format_name(pixels);
    fail("offers the formats " + (names.empty() ? "none" : names) +
         "; allowed: MJPG, JPEG, YUYV, UYVY, GREY");
  }
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!try_ioctl(descriptor_, VIDIOC_G_FMT, &format)) fail("does not say its format");
  format.fmt.pix.pixelformat = *chosen;
  format.fmt.pix.field = V4L2_FIELD_ANY;
  if (size) {
    format.fmt.pix.width = static_cast<std::uint32_t>(size->width);
    format.fmt.pix.height = static_cast<std::uint32_t>(size->height);
  }
  if (!try_ioctl(descriptor_, VIDIOC_S_FMT, &format)) {
    fail(std::string("does not support the format ") + format_name(*chosen) + ": " +
         std::strerror(errno));
  }
  const auto& pixels = format.fmt.pix;
  if (!is_supported(pixels.pixelformat) || pixels.width < 1 || pixels.height < 1 ||
      pixels.width > 65535 || pixels.height > 65535) {
    fail("gives images of " + std::to_string(pixels.width) + " x " + std::to_string(pixels.height) +
         " px as " + format_name(pixels.pixelformat));
  }
  pixels_ = pixels.pixelformat;
  size_ = {static_cast<int>(pixels.width), static_cast<int>(pixels.height)};
  const std::uint32_t pixel_bytes = pixels_ == V4L2_PIX_FMT_GREY ? 1 : 2;
  step_ = std::max(pixels.bytesperline, pixels.width * pixel_bytes);

  v4l2_requestbuffers request{};
  request.count = 4;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (!try_ioctl(descriptor_, VIDIOC_REQBUFS, &request) || request.count < 2) {
    fail("is used by another program, or gives no buffers");
  }
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.type = request.type;
    buffer.memory = request.memory;
    buffer.index = i;
    if (!try_ioctl(descriptor_, VIDIOC_QUERYBUF, &buffer)) fail("gives no buffers");
    void* const data = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_,
                            static_cast<off_t>(buffer.m.offset));
    if (data == MAP_FAILED) fail("gives no buffers");
    buffers_.push_back({data, buffer.length});
    if (!try_ioctl(descriptor_, VIDIOC_QBUF, &buffer)) fail("takes no buffers");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!try_ioctl(descriptor_, VIDIOC_STREAMON, &type)) {
    fail(std::string("does not start: ") + std::strerror(errno));
  }
}

V4l2Camera::~V4l2Camera() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  try_ioctl(descriptor_, VIDIOC_STREAMOFF, &type);
  for (const auto& [data, length] : buffers_) munmap(data, length);
  close(descriptor_);
}

void V4l2Camera::fail(const std::string& what) const {
  throw FileError(device_, what);
}

std::optional<V4l2Camera::Frame> V4l2Camera::next(int stop) {
  constexpr int silent_ms = 5000;
  while (true) {
    std::array<pollfd, 2> waits{pollfd{descriptor_, POLLIN, 0}, pollfd{stop, POLLIN, 0}};
    const int ready = poll(waits.data(), waits.size(), silent_ms);
    if (ready < 0) continue;  // interrupted by a signal
    if (waits[1].revents != 0) return std::nullopt;
    if (ready == 0) fail("has sent no image for 5 s");
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (!try_ioctl(descriptor_, VIDIOC_DQBUF, &buffer)) {
      if (errno == EAGAIN && (waits[0].revents & (POLLERR | POLLHUP)) == 0) continue;
      fail(std::string("was disconnected: ") + std::strerror(errno));
    }
    if (buffer.index >= buffers_.size()) fail("names a buffer that does not exist");
    const bool damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
    Frame frame;
    if (!damaged) {
      const auto* const data = static_cast<const std::uint8_t*>(buffers_[buffer.index].data);
      frame.bytes.assign(
          data, data + std::min<std::size_t>(buffer.bytesused, buffers_[buffer.index].length));
      const double monotonic_s = static_cast<double>(buffer.timestamp.tv_sec) +
                                 1e-6 * static_cast<double>(buffer.timestamp.tv_usec);
      const bool is_monotonic =
          (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
      timespec now{};
      clock_gettime(CLOCK_REALTIME, &now);
      frame.stamp_s = is_monotonic ? monotonic_s + wall_minus_monotonic_s() : seconds(now);
      frame.arrived = std::chrono::steady_clock::now();
      if (is_monotonic) {  // the steady clock is the monotonic one
        frame.arrived = std::chrono::steady_clock::time_point(
            std::chrono::seconds(buffer.timestamp.tv_sec) +
            std::chrono::microseconds(buffer.timestamp.tv_usec));
      }
      if (sequence_) frame.lost = buffer.sequence - *sequence_ - 1U;
      if (frame.lost > 1'000'000) frame.lost = 0;  // restarted counter of the driver
      sequence_ = buffer.sequence;
    }
    if (!try_ioctl(descriptor_, VIDIOC_QBUF, &buffer)) fail("has gone");
    if (!damaged) return frame;
  }
}

Image V4l2Camera::decode(std::span<const std::uint8_t> bytes, const ImageLimits& limits) const {
  if (pixels_ == V4L2_PIX_FMT_MJPEG || pixels_ == V4L2_PIX_FMT_JPEG) {
    return decode_image(bytes, device_, limits);
  }
  ros::Image raw;
  raw.width = static_cast<std::uint32_t>(size_.width);
  raw.height = static_cast<std::uint32_t>(size_.height);
  raw.step = step_;
  raw.encoding = pixels_ == V4L2_PIX_FMT_GREY   ? "mono8"
                 : pixels_ == V4L2_PIX_FMT_YUYV ? "yuv422_yuy2"
                                                : "yuv422";
  const std::size_t needed = std::size_t{step_} * raw.height;
  raw.data = bytes.first(std::min(needed, bytes.size()));
  return to_image(raw, limits);
}

}  // namespace panonav::recordings
