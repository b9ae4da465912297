#include "panonav/kernels/row_transform_targets.hpp"

namespace panonav::kernels::scalar {

namespace {

// Interleaved: index 2 c belongs to even k, 2 c + 1 to odd k.
void fold(const float* row, int columns, int folded, float* even, float* odd) {
  if (columns % 2 != 0) {
    even[0] = even[1] = row[0];
    odd[0] = odd[1] = 0.0F;
    for (int c = 1; c < folded; ++c) {
      even[2 * c] = even[2 * c + 1] = row[c] + row[columns - c];
      odd[2 * c] = odd[2 * c + 1] = row[c] - row[columns - c];
    }
    return;
  }
  const int half = columns / 2;
  even[0] = row[0] + row[half];
  even[1] = row[0] - row[half];
  odd[0] = odd[1] = 0.0F;
  for (int c = 1; 2 * c < half; ++c) {
    const float near_sum = row[c] + row[columns - c];
    const float near_difference = row[c] - row[columns - c];
    const float far_sum = row[half - c] + row[half + c];
    const float far_difference = row[half - c] - row[half + c];
    even[2 * c] = near_sum + far_sum;
    even[2 * c + 1] = near_sum - far_sum;
    odd[2 * c] = near_difference - far_difference;
    odd[2 * c + 1] = near_difference + far_difference;
  }
  if (half % 2 == 0) {
    // A quarter turn folds onto itself: its cosine is 0 for odd k, its sine for even k.
    const int c = half / 2;
    even[2 * c] = row[c] + row[columns - c];
    even[2 * c + 1] = 0.0F;
    odd[2 * c] = 0.0F;
    odd[2 * c + 1] = row[c] - row[columns - c];
  }
}

}  // namespace

void row_transform(const RowTransformJob& job) {
  float* const even = job.scratch;
  float* const odd = job.scratch + 2 * job.folded;
  for (int y = 0; y < job.rows; ++y) {
    fold(job.values + static_cast<long>(y) * job.columns, job.columns, job.folded, even, odd);
    for (int first = 0; first < job.components; first += row_transform_block) {
      const float* cosines = job.cosines + static_cast<long>(first) * job.folded;
      const float* sines = job.sines + static_cast<long>(first) * job.folded;
      float real[row_transform_block] = {};
      float imaginary[row_transform_block] = {};
      for (int c = 0; c < job.folded; ++c) {
        for (int k = 0; k < row_transform_block; ++k) {
          real[k] += even[2 * c + k % 2] * cosines[c * row_transform_block + k];
          imaginary[k] += odd[2 * c + k % 2] * sines[c * row_transform_block + k];
        }
      }
      for (int k = 0; k < row_transform_block && first + k < job.components; ++k) {
        job.real[static_cast<unsigned long>(first + k) * job.stride + y] = real[k];
        job.imaginary[static_cast<unsigned long>(first + k) * job.stride + y] = imaginary[k];
      }
    }
  }
}

}  // namespace panonav::kernels::scalar
