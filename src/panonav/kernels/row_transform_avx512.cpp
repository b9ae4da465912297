#include "panonav/kernels/row_transform_vector.hpp"

namespace panonav::kernels::avx512 {

void row_transform(const RowTransformJob& job) {
  transform_all<16>(job);
}

}  // namespace panonav::kernels::avx512
