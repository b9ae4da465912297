#include "panonav/kernels/motion_vector.hpp"

namespace panonav::kernels::scalar {

void normal_pairs(const uint64_t* bits, float* first, float* second, int count) {
  normal_pairs_loop(bits, first, second, count);
}

void move_poses(double* x_m, double* y_m, double* heading_rad, const double* forward_m,
                const double* left_m, const double* turn_error_rad, double turn_rad,
                double share_before, int count) {
  move_poses_loop(x_m, y_m, heading_rad, forward_m, left_m, turn_error_rad, turn_rad, share_before,
                  count);
}

}  // namespace panonav::kernels::scalar
