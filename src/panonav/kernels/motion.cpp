#include "panonav/kernels/motion.hpp"

#include "panonav/core/error.hpp"
#include "panonav/kernels/motion_targets.hpp"

namespace panonav::kernels {

namespace {

void check(std::size_t size, std::size_t wanted) {
  if (size == wanted) return;
  throw ContractError("size of a span", static_cast<double>(size),
                      to_text(static_cast<double>(wanted)));
}

}  // namespace

void normal_pairs(std::span<const std::uint64_t> bits, std::span<float> first,
                  std::span<float> second, Instructions instructions) {
  check(first.size(), bits.size());
  check(second.size(), bits.size());
  const auto run = [&](auto body) {
    body(bits.data(), first.data(), second.data(), static_cast<int>(bits.size()));
  };
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return run(avx2::normal_pairs);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return run(avx512::normal_pairs);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return run(neon::normal_pairs);
#endif
    default:
      return run(scalar::normal_pairs);
  }
}

void move_poses(const PoseColumns& poses, const StepColumns& steps, Instructions instructions) {
  const std::size_t count = poses.x_m.size();
  for (const std::size_t size : {poses.y_m.size(), poses.heading_rad.size(), steps.forward_m.size(),
                                 steps.left_m.size(), steps.turn_error_rad.size()}) {
    check(size, count);
  }
  const auto run = [&](auto body) {
    body(poses.x_m.data(), poses.y_m.data(), poses.heading_rad.data(), steps.forward_m.data(),
         steps.left_m.data(), steps.turn_error_rad.data(), steps.turn_rad, steps.share_before,
         static_cast<int>(count));
  };
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return run(avx2::move_poses);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return run(avx512::move_poses);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return run(neon::move_poses);
#endif
    default:
      return run(scalar::move_poses);
  }
}

}  // namespace panonav::kernels
