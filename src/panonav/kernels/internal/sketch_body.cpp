#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

constexpr int lanes = 8;  // dimensions of a group
using Ints = Vectors<lanes>::Ints;
using Floats = Vectors<lanes>::Floats;
typedef uint8_t Octet __attribute__((vector_size(lanes)));

void load(const int32_t* from, Ints& to) {
  __builtin_memcpy(&to, from, sizeof to);
}

int32_t total(const Ints& ints) {
  int32_t sum = 0;
  for (int i = 0; i < lanes; ++i) sum += ints[i];
  return sum;
}

}  // namespace

template <Instructions set>
EncodedSums SketchBody<set>::encode_sums(const int32_t* sums, const SumScale& scale, uint8_t* codes,
                                         size_t stride) {
  Ints missed = {};
  Ints outside = {};
  for (size_t group = 0; group < scale.groups; ++group) {
    Ints values;
    Ints offsets;
    Ints highest;
    load(sums + group * lanes, values);
    load(scale.offsets + group * lanes, offsets);
    load(scale.highest + group * lanes, highest);
    const Ints above = values - offsets;
    const Floats scaled =
        __builtin_convertvector(above, Floats) * scale.inverse_steps[group] + 0.5F;
    const Floats at_least = scaled > 0.0F ? scaled : Floats{};
    const Floats largest = Floats{} + 255.0F;
    const Ints code = __builtin_convertvector(at_least < largest ? at_least : largest, Ints);
    const Octet bytes = __builtin_convertvector(code, Octet);
    __builtin_memcpy(codes + group * stride, &bytes, sizeof bytes);
    const Ints difference = above - code * static_cast<int32_t>(scale.steps[group]);
    missed += difference < 0 ? -difference : difference;
    outside |= above | (highest - values);
  }
  int32_t signs = 0;
  for (int i = 0; i < lanes; ++i) signs |= outside[i];
  return {total(missed), signs >= 0};
}

template struct SketchBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
