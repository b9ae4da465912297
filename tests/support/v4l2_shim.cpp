// Stands between a program and the system (LD_PRELOAD) and plays the camera /dev/video7: JPEG
// pictures from the file V4L2_SHIM_PICTURES, which holds each behind its length in four bytes, at
// V4L2_SHIM_RATE a second. After V4L2_SHIM_UNPLUG of them the camera is gone, and back when it is
// opened for the second time after that, V4L2_SHIM_UNPLUGS times (1). Pictures start over at the
// end. The wall clock is set back by an hour after V4L2_SHIM_CLOCK_BACK pictures. How many were
// taken is in the file V4L2_SHIM_TAKEN.
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/mman.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <vector>

namespace {

constexpr unsigned buffer_bytes = 1U << 20U;
constexpr unsigned max_buffers = 8;

struct Camera {
  int descriptor = -1;
  std::vector<std::string> pictures;
  unsigned sent = 0;
  unsigned sent_since_open = 0;
  std::uint64_t produced = 0;  // with those that nobody fetched in time
  unsigned sequence = 0;
  long unplugs = 0;
  int failed_opens = 0;
  bool gone = false;
  unsigned queued = 0;
  unsigned next_buffer = 0;
  unsigned buffers = 0;
  unsigned char* memory = nullptr;
  int produced_file = -1;
};

std::atomic<bool> clock_is_back = false;

Camera& camera() {
  static Camera one;
  return one;
}

long setting(const char* name, long otherwise) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::atol(text) : otherwise;
}

void read_pictures() {
  std::FILE* const file = std::fopen(std::getenv("V4L2_SHIM_PICTURES"), "rb");
  if (file == nullptr) std::abort();
  std::uint32_t length = 0;
  while (std::fread(&length, 4, 1, file) == 1) {
    std::string picture(length, '\0');
    if (std::fread(picture.data(), 1, length, file) != length) std::abort();
    camera().pictures.push_back(std::move(picture));
  }
  std::fclose(file);
}

int open_camera() {
  Camera& self = camera();
  if (self.gone && self.failed_opens++ == 0) {
    errno = ENOENT;
    return -1;
  }
  self.gone = false;
  self.failed_opens = 0;
  self.sequence = self.queued = self.next_buffer = self.sent_since_open = 0;
  if (self.pictures.empty()) {
    read_pictures();
    const char* const file = std::getenv("V4L2_SHIM_TAKEN");
    if (file != nullptr) self.produced_file = creat(file, 0600);
  }
  self.descriptor = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  return self.descriptor;
}

int fail(int error) {
  errno = error;
  return -1;
}

int give_picture(v4l2_buffer& buffer) {
  Camera& self = camera();
  const long unplug = setting("V4L2_SHIM_UNPLUG", 0);
  if (unplug > 0 && self.sent_since_open == static_cast<unsigned>(unplug) && !self.gone &&
      self.unplugs < setting("V4L2_SHIM_UNPLUGS", 1)) {
    self.gone = true;
    ++self.unplugs;
  }
  if (self.gone) return fail(ENODEV);
  std::uint64_t due = 0;
  if (read(self.descriptor, &due, sizeof(due)) != sizeof(due)) return fail(EAGAIN);
  if (self.queued == 0) return fail(EAGAIN);
  const std::string& picture = self.pictures[self.sent % self.pictures.size()];
  buffer.index = self.next_buffer;
  std::memcpy(self.memory + static_cast<std::size_t>(buffer.index) * buffer_bytes, picture.data(),
              picture.size());
  buffer.bytesused = static_cast<std::uint32_t>(picture.size());
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  buffer.sequence = self.sequence + static_cast<unsigned>(due) - 1;
  self.sequence = buffer.sequence + 1;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  buffer.timestamp = {now.tv_sec, now.tv_nsec / 1000};
  self.next_buffer = (self.next_buffer + 1) % self.buffers;
  --self.queued;
  ++self.sent;
  self.produced += self.sent_since_open++ == 0 ? 1 : due;
  if (static_cast<long>(self.sent) == setting("V4L2_SHIM_CLOCK_BACK", 0)) clock_is_back = true;
  if (self.produced_file >= 0) {
    (void)!pwrite(self.produced_file, &self.produced, sizeof(self.produced), 0);
  }
  return 0;
}

int answer(unsigned long request, void* argument) {
  Camera& self = camera();
  switch (request) {
    case VIDIOC_QUERYCAP:
      static_cast<v4l2_capability*>(argument)->capabilities =
          V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    case VIDIOC_ENUM_FMT: {
      auto& format = *static_cast<v4l2_fmtdesc*>(argument);
      if (format.index > 1) return fail(EINVAL);
      format.pixelformat = format.index == 0 ? V4L2_PIX_FMT_H264 : V4L2_PIX_FMT_MJPEG;
      return 0;
    }
    case VIDIOC_ENUM_FRAMESIZES: {
      auto& size = *static_cast<v4l2_frmsizeenum*>(argument);
      if (size.index > 0) return fail(EINVAL);
      size.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      size.discrete = {96, 12};
      return 0;
    }
    case VIDIOC_G_FMT:
    case VIDIOC_S_FMT: {
      auto& format = static_cast<v4l2_format*>(argument)->fmt.pix;
      format.width = 96;
      format.height = 12;
      if (request == VIDIOC_G_FMT) format.pixelformat = V4L2_PIX_FMT_H264;
      return 0;
    }
    case VIDIOC_REQBUFS: {
      auto& buffers = *static_cast<v4l2_requestbuffers*>(argument);
      if (buffers.count > max_buffers) buffers.count = max_buffers;
      self.buffers = buffers.count;
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      buffer.length = buffer_bytes;
      buffer.m.offset = buffer.index * buffer_bytes;
      return 0;
    }
    case VIDIOC_QBUF:
      ++self.queued;
      return self.gone ? fail(ENODEV) : 0;
    case VIDIOC_STREAMON: {
      const long rate = setting("V4L2_SHIM_RATE", 30);
      itimerspec times{};
      times.it_value.tv_nsec = times.it_interval.tv_nsec = 1'000'000'000 / rate;
      return timerfd_settime(self.descriptor, 0, &times, nullptr);
    }
    case VIDIOC_DQBUF:
      return give_picture(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMOFF:
      return 0;
    default:
      return fail(ENOTTY);
  }
}

template <class Function>
Function* original(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  if (std::strcmp(path, "/dev/video7") == 0) return open_camera();
  std::va_list rest;
  va_start(rest, flags);
  const unsigned mode = va_arg(rest, unsigned);
  va_end(rest);
  return original<int(const char*, int, ...)>("open")(path, flags, mode);
}

int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = original<int(clockid_t, timespec*)>("clock_gettime")(clock, time);
  if (clock == CLOCK_REALTIME && clock_is_back) time->tv_sec -= 3600;
  return result;
}

int ioctl(int descriptor, unsigned long request, ...) noexcept {
  std::va_list rest;
  va_start(rest, request);
  void* const argument = va_arg(rest, void*);
  va_end(rest);
  if (descriptor == camera().descriptor && descriptor >= 0) return answer(request, argument);
  return original<int(int, unsigned long, ...)>("ioctl")(descriptor, request, argument);
}

void* mmap(void* address, std::size_t length, int protection, int flags, int descriptor,
           off_t offset) noexcept {
  using Mmap = void*(void*, std::size_t, int, int, int, off_t);
  if (descriptor < 0 || descriptor != camera().descriptor) {
    return original<Mmap>("mmap")(address, length, protection, flags, descriptor, offset);
  }
  Camera& self = camera();
  if (offset == 0) {
    self.memory = static_cast<unsigned char*>(
        original<Mmap>("mmap")(nullptr, std::size_t{max_buffers} * buffer_bytes,
                               PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
  }
  return self.memory + offset;
}
}
