#include "panonav_recordings/ros_messages.hpp"

#include <algorithm>
#include <array>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::recordings::ros {

namespace {

struct Definition {
  std::string_view type;
  std::string_view text;
};

// Definitions of ROS 2's common_interfaces, without comments (Apache-2.0). Lines such as `uint8
// FLOAT32=7` are constants and take no bytes in a message.
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
    Definition{"sensor_msgs/LaserScan",
               "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\n"
               "float32 angle_increment\nfloat32 time_increment\nfloat32 scan_time\n"
               "float32 range_min\nfloat32 range_max\nfloat32[] ranges\nfloat32[] intensities\n"},
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

const Definition& find_definition(std::string_view type) {
  const auto found = std::ranges::find(definitions, type, &Definition::type);
  if (found != definitions.end()) return *found;
  std::string known;
  for (const auto& each : definitions)
    known += (known.empty() ? "" : ", ") + std::string(each.type);
  throw ContractError("message type", to_readable_line(type), known);
}

}  // namespace

std::string ros2_type_name(std::string_view type) {
  const std::size_t package = type.find('/');
  if (package == std::string_view::npos) {
    throw ContractError("message type", to_readable_line(type), "PACKAGE/NAME");
  }
  return std::string(type.substr(0, package)) + "/msg" + std::string(type.substr(package));
}

std::string ros2_schema(std::string_view type) {
  std::vector<std::string_view> types{type};
  std::string schema;
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::string_view text = find_definition(types[i]).text;
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
