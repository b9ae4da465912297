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
#include "panonav/panorama/tilt.hpp"
#include "panonav_recordings/recording.hpp"

/// The messages of ROS that panonav reads and writes, as plain values. Members are named and
/// ordered as in the .msg files, and `type` is ROS 1's name of the type. A stamp is one number, and
/// `seq` of ROS 1 is left out. Bulk data (pictures, clouds) is not owned: after `read_message` it
/// points into the bytes that were read.
namespace panonav::recordings::ros {

/// The type std_msgs/Header: a time and a frame of coordinates.
struct Header {
  std::int64_t stamp_ns = 0;  ///< since 1970, or since the start of a simulation
  std::string frame_id;       ///< name of the frame of coordinates
};

/// The types geometry_msgs/Vector3 and geometry_msgs/Point: x forward, y left, z up in frames of
/// robots.
struct Vector3 {
  double x = 0.0;  ///< in the unit of the message's member
  double y = 0.0;  ///< in the same unit
  double z = 0.0;  ///< in the same unit
};

/// The type geometry_msgs/Quaternion: a rotation, of unit length.
struct Quaternion {
  double x = 0.0;  ///< x of the axis, times the sine of half the angle
  double y = 0.0;  ///< the same along y
  double z = 0.0;  ///< the same along z
  double w = 1.0;  ///< cosine of half the angle
};

/// The types geometry_msgs/Pose and geometry_msgs/Transform.
struct Pose {
  Vector3 position;        ///< metres
  Quaternion orientation;  ///< of unit length
};

/// Tolerance of the length of a quaternion that is read, which should be 1; the same as in tf2.
inline constexpr double quaternion_tolerance = 0.1;

/// Composes poses, or transforms parent_from_child: q_parent = position + orientation * q_child.
[[nodiscard]] Pose operator*(const Pose& a_from_b, const Pose& b_from_c);
/// Returns the inverse transform, b_from_a. The orientation must be of unit length.
[[nodiscard]] Pose inverse(const Pose& a_from_b);
/// Interpolates positions linearly and orientations along the shorter rotation (slerp). `share` 0
/// returns exactly `a`, 1 exactly `b`; values outside of 0 .. 1 extrapolate.
[[nodiscard]] Pose interpolate(const Pose& a, const Pose& b, double share);
/// Returns the pose with this heading, then roll and pitch as in `Tilt`: R_z(heading) R_y(pitch)
/// R_x(roll).
[[nodiscard]] Pose to_pose(const Pose2& pose, const Tilt& tilt = {});
/// Projects the pose to the floor: x, y and yaw.
[[nodiscard]] Pose2 to_pose2(const Pose& pose);
/// Returns roll and pitch, in radians, of any quaternion but zero, whatever its length.
[[nodiscard]] Tilt to_tilt(const Quaternion& orientation);

using Covariance3 = std::array<double, 9>;   ///< row-major; [0] = -1: no measurement
using Covariance6 = std::array<double, 36>;  ///< row-major; x, y, z and rotations about them

/// A picture as pixels.
struct Image {
  static constexpr std::string_view type = "sensor_msgs/Image";  ///< ROS 1's name of the type
  Header header;                  ///< when it was taken; frame of the camera
  std::uint32_t height = 0;       ///< rows
  std::uint32_t width = 0;        ///< columns
  std::string encoding;           ///< pixel encoding, see `to_image`
  std::uint8_t is_bigendian = 0;  ///< 1: numbers of several bytes begin with the most significant
  std::uint32_t step = 0;         ///< bytes from one row to the next
  std::span<const std::uint8_t> data;  ///< height x step bytes, rows from the top
};

/// A picture as a file.
struct CompressedImage {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "sensor_msgs/CompressedImage";
  Header header;                       ///< when it was taken; frame of the camera
  std::string format;                  ///< "jpeg", "png", "rgb8; jpeg compressed bgr8"
  std::span<const std::uint8_t> data;  ///< the bytes of the file
};

/// The type foxglove_msgs/RawImage: pixels, as in `Image` with numbers of the least significant
/// byte first.
struct FoxgloveRawImage {
  static constexpr std::string_view type = "foxglove_msgs/RawImage";  ///< ROS 1's name of the type
  std::int64_t stamp_ns = 0;                                          ///< when it was taken
  std::string frame_id;                                               ///< frame of the camera
  std::uint32_t width = 0;                                            ///< columns
  std::uint32_t height = 0;                                           ///< rows
  std::string encoding;                ///< pixel encoding, see `to_image`
  std::uint32_t step = 0;              ///< bytes from one row to the next
  std::span<const std::uint8_t> data;  ///< height x step bytes, rows from the top
};

/// The types foxglove_msgs/CompressedImage, a picture as a file, and foxglove_msgs/CompressedVideo,
/// a packet of a video.
struct FoxgloveCompressedImage {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "foxglove_msgs/CompressedImage";
  std::int64_t stamp_ns = 0;           ///< when it was taken
  std::string frame_id;                ///< frame of the camera
  std::span<const std::uint8_t> data;  ///< the bytes of the file or packet
  std::string format;                  ///< "jpeg", "png", "h264", "h265"
};

/// A packet of a video, of the package ffmpeg_image_transport.
struct FfmpegPacket {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "ffmpeg_image_transport_msgs/FFMPEGPacket";
  Header header;                       ///< when it was taken; frame of the camera
  std::int32_t width = 0;              ///< columns
  std::int32_t height = 0;             ///< rows
  std::string encoding;                ///< "h264", "hevc", or with further words: "h264;yuv420p"
  std::uint64_t pts = 0;               ///< number of the packet
  std::uint8_t flags = 0;              ///< 1: a key frame
  std::uint8_t is_bigendian = 0;       ///< unused
  std::span<const std::uint8_t> data;  ///< the bytes of the packet
};

/// Measurements of an inertial sensor.
struct Imu {
  static constexpr std::string_view type = "sensor_msgs/Imu";  ///< ROS 1's name of the type
  Header header;                                 ///< when it was measured; frame of the sensor
  Quaternion orientation;                        ///< of the sensor in a level frame
  Covariance3 orientation_covariance{};          ///< of rotations about x, y, z, rad^2
  Vector3 angular_velocity;                      ///< rad/s
  Covariance3 angular_velocity_covariance{};     ///< rad^2/s^2
  Vector3 linear_acceleration;                   ///< m/s^2
  Covariance3 linear_acceleration_covariance{};  ///< m^2/s^4
};

/// A pose and its covariance.
struct PoseWithCovariance {
  Pose pose;                 ///< in the frame of the message
  Covariance6 covariance{};  ///< m^2, m rad and rad^2
};

/// Pose of the robot by wheel odometry, or by another estimate that needs no map.
struct Odometry {
  static constexpr std::string_view type = "nav_msgs/Odometry";  ///< ROS 1's name of the type
  Header header;                                                 ///< frame_id: of the odometry
  std::string child_frame_id;                                    ///< frame of the robot
  PoseWithCovariance pose;                                       ///< odometry_from_child
  Vector3 linear_velocity;                                       ///< m/s, in the child frame
  Vector3 angular_velocity;                                      ///< rad/s
  Covariance6 twist_covariance{};  ///< of both velocities, linear first
};

/// Pose of one frame in another at a time.
struct TransformStamped {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "geometry_msgs/TransformStamped";
  Header header;               ///< frame_id: the parent
  std::string child_frame_id;  ///< the child frame
  Pose transform;              ///< parent_from_child
};

/// tf2_msgs/TFMessage, and tf/tfMessage of ROS 1.
struct TFMessage {
  static constexpr std::string_view type = "tf2_msgs/TFMessage";  ///< ROS 1's name of the type
  std::vector<TransformStamped> transforms;                       ///< one or several, of any frames
};

/// A point at a time.
struct PointStamped {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "geometry_msgs/PointStamped";
  Header header;  ///< when, and the frame of the point
  Vector3 point;  ///< metres
};

/// A pose with its time stamp and frame.
struct PoseStamped {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "geometry_msgs/PoseStamped";
  Header header;  ///< when, and the frame of the pose
  Pose pose;      ///< in the frame of the header
};

/// A pose with its covariance, time stamp and frame.
struct PoseWithCovarianceStamped {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "geometry_msgs/PoseWithCovarianceStamped";
  Header header;            ///< when, and the frame of the pose
  PoseWithCovariance pose;  ///< in the frame of the header
};

/// Several poses at a time, such as particles.
struct PoseArray {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "geometry_msgs/PoseArray";
  Header header;            ///< when, and the frame of the poses
  std::vector<Pose> poses;  ///< in the frame of the header
};

/// Poses in the order in which a robot passes them, such as a plan.
struct Path {
  static constexpr std::string_view type = "nav_msgs/Path";  ///< ROS 1's name of the type
  Header header;                   ///< when it was made, and the frame of the poses
  std::vector<PoseStamped> poses;  ///< in the order in which they are passed
};

/// One value of each point of a cloud.
struct PointField {
  std::string name;           ///< "x", "y", "z", or another quantity
  std::uint32_t offset = 0;   ///< bytes from the beginning of a point
  std::uint8_t datatype = 7;  ///< 2 UINT8, 6 UINT32, 7 FLOAT32, 8 FLOAT64
  std::uint32_t count = 1;    ///< number of values of that type
};

/// Points, each with the same fields, packed into bytes.
struct PointCloud2 {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "sensor_msgs/PointCloud2";
  Header header;                       ///< when, and the frame of the points
  std::uint32_t height = 1;            ///< 1: the points have no order
  std::uint32_t width = 0;             ///< points in a row
  std::vector<PointField> fields;      ///< layout of a point
  std::uint8_t is_bigendian = 0;       ///< 1: numbers begin with the most significant byte
  std::uint32_t point_step = 0;        ///< bytes of a point
  std::uint32_t row_step = 0;          ///< bytes of a row: width x point_step
  std::span<const std::uint8_t> data;  ///< height x row_step bytes
  std::uint8_t is_dense = 1;           ///< 1: no value is NaN
};

/// A map of the floor in square cells, occupied or free.
struct OccupancyGrid {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "nav_msgs/OccupancyGrid";
  Header header;  ///< when, and the frame of `origin`
  /// Nanoseconds since 1970, or since the start of a simulation.
  std::int64_t map_load_time_ns = 0;
  float resolution = 0.0F;         ///< m
  std::uint32_t width = 0;         ///< cells along x
  std::uint32_t height = 0;        ///< cells along y
  Pose origin;                     ///< pose of the corner of cell (0, 0)
  std::vector<std::int8_t> cells;  ///< row-major; 0 .. 100, -1 unknown
};

/// Distances to the nearest obstacles in a plane, at equal steps of azimuth.
struct LaserScan {
  static constexpr std::string_view type = "sensor_msgs/LaserScan";  ///< ROS 1's name of the type
  Header header;                   ///< when the first distance was measured; frame of the sensor
  float angle_min = 0.0F;          ///< azimuth of the first distance, rad, counter-clockwise
  float angle_max = 0.0F;          ///< azimuth of the last one, rad
  float angle_increment = 0.0F;    ///< rad
  float time_increment = 0.0F;     ///< s between successive distances
  float scan_time = 0.0F;          ///< s between scans; 0: unknown
  float range_min = 0.0F;          ///< smallest distance that can be measured, m
  float range_max = 0.0F;          ///< largest distance that can be measured, m
  std::vector<float> ranges;       ///< m; infinity: nothing up to `range_max`; NaN: not measured
  std::vector<float> intensities;  ///< one for each distance, or none
};

/// A key and its value.
struct KeyValue {
  std::string key;    ///< unique within a status
  std::string value;  ///< as text
};

/// State of one part of a robot.
struct DiagnosticStatus {
  std::uint8_t level = 0;        ///< 0 fine, 1 warning, 2 error, 3 stale
  std::string name;              ///< of the part
  std::string message;           ///< one line for people
  std::string hardware_id;       ///< of the device; may be empty
  std::vector<KeyValue> values;  ///< details of the message
};

/// States of the parts of a robot.
struct DiagnosticArray {
  /// ROS 1's name of the type.
  static constexpr std::string_view type = "diagnostic_msgs/DiagnosticArray";
  Header header;                         ///< time; its frame is unused
  std::vector<DiagnosticStatus> status;  ///< one for each part
};

/// Linear and angular velocity in three dimensions.
struct Twist {
  static constexpr std::string_view type = "geometry_msgs/Twist";  ///< ROS 1's name of the type
  Vector3 linear;                                                  ///< m/s, in the robot's frame
  Vector3 angular;                                                 ///< rad/s
};

/// The time of a simulation or a replay.
struct Clock {
  static constexpr std::string_view type = "rosgraph_msgs/Clock";  ///< ROS 1's name of the type
  std::int64_t clock_ns = 0;                                       ///< nanoseconds since its start
};

/// A text as a message.
struct String {
  static constexpr std::string_view type = "std_msgs/String";  ///< ROS 1's name of the type
  std::string data;                                            ///< UTF-8
};

/// Returns ROS 2's name of a message type: "sensor_msgs/msg/Image" for "sensor_msgs/Image".
[[nodiscard]] std::string ros2_type_name(std::string_view type);

/// Reads a message in ROS 1's serialisation or as CDR of either byte order (XCDR1, as ROS 2 writes
/// it). Memory: at most about 20 times the bytes. Throws ContractError of one line if bytes are
/// missing or left over, a stamp is out of range, or a pose (of Odometry, transforms, points and
/// poses) is not finite or its quaternion not near unit length.
template <class Message>
[[nodiscard]] Message read_message(std::span<const std::uint8_t> bytes, MessageEncoding encoding);

/// Writes a message, little endian. Throws ContractError if the encoding cannot hold a stamp (ROS
/// 2: beyond 2038).
template <class Message>
[[nodiscard]] std::vector<std::uint8_t> write_message(
    const Message& message, MessageEncoding encoding = MessageEncoding::cdr);

/// Returns the "ros2msg" schema of a type above for MCAP: its definition, followed by those of all
/// types in it. Throws ContractError on another type.
[[nodiscard]] std::string ros2_schema(std::string_view type);

/// Returns the picture like `read_image`: one channel for grey, three for colour, without alpha.
/// Reads the encodings of docs/recordings.md, in capitals or not: 16 bits are scaled as those of a
/// PNG; floating point from 0 .. 1, or from 0 .. 255 if a value is more than 2 (NaN gives 0); Bayer
/// patterns are interpolated bilinearly; YUV is converted by ITU-R BT.601, luma 16 .. 235, as in
/// OpenCV. The height of planes counts the rows of u and v or not. Throws ContractError on other
/// encodings, sizes beyond the limits, a step shorter than a row and data of another length.
[[nodiscard]] panonav::Image to_image(const Image& message, const ImageLimits& limits = {});
/// Decodes a JPEG or PNG; the bytes, not `format`, decide which. Errors name `name`. Throws
/// ContractError on another format (compressedDepth, h264), FileError on bytes that cannot be
/// decoded.
[[nodiscard]] panonav::Image to_image(const CompressedImage& message, std::string_view name,
                                      const ImageLimits& limits = {});

}  // namespace panonav::recordings::ros
