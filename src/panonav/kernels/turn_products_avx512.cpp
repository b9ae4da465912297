#include "panonav/kernels/turn_products_vector.hpp"

namespace panonav::kernels::avx512 {

void turn_products(const float* rows, int count, int columns, const float* periodic,
                   float* products, float* largest) {
  turn_products_loop<16, 5>(rows, count, columns, periodic, products, largest);
}

}  // namespace panonav::kernels::avx512
