#include "panonav/kernels/row_transform_vector.hpp"

namespace panonav::kernels::avx2 {

void row_transform(const RowTransformJob& job) {
  transform_all<8>(job);
}

}  // namespace panonav::kernels::avx2
