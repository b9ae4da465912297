#include "bindings.hpp"
#include "panonav/geometry/alignment.hpp"
#include "panonav/io/trajectory_file.hpp"
#include "panonav/motion/trajectory_error.hpp"

namespace panonav::python {

namespace {

using Rows = py::array_t<double, py::array::c_style>;

std::vector<Point2> to_points(const Rows& rows) {
  std::vector<Point2> points;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) points.push_back({rows.at(i, 0), rows.at(i, 1)});
  return points;
}

Rows to_stamped_pose_rows(const std::vector<StampedPose>& poses) {
  Rows rows({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}});
  auto row = rows.mutable_unchecked<2>();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto at = static_cast<py::ssize_t>(i);
    row(at, 0) = poses[i].stamp_s;
    row(at, 1) = poses[i].pose.x_m;
    row(at, 2) = poses[i].pose.y_m;
    row(at, 3) = poses[i].pose.heading_rad;
  }
  return rows;
}

}  // namespace

Trajectory to_trajectory(const Rows& rows) {
  std::vector<StampedPose> poses;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    poses.push_back({rows.at(i, 0), {rows.at(i, 1), rows.at(i, 2), rows.at(i, 3)}});
  }
  return Trajectory(std::move(poses));
}

void bind_measures(py::module_& m) {
  Record<Alignment>(m, "Alignment", "to = scale R(rotation) from + translation.")
      .field("scale", &Alignment::scale,
             "Length in `to` per unit length in `from`; 1 unless the scale was free.")
      .field("rotation_rad", &Alignment::rotation_rad, "Counter-clockwise, in [-pi, pi].")
      .field(
          "translation", [](const Alignment& a) { return a.translation; }, "(x_m, y_m)")
      .field("reflected", &Alignment::reflected, "True if `from` is mirrored first (y -> -y).")
      .field("rms_m", &Alignment::rms_m, "Root mean square distance after alignment.");
  Record<Alignment3>(m, "Alignment3", "to = scale rotation from + translation, in space.")
      .field("scale", &Alignment3::scale, "Length in `to` per unit length in `from`.")
      .field(
          "rotation",
          [](const Alignment3& a) {
            return std::tuple(a.rotation.x, a.rotation.y, a.rotation.z, a.rotation.w);
          },
          "Quaternion (x, y, z, w).")
      .field(
          "translation",
          [](const Alignment3& a) {
            return std::tuple(a.translation.x_m, a.translation.y_m, a.translation.z_m);
          },
          "(x_m, y_m, z_m)")
      .field("reflected", &Alignment3::reflected, "True if `from` is mirrored first (y -> -y).")
      .field("is_unique", &Alignment3::is_unique, "False for points on a straight line.");
  Record<ShapeDifference>(m, "ShapeDifference", "Procrustes disparity of two shapes.")
      .field("value", &ShapeDifference::value, "0 (same shape) to 1.")
      .field("with_reflection", &ShapeDifference::with_reflection,
             "Value if a reflection is allowed.");
  Record<TrajectoryError::Summary>(m, "ErrorSummary", "Statistics of errors.")
      .field("rms", &TrajectoryError::Summary::rms, "Root mean square.")
      .field("mean", &TrajectoryError::Summary::mean, "Arithmetic mean.")
      .field("median", &TrajectoryError::Summary::median, "Half of the errors are at most this.")
      .field("p95", &TrajectoryError::Summary::p95, "95 % of the errors are at most this.")
      .field("largest", &TrajectoryError::Summary::largest, "Largest error.");
  Record<TrajectoryError>(m, "TrajectoryError", "Errors of an estimated trajectory: ATE and RPE.")
      .field("pairs", &TrajectoryError::pairs, "Number of estimates with a true pose.")
      .field("left_out", &TrajectoryError::left_out, "Number of estimates without a true pose.")
      .field("planar", &TrajectoryError::planar,
             "True if the alignment rotated only about z, as both trajectories are planar.")
      .field("truth_from_estimate", &TrajectoryError::truth_from_estimate,
             "Identity with align='none'.")
      .field("position_m", &TrajectoryError::position_m, "ATE, after alignment.")
      .field("rotation_rad", &TrajectoryError::rotation_rad,
             "Angle between estimate and truth, after alignment.")
      .field("relative_pairs", &TrajectoryError::relative_pairs,
             "Number of RPE pairs; 0 if the path is shorter than twice relative_distance_m.")
      .field("relative_position_m", &TrajectoryError::relative_position_m,
             "RPE over relative_distance_m.")
      .field("relative_rotation_rad", &TrajectoryError::relative_rotation_rad,
             "Error of the rotation over relative_distance_m.");
  m.def(
      "align",
      [](const py::object& from, const py::object& to, bool allow_scale, bool allow_reflection) {
        return align(to_points(to_number_rows(from, "source", 2)),
                     to_points(to_number_rows(to, "target", 2)), {allow_scale, allow_reflection});
      },
      py::arg("source"), py::arg("target"), py::arg("allow_scale") = false,
      py::arg("allow_reflection") = false,
      "Aligns one point set (n, 2) with another by least squares (Umeyama).");
  m.def(
      "shape_difference",
      [](const py::object& a, const py::object& b) {
        return shape_difference(to_points(to_number_rows(a, "a", 2)),
                                to_points(to_number_rows(b, "b", 2)));
      },
      py::arg("a"), py::arg("b"),
      "Procrustes disparity of two point sets (n, 2): how much they differ after the best "
      "translation, rotation and scale.");
  m.def(
      "trajectory_error",
      [](const py::object& estimate, const py::object& truth, const py::kwargs& keywords) {
        TrajectoryError::Options options;
        Keywords(keywords).options(options).finish();
        const auto a = to_trajectory(to_number_rows(estimate, "estimate", 4));
        const auto b = to_trajectory(to_number_rows(truth, "truth", 4));
        const py::gil_scoped_release free;
        return panonav::trajectory_error(a, b, options);
      },
      py::arg("estimate"), py::arg("truth"),
      append_option_list(
          "ATE and RPE of two trajectories, (n, 4) of stamp_s, x_m, y_m, heading_rad. "
          "None if fewer than two estimates have a true pose at their stamp.",
          {options_of<TrajectoryError::Options>()})
          .c_str());
  m.def(
      "read_trajectory",
      [](const std::filesystem::path& path) { return to_stamped_pose_rows(read_trajectory(path)); },
      py::arg("path"), "Reads TUM text or CSV: (n, 4) of stamp_s, x_m, y_m, heading_rad.");
}

}  // namespace panonav::python
