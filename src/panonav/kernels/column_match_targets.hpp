#pragma once

// The bodies of match_columns, one for each instruction set. No C++ standard headers here.

namespace panonav::kernels {

constexpr int matched_query_columns = 32;
constexpr int matched_reference_columns = 128;
constexpr int matched_bands = 16;

namespace scalar {
void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs);
}
namespace avx2 {
void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs);
}
namespace avx512 {
void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs);
}
namespace neon {
void match_columns(const unsigned char* query, const unsigned char* reference,
                   unsigned short* costs);
}

}  // namespace panonav::kernels
