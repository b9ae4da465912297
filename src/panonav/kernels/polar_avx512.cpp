#include "panonav/kernels/polar_vector.hpp"

namespace panonav::kernels::avx512 {

void to_polar(const PolarJob& job) {
  to_polar_loop(job.real, job.imaginary, job.magnitudes, job.phases_rad, job.count);
}

}  // namespace panonav::kernels::avx512
