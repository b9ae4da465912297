#pragma once

// The bodies of remap.hpp, one for each instruction set. No C++ standard headers here.

namespace panonav::kernels {

struct HalveJob {
  const unsigned char* pixels;
  long stride;
  int width, height;  ///< of the result
  unsigned char* halved;
};

struct PairJob {
  const unsigned char* pixels;
  long stride;
  int width, height;  ///< of the result
  unsigned short* pairs;
};

struct RemapJob {
  const unsigned short* pairs;
  const unsigned int* positions;
  const unsigned int* weights;
  int taps, count;
  float scale;
  float* values;
};

namespace scalar {
void halve(const HalveJob& job);
void pair_rows(const PairJob& job);
void remap(const RemapJob& job);
}  // namespace scalar
namespace avx2 {
void halve(const HalveJob& job);
void pair_rows(const PairJob& job);
void remap(const RemapJob& job);
}  // namespace avx2
namespace avx512 {
void halve(const HalveJob& job);
void pair_rows(const PairJob& job);
void remap(const RemapJob& job);
}  // namespace avx512
namespace neon {
void halve(const HalveJob& job);
void pair_rows(const PairJob& job);
void remap(const RemapJob& job);
}  // namespace neon

}  // namespace panonav::kernels
