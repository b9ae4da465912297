#include "panonav/kernels/column_match_vector.hpp"

namespace panonav::kernels::avx512 {

void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs) {
  match_columns_loop(query, reference, costs);
}

}  // namespace panonav::kernels::avx512
