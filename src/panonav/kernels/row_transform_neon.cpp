#include "panonav/kernels/row_transform_vector.hpp"

namespace panonav::kernels::neon {

void row_transform(const RowTransformJob& job) {
  transform_all<4>(job);
}

}  // namespace panonav::kernels::neon
