#pragma once

// The bodies of normal_pairs and move_poses, one for each instruction set. No C++ standard headers
// here.

#include <stdint.h>

namespace panonav::kernels {

namespace scalar {
void normal_pairs(const uint64_t* bits, float* first, float* second, int count);
void move_poses(double* x_m, double* y_m, double* heading_rad, const double* forward_m,
                const double* left_m, const double* turn_error_rad, double turn_rad,
                double share_before, int count);
}  // namespace scalar
namespace avx2 {
void normal_pairs(const uint64_t* bits, float* first, float* second, int count);
void move_poses(double* x_m, double* y_m, double* heading_rad, const double* forward_m,
                const double* left_m, const double* turn_error_rad, double turn_rad,
                double share_before, int count);
}  // namespace avx2
namespace avx512 {
void normal_pairs(const uint64_t* bits, float* first, float* second, int count);
void move_poses(double* x_m, double* y_m, double* heading_rad, const double* forward_m,
                const double* left_m, const double* turn_error_rad, double turn_rad,
                double share_before, int count);
}  // namespace avx512
namespace neon {
void normal_pairs(const uint64_t* bits, float* first, float* second, int count);
void move_poses(double* x_m, double* y_m, double* heading_rad, const double* forward_m,
                const double* left_m, const double* turn_error_rad, double turn_rad,
                double share_before, int count);
}  // namespace neon

}  // namespace panonav::kernels
