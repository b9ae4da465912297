#include "panonav_simulation/internal/sdf_values.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "panonav/core/text.hpp"

namespace panonav::simulation {

namespace {

// Returns the quaternion w x y z of rotations about x, then y, then z. `half` converts the unit of
// the angles to half radians.
std::array<double, 4> make_quaternion(double roll, double pitch, double yaw, double half) {
  const double cr = std::cos(roll * half);
  const double sr = std::sin(roll * half);
  const double cp = std::cos(pitch * half);
  const double sp = std::sin(pitch * half);
  const double cy = std::cos(yaw * half);
  const double sy = std::sin(yaw * half);
  return {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
          cr * cp * sy - sr * sp * cy};
}

}  // namespace

float brightness(const Colour& colour) {
  return 0.299F * colour[0] + 0.587F * colour[1] + 0.114F * colour[2];
}

std::optional<Colour> read_colour(pugi::xml_node parent, const char* name) {
  const auto numbers = parse_numbers(child_text(parent, name));
  if (!numbers || numbers->size() < 3) return std::nullopt;
  Colour colour{};
  for (std::size_t i = 0; i < 3; ++i)
    colour[i] = std::clamp(static_cast<float>((*numbers)[i]), 0.0F, 1.0F);
  return colour;
}

double read_number(pugi::xml_node parent, const char* name, double otherwise) {
  const auto numbers = parse_numbers(child_text(parent, name));
  return numbers && numbers->size() == 1 ? numbers->front() : otherwise;
}

std::vector<double> read_size(pugi::xml_node shape, const char* name, std::size_t count,
                              std::optional<double> otherwise) {
  const std::string text = child_text(shape, name);
  if (text.empty() && otherwise) return std::vector<double>(count, *otherwise);
  auto numbers = parse_numbers(text);
  if (!numbers || numbers->size() != count) {
    throw UnusablePart{
        "the " + std::string(name) + " of its " + to_readable_line(shape.name()) + " is not " +
        (count == 1 ? "a finite number" : std::to_string(count) + " finite numbers")};
  }
  return *std::move(numbers);
}

std::vector<double> read_positive_size(pugi::xml_node shape, const char* name, std::size_t count) {
  auto numbers = read_size(shape, name, count);
  if (std::any_of(numbers.begin(), numbers.end(), [](double v) { return !(v > 0.0); })) {
    throw UnusablePart{"the " + std::string(name) + " of its " + to_readable_line(shape.name()) +
                       " is not above 0"};
  }
  return numbers;
}

pugi::xml_node find_pose_element(pugi::xml_node part) {
  const pugi::xml_node pose = part.child("pose");
  return pose ? pose : part.child("origin");
}

Affine3 read_pose(pugi::xml_node pose) {
  if (!pose) return {};
  std::string text = element_text(pose);
  if (text.empty()) text = pose.attribute("pose").value();
  const bool is_quaternion =
      std::string_view(pose.attribute("rotation_format").value()) == "quat_xyzw";
  const std::size_t count = is_quaternion ? 7 : 6;
  auto n = parse_numbers(text);
  if (n && n->empty()) return {};
  if (n && n->size() == 3 && !is_quaternion) n->resize(6);  // a position alone
  if (!n || n->size() != count)
    throw UnusablePart{"its pose is not " + std::to_string(count) + " finite numbers"};
  const auto& v = *n;
  const std::string_view degrees = pose.attribute("degrees").value();
  const double half = degrees == "true" || degrees == "1" ? std::numbers::pi / 360.0 : 0.5;
  const std::array<double, 4> q =
      is_quaternion ? std::array{v[6], v[3], v[4], v[5]} : make_quaternion(v[3], v[4], v[5], half);
  const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
  if (!(length > 0.0) || !std::isfinite(length)) throw UnusablePart{"its pose has no rotation"};
  const double w = q[0] / length;
  const double x = q[1] / length;
  const double y = q[2] / length;
  const double z = q[3] / length;
  return {{1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y),
           2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x),
           2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)},
          {v[0], v[1], v[2]}};
}

std::string_view find_pose_frame(pugi::xml_node part) {
  const pugi::xml_node pose = find_pose_element(part);
  const std::string_view frame = pose.attribute("relative_to").value();
  return frame.empty() ? pose.attribute("frame").value() : frame;
}

std::string quote(std::string_view text) {
  return "\"" + to_readable_line(text) + "\"";
}

}  // namespace panonav::simulation
