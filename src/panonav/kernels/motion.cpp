#include "panonav/kernels/motion.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

namespace {

void require_size(std::size_t size, std::size_t expected) {
  if (size == expected) return;
  throw ContractError("size of a span", static_cast<double>(size),
                      to_text(static_cast<double>(expected)));
}

}  // namespace

void normal_pairs(std::span<const std::uint64_t> bits, std::span<float> first,
                  std::span<float> second, Instructions instructions) {
  require_size(first.size(), bits.size());
  require_size(second.size(), bits.size());
  with_body<MotionBody>(instructions, [&](auto body) {
    body.normal_pairs(bits.data(), first.data(), second.data(), static_cast<int>(bits.size()));
  });
}

void move_poses(const PoseColumns& poses, const PoseColumns::Steps& steps,
                Instructions instructions) {
  const std::size_t count = poses.x_m.size();
  for (const std::size_t size : {poses.y_m.size(), poses.heading_rad.size(), steps.forward_m.size(),
                                 steps.left_m.size(), steps.turn_error_rad.size()}) {
    require_size(size, count);
  }
  with_body<MotionBody>(instructions, [&](auto body) {
    body.move_poses(poses.x_m.data(), poses.y_m.data(), poses.heading_rad.data(),
                    steps.forward_m.data(), steps.left_m.data(), steps.turn_error_rad.data(),
                    steps.turn_rad, steps.turn_share_before_travel, static_cast<int>(count));
  });
}

}  // namespace panonav::kernels
