#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/recording.hpp"
#include "panonav/panorama/tilt.hpp"

/// The messages of ROS that panonav reads and writes, as plain values. Members are named and
/// ordered as in the .msg files, `type` is the type's name; a stamp is one number, `seq` of ROS 1
/// is left out. Bulk data (pictures, clouds) belongs to somebody else: of a message that was read,
/// to its bytes.
namespace panonav::ros {

struct Header {
  std::int64_t stamp_ns = 0;  ///< since 1970, or since the start of a simulation
  std::string frame_id;
};

struct Vector3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
};

struct Quaternion {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double w = 1.0;
};

struct Pose {
  Vector3 position;
  Quaternion orientation;
};

/// How far the length of a quaternion that is read may be from 1; as tf2's.
inline constexpr double quaternion_tolerance = 0.1;

/// A pose, or a transform parent_from_child: q_parent = position + orientation * q_child.
[[nodiscard]] Pose operator*(const Pose& a_from_b, const Pose& b_from_c);
[[nodiscard]] Pose inverse(const Pose& a_from_b);
/// On the line between the positions and on the great circle between the orientations; `share` 0
/// gives the bits of `a`, 1 those of `b`; beyond them the motion goes on.
[[nodiscard]] Pose between(const Pose& a, const Pose& b, double share);
/// Heading about the vertical, then roll and pitch as in `Tilt`: R_z(heading) R_y R_x.
[[nodiscard]] Pose pose_of(const Pose2& pose, const Tilt& tilt = {});
[[nodiscard]] Pose2 planar(const Pose& pose);
[[nodiscard]] Tilt tilt_of(const Quaternion& orientation);

using Covariance3 = std::array<double, 9>;   ///< row-major; [0] = -1: there is no such measurement
using Covariance6 = std::array<double, 36>;  ///< row-major, x y z and turns about x, y, z

struct Image {
  static constexpr std::string_view type = "sensor_msgs/Image";
  Header header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  ///< bytes from one row to the next
  std::span<const std::uint8_t> data;
};

struct CompressedImage {
  static constexpr std::string_view type = "sensor_msgs/CompressedImage";
  Header header;
  std::string format;  ///< "jpeg", "png", "rgb8; jpeg compressed bgr8"
  std::span<const std::uint8_t> data;
};

struct Imu {
  static constexpr std::string_view type = "sensor_msgs/Imu";
  Header header;
  Quaternion orientation;
  Covariance3 orientation_covariance{};
  Vector3 angular_velocity;  ///< rad/s
  Covariance3 angular_velocity_covariance{};
  Vector3 linear_acceleration;  ///< m/s^2
  Covariance3 linear_acceleration_covariance{};
};

struct PoseWithCovariance {
  Pose pose;
  Covariance6 covariance{};
};

struct Odometry {
  static constexpr std::string_view type = "nav_msgs/Odometry";
  Header header;  ///< frame_id: of the odometry
  std::string child_frame_id;
  PoseWithCovariance pose;
  Vector3 linear_velocity;   ///< m/s, in the child frame
  Vector3 angular_velocity;  ///< rad/s
  Covariance6 twist_covariance{};
};

struct TransformStamped {
  Header header;  ///< frame_id: the parent
  std::string child_frame_id;
  Pose transform;
};

/// tf2_msgs/TFMessage, and tf/tfMessage of ROS 1.
struct TFMessage {
  static constexpr std::string_view type = "tf2_msgs/TFMessage";
  std::vector<TransformStamped> transforms;
};

struct PointStamped {
  static constexpr std::string_view type = "geometry_msgs/PointStamped";
  Header header;
  Vector3 point;
};

struct PoseStamped {
  static constexpr std::string_view type = "geometry_msgs/PoseStamped";
  Header header;
  Pose pose;
};

struct PoseWithCovarianceStamped {
  static constexpr std::string_view type = "geometry_msgs/PoseWithCovarianceStamped";
  Header header;
  PoseWithCovariance pose;
};

struct PoseArray {
  static constexpr std::string_view type = "geometry_msgs/PoseArray";
  Header header;
  std::vector<Pose> poses;
};

struct Path {
  static constexpr std::string_view type = "nav_msgs/Path";
  Header header;
  std::vector<PoseStamped> poses;
};

struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 7;  ///< 2 UINT8, 6 UINT32, 7 FLOAT32, 8 FLOAT64
  std::uint32_t count = 1;
};

struct PointCloud2 {
  static constexpr std::string_view type = "sensor_msgs/PointCloud2";
  Header header;
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<PointField> fields;
  std::uint8_t is_bigendian = 0;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::span<const std::uint8_t> data;
  std::uint8_t is_dense = 1;
};

struct OccupancyGrid {
  static constexpr std::string_view type = "nav_msgs/OccupancyGrid";
  Header header;
  std::int64_t map_load_time_ns = 0;
  float resolution = 0.0F;  ///< m
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  Pose origin;                     ///< of the corner of cell (0, 0)
  std::vector<std::int8_t> cells;  ///< row-major; 0 .. 100, -1 unknown
};

struct KeyValue {
  std::string key;
  std::string value;
};

struct DiagnosticStatus {
  std::uint8_t level = 0;  ///< 0 fine, 1 warning, 2 error, 3 stale
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<KeyValue> values;
};

struct DiagnosticArray {
  static constexpr std::string_view type = "diagnostic_msgs/DiagnosticArray";
  Header header;
  std::vector<DiagnosticStatus> status;
};

struct Twist {
  static constexpr std::string_view type = "geometry_msgs/Twist";
  Vector3 linear;   ///< m/s, in the robot's frame
  Vector3 angular;  ///< rad/s
};

struct Clock {
  static constexpr std::string_view type = "rosgraph_msgs/Clock";
  std::int64_t clock_ns = 0;
};

struct String {
  static constexpr std::string_view type = "std_msgs/String";
  std::string data;
};

/// What ROS 2 calls the `type` of a message: "sensor_msgs/msg/Image".
[[nodiscard]] std::string ros2_type_name(std::string_view type);

/// The message that the bytes are, in ROS 1's serialisation or as CDR of either byte order (XCDR1,
/// as ROS 2 writes it). Memory: at most some 20 times the bytes, whatever they say. Throws
/// ContractError, one line, on bytes that end too early or too late, on stamps out of range and on
/// poses (of Odometry, transforms, points and poses) that are not finite or whose quaternion is
/// not near unit length.
template <class Message>
[[nodiscard]] Message read_message(std::span<const std::uint8_t> bytes, MessageEncoding encoding);

/// Little endian. Throws ContractError on a stamp that the encoding cannot hold (ROS 2: beyond
/// 2038).
template <class Message>
[[nodiscard]] std::vector<std::uint8_t> write_message(
    const Message& message, MessageEncoding encoding = MessageEncoding::cdr);

/// What MCAP wants as "ros2msg" of a type above: its definition, then those of all types that it
/// is made of. Throws ContractError on another type.
[[nodiscard]] std::string ros2_schema(std::string_view type);

/// The pixels as `read_image` gives them: one channel for grey, three for colour.
/// - mono8, 8UC1: as they are. mono16: scaled from 0 .. 65535 as a PNG of 16 bits is.
/// - rgb8, bgr8, rgba8, bgra8, 8UC3 and 8UC4 (OpenCV's order: blue first): alpha is dropped.
/// - bayer_rggb8, bayer_bggr8, bayer_gbrg8, bayer_grbg8: bilinear interpolation.
/// - yuv422 or uyvy, yuv422_yuy2 or yuyv: ITU-R BT.601, luma 16 .. 235, as OpenCV takes them.
/// Throws ContractError on other encodings, sizes beyond the limits, a step shorter than a row and
/// data of another length than height x step.
[[nodiscard]] panonav::Image picture_of(const Image& message, const ImageLimits& limits = {});
/// JPEG or PNG, told apart by content. `name` stands in errors. Throws ContractError on another
/// format (compressedDepth, h264), FileError on bytes that cannot be decoded.
[[nodiscard]] panonav::Image picture_of(const CompressedImage& message, std::string_view name,
                                        const ImageLimits& limits = {});

}  // namespace panonav::ros
