#include "panonav_recordings/ros_messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstring>
#include <limits>
#include <numbers>
#include <type_traits>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::recordings::ros {

namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::size_t encapsulation_bytes = 4;  // of CDR: representation, options

template <class M, class T>
concept Is = std::same_as<std::remove_const_t<M>, T>;

// The members of each message in the order of its .msg file; readers and writers are `a`.

template <class A>
void fields(A& a, Is<Header> auto& m) {
  a.sequence_number();
  a.stamp(m.stamp_ns);
  a(m.frame_id);
}
template <class A>
void fields(A& a, Is<Vector3> auto& m) {
  a(m.x, m.y, m.z);
}
template <class A>
void fields(A& a, Is<Quaternion> auto& m) {
  a(m.x, m.y, m.z, m.w);
}
template <class A>
void fields(A& a, Is<Pose> auto& m) {
  a(m.position, m.orientation);
}
template <class A>
void fields(A& a, Is<Image> auto& m) {
  a(m.header, m.height, m.width, m.encoding, m.is_bigendian, m.step, m.data);
}
template <class A>
void fields(A& a, Is<CompressedImage> auto& m) {
  a(m.header, m.format, m.data);
}
template <class A>
void fields(A& a, Is<Imu> auto& m) {
  a(m.header, m.orientation, m.orientation_covariance, m.angular_velocity,
    m.angular_velocity_covariance, m.linear_acceleration, m.linear_acceleration_covariance);
}
template <class A>
void fields(A& a, Is<PoseWithCovariance> auto& m) {
  a(m.pose, m.covariance);
}
template <class A>
void fields(A& a, Is<Odometry> auto& m) {
  a(m.header, m.child_frame_id, m.pose, m.linear_velocity, m.angular_velocity, m.twist_covariance);
}
template <class A>
void fields(A& a, Is<TransformStamped> auto& m) {
  a(m.header, m.child_frame_id, m.transform);
}
template <class A>
void fields(A& a, Is<TFMessage> auto& m) {
  a(m.transforms);
}
template <class A>
void fields(A& a, Is<PointStamped> auto& m) {
  a(m.header, m.point);
}
template <class A>
void fields(A& a, Is<PoseStamped> auto& m) {
  a(m.header, m.pose);
}
template <class A>
void fields(A& a, Is<PoseWithCovarianceStamped> auto& m) {
  a(m.header, m.pose);
}
template <class A>
void fields(A& a, Is<PoseArray> auto& m) {
  a(m.header, m.poses);
}
template <class A>
void fields(A& a, Is<Path> auto& m) {
  a(m.header, m.poses);
}
template <class A>
void fields(A& a, Is<PointField> auto& m) {
  a(m.name, m.offset, m.datatype, m.count);
}
template <class A>
void fields(A& a, Is<PointCloud2> auto& m) {
  a(m.header, m.height, m.width, m.fields, m.is_bigendian, m.point_step, m.row_step, m.data,
    m.is_dense);
}
template <class A>
void fields(A& a, Is<OccupancyGrid> auto& m) {
  a(m.header);
  a.stamp(m.map_load_time_ns);
  a(m.resolution, m.width, m.height, m.origin, m.cells);
}
template <class A>
void fields(A& a, Is<KeyValue> auto& m) {
  a(m.key, m.value);
}
template <class A>
void fields(A& a, Is<DiagnosticStatus> auto& m) {
  a(m.level, m.name, m.message, m.hardware_id, m.values);
}
template <class A>
void fields(A& a, Is<DiagnosticArray> auto& m) {
  a(m.header, m.status);
}
template <class A>
void fields(A& a, Is<Twist> auto& m) {
  a(m.linear, m.angular);
}
template <class A>
void fields(A& a, Is<Clock> auto& m) {
  a.stamp(m.clock_ns);
}
template <class A>
void fields(A& a, Is<String> auto& m) {
  a(m.data);
}

template <class Number>
Number swapped(Number value) {
  auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof(Number)>>(value);
  std::ranges::reverse(bytes);
  return std::bit_cast<Number>(bytes);
}

// A value of n bytes starts at a multiple of n behind the encapsulation header; ROS 1 packs.
std::size_t padding(bool aligned, std::size_t at, std::size_t size) {
  return aligned ? (size - (at - encapsulation_bytes) % size) % size : 0;
}

class Reader {
 public:
  Reader(std::span<const std::uint8_t> bytes, MessageEncoding encoding, std::string_view type)
      : bytes_(bytes), type_(type), cdr_(encoding == MessageEncoding::cdr) {
    if (encoding == MessageEncoding::other) fail("encoding", "other", "ros1, cdr");
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
    (value(values), ...);
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
  /// A DDS rounds its messages up to four bytes.
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
    return swaps_ ? swapped(value) : value;
  }
  void value(std::string& text) {
    auto bytes = take(number<std::uint32_t>());
    if (cdr_ && !bytes.empty()) bytes = bytes.first(bytes.size() - 1);  // its final zero
    text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  }
  void value(std::span<const std::uint8_t>& bulk) { bulk = take(number<std::uint32_t>()); }
  template <class Element>
  void value(std::vector<Element>& elements) {
    const auto count = number<std::uint32_t>();
    for (std::uint32_t i = 0; i < count; ++i) value(elements.emplace_back());
  }
  template <std::size_t count>
  void value(std::array<double, count>& numbers) {
    for (double& each : numbers) each = number<double>();
  }
  template <class Value>
  void value(Value& of) {
    if constexpr (std::is_arithmetic_v<Value>) {
      of = number<Value>();
    } else {
      fields(*this, of);
      check(of);
    }
  }

  template <class Value>
  void check(const Value& /*of*/) const {}
  void check(const Pose& pose) const {
    const auto& [p, q] = pose;
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      fail("position", to_text(p.x) + ", " + to_text(p.y) + ", " + to_text(p.z), "finite");
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
    (value(values), ...);
  }
  void sequence_number() {
    if (!cdr_) value(std::uint32_t{0});
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
    value(static_cast<std::uint32_t>(seconds));
    value(static_cast<std::uint32_t>(ns - seconds * second_ns));
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  void append(const void* from, std::size_t count) {
    const auto* bytes = static_cast<const std::uint8_t*>(from);
    bytes_.insert(bytes_.end(), bytes, bytes + count);
  }
  void value(const std::string& text) {
    value(static_cast<std::uint32_t>(text.size() + (cdr_ ? 1 : 0)));
    append(text.c_str(), text.size() + (cdr_ ? 1 : 0));
  }
  void value(std::span<const std::uint8_t> bulk) {
    value(static_cast<std::uint32_t>(bulk.size()));
    append(bulk.data(), bulk.size());
  }
  template <class Element>
  void value(const std::vector<Element>& elements) {
    value(static_cast<std::uint32_t>(elements.size()));
    for (const auto& element : elements) value(element);
  }
  template <std::size_t count>
  void value(const std::array<double, count>& numbers) {
    for (const double number : numbers) value(number);
  }
  template <class Value>
  void value(const Value& of) {
    if constexpr (std::is_arithmetic_v<Value>) {
      bytes_.resize(bytes_.size() + padding(cdr_, bytes_.size(), sizeof(Value)));
      const Value little = std::endian::native == std::endian::little ? of : swapped(of);
      append(&little, sizeof(Value));
    } else {
      fields(*this, of);
    }
  }

  std::vector<std::uint8_t> bytes_;
  bool cdr_;
};

struct Definition {
  std::string_view type;
  std::string_view text;
};

// From ROS 2's common_interfaces, without comments (Apache-2.0). `uint8 FLOAT32=7` and the like are
// constants, which take no room.
constexpr std::array definitions{
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    Definition{"geometry_msgs/Pose",
               "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{"geometry_msgs/Twist",
               "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    Definition{"geometry_msgs/Transform",
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{"geometry_msgs/PoseWithCovariance",
               "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/TwistWithCovariance",
               "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\n"
               "geometry_msgs/Transform transform\n"},
    Definition{"geometry_msgs/PointStamped", "std_msgs/Header header\ngeometry_msgs/Point point\n"},
    Definition{"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    Definition{"geometry_msgs/PoseWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
    Definition{"geometry_msgs/PoseArray", "std_msgs/Header header\ngeometry_msgs/Pose[] poses\n"},
    Definition{"sensor_msgs/Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
               "uint8 is_bigendian\nuint32 step\nuint8[] data\n"},
    Definition{"sensor_msgs/CompressedImage",
               "std_msgs/Header header\nstring format\nuint8[] data\n"},
    Definition{"sensor_msgs/Imu",
               "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
               "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
               "float64[9] angular_velocity_covariance\n"
               "geometry_msgs/Vector3 linear_acceleration\n"
               "float64[9] linear_acceleration_covariance\n"},
    Definition{"sensor_msgs/PointField",
               "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\n"
               "uint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\n"
               "uint8 datatype\nuint32 count\n"},
    Definition{"sensor_msgs/PointCloud2",
               "std_msgs/Header header\nuint32 height\nuint32 width\n"
               "sensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n"
               "uint32 row_step\nuint8[] data\nbool is_dense\n"},
    Definition{"nav_msgs/Odometry",
               "std_msgs/Header header\nstring child_frame_id\n"
               "geometry_msgs/PoseWithCovariance pose\n"
               "geometry_msgs/TwistWithCovariance twist\n"},
    Definition{"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    Definition{"nav_msgs/MapMetaData",
               "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\n"
               "uint32 height\ngeometry_msgs/Pose origin\n"},
    Definition{"nav_msgs/OccupancyGrid",
               "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data\n"},
    Definition{"rosgraph_msgs/Clock", "builtin_interfaces/Time clock\n"},
    Definition{"std_msgs/String", "string data\n"},
    Definition{"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    Definition{"diagnostic_msgs/DiagnosticStatus",
               "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
               "string message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
    Definition{"diagnostic_msgs/DiagnosticArray",
               "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
};

const Definition& definition_of(std::string_view type) {
  const auto found = std::ranges::find(definitions, type, &Definition::type);
  if (found != definitions.end()) return *found;
  std::string known;
  for (const auto& each : definitions)
    known += (known.empty() ? "" : ", ") + std::string(each.type);
  throw ContractError("message type", readable_line(type), known);
}

double dot(const Quaternion& a, const Quaternion& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

Quaternion operator*(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

Vector3 rotated(const Quaternion& q, const Vector3& v) {
  const Quaternion turned = q * Quaternion{v.x, v.y, v.z, 0.0} * Quaternion{-q.x, -q.y, -q.z, q.w};
  const double scale = 1.0 / dot(q, q);
  return {scale * turned.x, scale * turned.y, scale * turned.z};
}

}  // namespace

Pose operator*(const Pose& a_from_b, const Pose& b_from_c) {
  const Vector3 moved = rotated(a_from_b.orientation, b_from_c.position);
  const Vector3& at = a_from_b.position;
  return {{at.x + moved.x, at.y + moved.y, at.z + moved.z},
          a_from_b.orientation * b_from_c.orientation};
}

Pose inverse(const Pose& a_from_b) {
  const Quaternion& q = a_from_b.orientation;
  const Quaternion back{-q.x, -q.y, -q.z, q.w};
  const Vector3 at = rotated(back, a_from_b.position);
  return {{-at.x, -at.y, -at.z}, back};
}

Pose between(const Pose& a, const Pose& b, double share) {
  if (share == 0.0) return a;
  if (share == 1.0) return b;
  const Quaternion& q = a.orientation;
  const Quaternion& r = b.orientation;
  const double cosine = dot(q, r) / std::sqrt(dot(q, q) * dot(r, r));
  const double angle = std::acos(std::min(std::abs(cosine), 1.0));
  // The two quaternions of one orientation differ in sign; the shorter way counts.
  const double sign = cosine < 0.0 ? -1.0 : 1.0;
  constexpr double straight_rad = 1e-6;
  const double of_a = angle < straight_rad ? 1.0 - share : std::sin((1.0 - share) * angle);
  const double of_b = sign * (angle < straight_rad ? share : std::sin(share * angle));
  Quaternion mixed{of_a * q.x + of_b * r.x, of_a * q.y + of_b * r.y, of_a * q.z + of_b * r.z,
                   of_a * q.w + of_b * r.w};
  const double scale = 1.0 / std::sqrt(dot(mixed, mixed));
  mixed = {scale * mixed.x, scale * mixed.y, scale * mixed.z, scale * mixed.w};
  return {
      {std::lerp(a.position.x, b.position.x, share), std::lerp(a.position.y, b.position.y, share),
       std::lerp(a.position.z, b.position.z, share)},
      mixed};
}

Pose pose_of(const Pose2& pose, const Tilt& tilt) {
  const auto about = [](double angle_rad) {
    return std::pair{std::sin(0.5 * angle_rad), std::cos(0.5 * angle_rad)};
  };
  const auto [sz, cz] = about(pose.heading_rad);
  const auto [sy, cy] = about(tilt.pitch_rad);
  const auto [sx, cx] = about(tilt.roll_rad);
  return {
      {pose.x_m, pose.y_m, 0.0},
      Quaternion{0.0, 0.0, sz, cz} * Quaternion{0.0, sy, 0.0, cy} * Quaternion{sx, 0.0, 0.0, cx}};
}

Pose2 planar(const Pose& pose) {
  const auto& [x, y, z, w] = pose.orientation;
  return {pose.position.x, pose.position.y,
          wrap_angle(std::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z))};
}

Tilt tilt_of(const Quaternion& orientation) {
  const auto& [x, y, z, w] = orientation;
  const double sine = 2.0 * (w * y - z * x) / dot(orientation, orientation);
  return {std::atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z),
          std::asin(std::clamp(sine, -1.0, 1.0))};
}

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
PANONAV_ROS_MESSAGE(Imu);
PANONAV_ROS_MESSAGE(PointCloud2);
PANONAV_ROS_MESSAGE(Odometry);
PANONAV_ROS_MESSAGE(Path);
PANONAV_ROS_MESSAGE(OccupancyGrid);
PANONAV_ROS_MESSAGE(TFMessage);
PANONAV_ROS_MESSAGE(PointStamped);
PANONAV_ROS_MESSAGE(PoseStamped);
PANONAV_ROS_MESSAGE(PoseWithCovarianceStamped);
PANONAV_ROS_MESSAGE(PoseArray);
PANONAV_ROS_MESSAGE(DiagnosticArray);
PANONAV_ROS_MESSAGE(Twist);
PANONAV_ROS_MESSAGE(Clock);
PANONAV_ROS_MESSAGE(String);
#undef PANONAV_ROS_MESSAGE

std::string ros2_type_name(std::string_view type) {
  const std::size_t package = type.find('/');
  if (package == std::string_view::npos) {
    throw ContractError("message type", readable_line(type), "PACKAGE/NAME");
  }
  return std::string(type.substr(0, package)) + "/msg" + std::string(type.substr(package));
}

std::string ros2_schema(std::string_view type) {
  std::vector<std::string_view> types{type};
  std::string schema;
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::string_view text = definition_of(types[i]).text;
    if (i > 0) {
      schema += std::string(80, '=') + "\nMSG: " + std::string(types[i]) + "\n";
    }
    schema += text;
    for (std::size_t line = 0; line < text.size(); line = text.find('\n', line) + 1) {
      const std::string_view word = text.substr(line, text.find_first_of(" [", line) - line);
      if (word.find('/') == std::string_view::npos) continue;
      if (std::ranges::find(types, word) == types.end()) types.push_back(word);
    }
  }
  return schema;
}

}  // namespace panonav::recordings::ros
