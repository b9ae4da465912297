#pragma once

// The bodies of turn_products, one for each instruction set. No C++ standard headers here.

namespace panonav::kernels {

/// Products of a row come in multiples of this many turns.
constexpr int turn_products_lanes = 16;

namespace scalar {
void turn_products(const float* rows, int count, int columns, const float* periodic,
                   float* products, float* largest);
}
namespace avx2 {
void turn_products(const float* rows, int count, int columns, const float* periodic,
                   float* products, float* largest);
}
namespace avx512 {
void turn_products(const float* rows, int count, int columns, const float* periodic,
                   float* products, float* largest);
}
namespace neon {
void turn_products(const float* rows, int count, int columns, const float* periodic,
                   float* products, float* largest);
}

}  // namespace panonav::kernels
