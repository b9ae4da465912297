#pragma once

// The bodies of RowTransform, one for each instruction set. No C++ standard headers here.

namespace panonav::kernels {

/// Components are handled in blocks of this many; tables are padded to whole blocks.
inline constexpr int row_transform_block = 16;

struct RowTransformJob {
  const float* values;  ///< rows * columns
  int rows, columns, components, folded;
  const float* cosines;  ///< [block][folded][row_transform_block]
  const float* sines;
  float* scratch;  ///< row_transform_scratch(folded) floats
  float* real;     ///< index k * stride + row
  float* imaginary;
  unsigned long stride;
};

/// Four rows are folded at a time, each into pairs (even k, odd k) for the cosines and for the
/// sines.
constexpr unsigned long row_transform_scratch(int folded) {
  return 4UL * 4UL * static_cast<unsigned long>(folded);
}

namespace scalar {
void row_transform(const RowTransformJob& job);
}
namespace avx2 {
void row_transform(const RowTransformJob& job);
}
namespace avx512 {
void row_transform(const RowTransformJob& job);
}
namespace neon {
void row_transform(const RowTransformJob& job);
}

}  // namespace panonav::kernels
