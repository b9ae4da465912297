#pragma once

// The bodies of to_polar, one for each instruction set. No C++ standard headers here.

namespace panonav::kernels {

struct PolarJob {
  const float* real;
  const float* imaginary;
  float* magnitudes;
  float* phases_rad;
  int count;
};

namespace scalar {
void to_polar(const PolarJob& job);
}
namespace avx2 {
void to_polar(const PolarJob& job);
}
namespace avx512 {
void to_polar(const PolarJob& job);
}
namespace neon {
void to_polar(const PolarJob& job);
}

}  // namespace panonav::kernels
