#pragma once

// The body of match_columns: loops without branches, which the compiler vectorises for each
// instruction set. In an unnamed namespace, so that each has a copy of its own.

#include "panonav/kernels/column_match_targets.hpp"

namespace panonav::kernels {
namespace {

inline void match_columns_loop(const unsigned char* __restrict query,
                               const unsigned char* __restrict reference,
                               unsigned short* __restrict costs) {
  constexpr int columns = matched_reference_columns;
  constexpr int step = columns / matched_query_columns;
  // Query column c meets reference column d at the turn d - step c, from -columns + step on.
  unsigned short totals[2 * columns] = {};
  for (int c = 0; c < matched_query_columns; ++c) {
    unsigned short sums[columns] = {};
    for (int band = 0; band < matched_bands; ++band) {
      const unsigned char mine = query[c * matched_bands + band];
      const unsigned char* const theirs = reference + band * columns;
      for (int d = 0; d < columns; ++d) {
        const unsigned char larger = theirs[d] > mine ? theirs[d] : mine;
        const unsigned char smaller = theirs[d] > mine ? mine : theirs[d];
        sums[d] =
            static_cast<unsigned short>(sums[d] + static_cast<unsigned char>(larger - smaller));
      }
    }
    unsigned short* const met = totals + columns - step * c;
    for (int d = 0; d < columns; ++d) {
      // 256 L1 is a whole number below 2^24 and roots are rounded correctly: the same everywhere.
      const float root = __builtin_sqrtf(static_cast<float>(static_cast<int>(sums[d]) << 8));
      met[d] = static_cast<unsigned short>(met[d] + static_cast<int>(root + 0.5F));
    }
  }
  for (int s = 0; s < columns; ++s) {
    costs[s] = static_cast<unsigned short>(totals[s] + totals[s + columns]);
  }
}

}  // namespace
}  // namespace panonav::kernels
