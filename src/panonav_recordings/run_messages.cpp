#include "panonav_recordings/run_messages.hpp"

#include <array>
#include <bit>
#include <span>

namespace panonav::recordings {

void PointValues::add(const Point2& point, double value) {
  for (const double one : {point.x_m, point.y_m, 0.0, value}) {
    values.push_back(static_cast<float>(one));
  }
}

ros::PointCloud2 PointValues::message(std::int64_t stamp_ns, const std::string& frame,
                                      const std::string& value_name) const {
  static_assert(std::endian::native == std::endian::little);
  constexpr std::uint32_t step = 16;
  ros::PointCloud2 cloud;
  cloud.header = {stamp_ns, frame};
  cloud.width = static_cast<std::uint32_t>(values.size() / 4);
  cloud.fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}, {value_name, 12, 7, 1}};
  cloud.point_step = step;
  cloud.row_step = step * cloud.width;
  cloud.data = std::span(reinterpret_cast<const std::uint8_t*>(values.data()),
                         values.size() * sizeof(float));
  return cloud;
}

ros::PoseWithCovarianceStamped pose_message(const RunMoment& moment, std::int64_t stamp_ns,
                                            const std::string& frame) {
  ros::PoseWithCovarianceStamped message{{stamp_ns, frame}, {ros::to_pose(*moment.pose), {}}};
  if (!moment.covariance) return message;
  // Indices of x, y and heading among x, y, z and the rotations about x, y, z.
  constexpr std::array<std::size_t, 3> at{0, 1, 5};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      message.pose.covariance[6 * at[i] + at[j]] = (*moment.covariance)[3 * i + j];
    }
  }
  return message;
}

ros::PoseArray poses_message(const std::vector<Pose2>& poses, std::int64_t stamp_ns,
                             const std::string& frame) {
  ros::PoseArray message{{stamp_ns, frame}, {}};
  for (const Pose2& pose : poses) message.poses.push_back(ros::to_pose(pose));
  return message;
}

ros::DiagnosticArray diagnostics_message(const RunMoment& moment, std::int64_t stamp_ns) {
  ros::DiagnosticStatus status{.level = static_cast<std::uint8_t>(moment.sure ? 0 : 1),
                               .name = "panonav: localisation",
                               .message = moment.state,
                               .hardware_id = {},
                               .values = {}};
  for (const auto& [key, value] : moment.values) status.values.push_back({key, value});
  return {{stamp_ns, ""}, {status}};
}

std::vector<Pose2> resample_systematically(const Particles& particles, std::size_t count) {
  std::vector<Pose2> sample;
  if (particles.size() <= count) {
    for (std::size_t i = 0; i < particles.size(); ++i) sample.push_back(particles.pose(i));
    return sample;
  }
  double total = 0.0;
  for (const double weight : particles.weight) total += weight;
  double passed = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    passed += particles.weight[i];
    while (sample.size() < count && (static_cast<double>(sample.size()) + 0.5) * total <
                                        passed * static_cast<double>(count)) {
      sample.push_back(particles.pose(i));
    }
  }
  return sample;
}

}  // namespace panonav::recordings
