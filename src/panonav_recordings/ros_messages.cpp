#include "panonav_recordings/ros_messages.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>
#include <limits>
#include <type_traits>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/position_bound.hpp"

namespace panonav::recordings::ros {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::size_t encapsulation_bytes = 4;  // of CDR: representation and options

template <class M, class T>
concept Is = std::same_as<std::remove_const_t<M>, T>;

// Passes the members of each message to `a`, a Reader or a Writer, in the order of its .msg file.

template <class A>
void visit_fields(A& a, Is<Header> auto& m) {
  a.sequence_number();
  a.stamp(m.stamp_ns);
  a(m.frame_id);
}
template <class A>
void visit_fields(A& a, Is<Vector3> auto& m) {
  a(m.x, m.y, m.z);
}
template <class A>
void visit_fields(A& a, Is<Quaternion> auto& m) {
  a(m.x, m.y, m.z, m.w);
}
template <class A>
void visit_fields(A& a, Is<Pose> auto& m) {
  a(m.position, m.orientation);
}
template <class A>
void visit_fields(A& a, Is<Image> auto& m) {
  a(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data);
}
template <class A>
void visit_fields(A& a, Is<CompressedImage> auto& m) {
  a(m.header, m.format, m.data);
}
template <class A>
void visit_fields(A& a, Is<FoxgloveRawImage> auto& m) {
  a.stamp(m.stamp_ns);
  a(m.frame_id, m.width, m.height, m.encoding, m.step, m.data);
}
template <class A>
void visit_fields(A& a, Is<FoxgloveCompressedImage> auto& m) {
  a.stamp(m.stamp_ns);
  a(m.frame_id, m.data, m.format);
}
template <class A>
void visit_fields(A& a, Is<FfmpegPacket> auto& m) {
  a(m.header, m.width, m.height, m.encoding, m.pts, m.flags, m.is_bigendian, m.data);
}
template <class A>
void visit_fields(A& a, Is<Imu> auto& m) {
  a(m.header, m.orientation, m.orientation_covariance, m.angular_velocity,
    m.angular_velocity_covariance, m.linear_acceleration, m.linear_acceleration_covariance);
}
template <class A>
void visit_fields(A& a, Is<PoseWithCovariance> auto& m) {
  a(m.pose, m.covariance);
}
template <class A>
void visit_fields(A& a, Is<Odometry> auto& m) {
  a(m.header, m.child_frame_id, m.pose, m.linear_velocity, m.angular_velocity, m.twist_covariance);
}
template <class A>
void visit_fields(A& a, Is<TransformStamped> auto& m) {
  a(m.header, m.child_frame_id, m.transform);
}
template <class A>
void visit_fields(A& a, Is<TFMessage> auto& m) {
  a(m.transforms);
}
template <class A>
void visit_fields(A& a, Is<PointStamped> auto& m) {
  a(m.header, m.point);
}
template <class A>
void visit_fields(A& a, Is<PoseStamped> auto& m) {
  a(m.header, m.pose);
}
template <class A>
void visit_fields(A& a, Is<PoseWithCovarianceStamped> auto& m) {
  a(m.header, m.pose);
}
template <class A>
void visit_fields(A& a, Is<PoseArray> auto& m) {
  a(m.header, m.poses);
}
template <class A>
void visit_fields(A& a, Is<Path> auto& m) {
  a(m.header, m.poses);
}
template <class A>
void visit_fields(A& a, Is<PointField> auto& m) {
  a(m.name, m.offset, m.datatype, m.count);
}
template <class A>
void visit_fields(A& a, Is<PointCloud2> auto& m) {
  a(m.header, m.height, m.width, m.fields, m.is_bigendian, m.point_step, m.row_step, m.data,
    m.is_dense);
}
template <class A>
void visit_fields(A& a, Is<OccupancyGrid> auto& m) {
  a(m.header);
  a.stamp(m.map_load_time_ns);
  a(m.resolution, m.width, m.height, m.origin, m.cells);
}
template <class A>
void visit_fields(A& a, Is<LaserScan> auto& m) {
  a(m.header, m.angle_min, m.angle_max, m.angle_increment, m.time_increment, m.scan_time,
    m.range_min, m.range_max, m.ranges, m.intensities);
}
template <class A>
void visit_fields(A& a, Is<KeyValue> auto& m) {
  a(m.key, m.value);
}
template <class A>
void visit_fields(A& a, Is<DiagnosticStatus> auto& m) {
  a(m.level, m.name, m.message, m.hardware_id, m.values);
}
template <class A>
void visit_fields(A& a, Is<DiagnosticArray> auto& m) {
  a(m.header, m.status);
}
template <class A>
void visit_fields(A& a, Is<Twist> auto& m) {
  a(m.linear, m.angular);
}
template <class A>
void visit_fields(A& a, Is<Clock> auto& m) {
  a.stamp(m.clock_ns);
}
template <class A>
void visit_fields(A& a, Is<String> auto& m) {
  a(m.data);
}

template <class Number>
Number swap_bytes(Number value) {
  auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof(Number)>>(value);
  std::ranges::reverse(bytes);
  return std::bit_cast<Number>(bytes);
}

// Returns the padding before a value: CDR aligns n bytes to multiples of n after the encapsulation
// header, ROS 1 aligns nothing.
std::size_t padding(bool aligned, std::size_t at, std::size_t size) {
  return aligned ? (size - (at - encapsulation_bytes) % size) % size : 0;
}

class Reader {
 public:
  Reader(std::span<const std::uint8_t> bytes, MessageEncoding encoding, std::string_view type)
      : bytes_(bytes), type_(type), cdr_(encoding == MessageEncoding::cdr) {
    if (encoding != MessageEncoding::cdr && encoding != MessageEncoding::ros1)
      fail("encoding", "other", "ros1, cdr");
    if (!cdr_) return;
    const auto header = take(encapsulation_bytes);
    const int representation = header[0] << 8 | header[1];
    if (representation > 1) {
      fail("CDR representation", std::to_string(representation), "0 (big endian), 1 (little)");
    }
    swaps_ = (representation == 1) != (std::endian::native == std::endian::little);
  }

  template <class... Values>
  void operator()(Values&... values) {
    (read_value(values), ...);
  }
  void sequence_number() {
    if (!cdr_) (void)number<std::uint32_t>();
  }
  void stamp(std::int64_t& ns) {
    const auto seconds = number<std::uint32_t>();
    const auto nanoseconds = number<std::uint32_t>();
    if (nanoseconds >= second_ns) {
      fail("nanoseconds of a stamp", std::to_string(nanoseconds), "0 .. 999999999");
    }
    ns = second_ns * (cdr_ ? std::int64_t{static_cast<std::int32_t>(seconds)} : seconds) +
         nanoseconds;
  }
  /// Throws ContractError if bytes are left over, except the padding to four bytes that DDS adds.
  void finish() const {
    const std::size_t left = bytes_.size() - at_;
    if (left > (cdr_ ? 3U : 0U)) {
      fail("length", std::to_string(bytes_.size()) + " bytes", std::to_string(at_));
    }
  }

 private:
  [[noreturn]] void fail(std::string_view field, std::string_view value,
                         std::string_view allowed) const {
    throw ContractError(std::string(type_) + " message: " + std::string(field), value, allowed);
  }
  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > bytes_.size() - at_) {
      fail("length", std::to_string(bytes_.size()) + " bytes",
           count < bytes_.size() ? "at least " + std::to_string(at_ + count)
                                 : "room for all that it announces");
    }
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  template <class Number>
  Number number() {
    take(padding(cdr_, at_, sizeof(Number)));
    Number value;
    std::memcpy(&value, take(sizeof(Number)).data(), sizeof(Number));
    return swaps_ ? swap_bytes(value) : value;
  }
  void read_value(std::string& text) {
    auto bytes = take(number<std::uint32_t>());
    if (cdr_ && !bytes.empty()) bytes = bytes.first(bytes.size() - 1);  // without its final zero
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void read_value(std::span<const std::uint8_t>& bulk) { bulk = take(number<std::uint32_t>()); }
  template <class Element>
  void read_value(std::vector<Element>& elements) {
    const auto count = number<std::uint32_t>();
    for (std::uint32_t i = 0; i < count; ++i) read_value(elements.emplace_back());
  }
  template <std::size_t count>
  void read_value(std::array<double, count>& numbers) {
    for (double& each : numbers) each = number<double>();
  }
  template <class Value>
  void read_value(Value& of) {
    if constexpr (std::is_arithmetic_v<Value>) {
      of = number<Value>();
    } else {
      visit_fields(*this, of);
      check(of);
    }
  }

  template <class Value>
  void check(const Value& /*of*/) const {}
  void check(const Pose& pose) const {
    const auto& [p, q] = pose;
    if (!is_position(p.x) || !is_position(p.y) || !is_position(p.z)) {
      fail("position", to_text(p.x) + ", " + to_text(p.y) + ", " + to_text(p.z),
           std::string(position_range));
    }
    const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    if (!(std::abs(length - 1.0) <= quaternion_tolerance)) {
      fail("length of a quaternion", to_text(length), "1");
    }
  }
  void check(const PointStamped& message) const { check(Pose{message.point, {}}); }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::string_view type_;
  bool cdr_;
  bool swaps_ = std::endian::native != std::endian::little;
};

class Writer {
 public:
  explicit Writer(MessageEncoding encoding) : cdr_(encoding == MessageEncoding::cdr) {
    if (cdr_) bytes_ = {0, 1, 0, 0};
  }
  template <class... Values>
  void operator()(const Values&... values) {
    (write_value(values), ...);
  }
  void sequence_number() {
    if (!cdr_) write_value(std::uint32_t{0});
  }
  void stamp(std::int64_t ns) {
    std::int64_t seconds = ns / second_ns;
    if (ns % second_ns < 0) --seconds;
    const auto [low, high] =
        cdr_ ? std::pair<std::int64_t, std::int64_t>{std::numeric_limits<std::int32_t>::min(),
                                                     std::numeric_limits<std::int32_t>::max()}
             : std::pair<std::int64_t, std::int64_t>{0, std::numeric_limits<std::uint32_t>::max()};
    if (seconds < low || seconds > high) {
      throw ContractError("stamp", std::to_string(seconds) + " s",
                          std::to_string(low) + " .. " + std::to_string(high) + " s");
    }
    write_value(static_cast<std::uint32_t>(seconds));
    write_value(static_cast<std::uint32_t>(ns - seconds * second_ns));
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void append(const void* from, std::size_t count) {
    const auto* bytes = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), bytes, bytes + count);
  }
  void write_value(const std::string& text) {
    write_value(static_cast<std::uint32_t>(text.size() + (cdr_ ? 1 : 0)));
    append(text.c_str(), text.size() + (cdr_ ? 1 : 0));
  }
  void write_value(std::span<const std::uint8_t> bulk) {
    write_value(static_cast<std::uint32_t>(bulk.size()));
    append(bulk.data(), bulk.size());
  }
  template <class Element>
  void write_value(const std::vector<Element>& elements) {
    write_value(static_cast<std::uint32_t>(elements.size()));
    for (const auto& element : elements) write_value(element);
  }
  template <std::size_t count>
  void write_value(const std::array<double, count>& numbers) {
    for (const double number : numbers) write_value(number);
  }
  template <class Value>
  void write_value(const Value& of) {
    if constexpr (std::is_arithmetic_v<Value>) {
      bytes_.resize(bytes_.size() + padding(cdr_, bytes_.size(), sizeof(Value)));
      const Value little = std::endian::native == std::endian::little ? of : swap_bytes(of);
      append(&little, sizeof(Value));
    } else {
      visit_fields(*this, of);
    }
  }

  std::vector<std::uint8_t> bytes_;
  bool cdr_;
};

}  // namespace

template <class Message>
Message read_message(std::span<const std::uint8_t> bytes, MessageEncoding encoding) {
  Reader reader(bytes, encoding, Message::type);
  Message message;
  reader(message);
  reader.finish();
  return message;
}

template <class Message>
std::vector<std::uint8_t> write_message(const Message& message, MessageEncoding encoding) {
  Writer writer(encoding);
  writer(message);
  return writer.take();
}

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define PANONAV_ROS_MESSAGE(Message)                                                      \
  template Message read_message<Message>(std::span<const std::uint8_t>, MessageEncoding); \
  template std::vector<std::uint8_t> write_message<Message>(const Message&, MessageEncoding)
PANONAV_ROS_MESSAGE(Image);
PANONAV_ROS_MESSAGE(CompressedImage);
PANONAV_ROS_MESSAGE(FoxgloveRawImage);
PANONAV_ROS_MESSAGE(FoxgloveCompressedImage);
PANONAV_ROS_MESSAGE(FfmpegPacket);
PANONAV_ROS_MESSAGE(Imu);
PANONAV_ROS_MESSAGE(PointCloud2);
PANONAV_ROS_MESSAGE(Odometry);
PANONAV_ROS_MESSAGE(Path);
PANONAV_ROS_MESSAGE(OccupancyGrid);
PANONAV_ROS_MESSAGE(LaserScan);
PANONAV_ROS_MESSAGE(TFMessage);
PANONAV_ROS_MESSAGE(TransformStamped);
PANONAV_ROS_MESSAGE(PointStamped);
PANONAV_ROS_MESSAGE(PoseStamped);
PANONAV_ROS_MESSAGE(PoseWithCovarianceStamped);
PANONAV_ROS_MESSAGE(PoseArray);
PANONAV_ROS_MESSAGE(DiagnosticArray);
PANONAV_ROS_MESSAGE(Twist);
PANONAV_ROS_MESSAGE(Clock);
PANONAV_ROS_MESSAGE(String);
#undef PANONAV_ROS_MESSAGE

}  // namespace panonav::recordings::ros
