#include "panonav/kernels/internal/vector.hpp"

namespace panonav::kernels {
namespace {

template <Instructions set, bool masked>
uint32_t compute_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask, size_t count) {
  using Vector = ByteVector<set>;
  using Register = typename Vector::Register;
  Register sums{};
  size_t i = 0;
  const auto add = [&](auto load) {
    Register x = load(a + i);
    Register y = load(b + i);
    if constexpr (masked) {
      const Register m = load(mask + i);
      x = x & m;
      y = y & m;
    }
    sums = Vector::add_sad(sums, x, y);
  };
  if constexpr (set != Instructions::scalar) {  // plain loops are faster for scalar
    for (; i + sizeof(Register) <= count; i += sizeof(Register)) add(Vector::load);
  }
  if constexpr (requires { Vector::load_first(a, i); }) {
    if (i < count) [[likely]] {
      add([&](const uint8_t* from) { return Vector::load_first(from, count - i); });
    }
    i = count;
  }
  auto total = static_cast<uint32_t>(Vector::total(sums));
  for (; i < count; ++i) {
    const int bits = masked ? mask[i] : 255;
    const int difference = (a[i] & bits) - (b[i] & bits);
    total += static_cast<uint32_t>(difference < 0 ? -difference : difference);
  }
  return total;
}

/// Computes `sketch_bounds`. If `fixed_groups` > 0, the number of groups is this constant and the
/// query stays in registers.
template <Instructions set, size_t fixed_groups, bool masked>
uint32_t compute_interleaved_bounds(const uint8_t* sketches, const int32_t* slacks, size_t octets,
                                    const DistanceKernels::SketchQuery& query, uint32_t* bounds) {
  using Vector = ByteVector<set>;
  using Register = typename Vector::Register;
  constexpr size_t registers = 64 / sizeof(Register);
  constexpr size_t kept_groups = fixed_groups > 0 ? fixed_groups : 1;
  Register kept_values[kept_groups];
  Register kept_steps[kept_groups];
  for (size_t group = 0; group < fixed_groups; ++group) {
    kept_values[group] = Vector::broadcast(load_group(query.values + group * 8));
    kept_steps[group] = Vector::broadcast(query.steps[group]);
  }
  const size_t groups = fixed_groups > 0 ? fixed_groups : query.groups;
  EightInts smallest = EightInts{} + 0x7FFFFFFF;
  const EightInts constant = EightInts{} + query.constant;
  const EightInts max_slack = EightInts{} + query.max_slack;
  for (size_t octet = 0; octet < octets; ++octet) {
    Register sums[registers] = {};
    for (size_t group = 0; group < groups; ++group) {
      const Register values = fixed_groups > 0
                                  ? kept_values[group]
                                  : Vector::broadcast(load_group(query.values + group * 8));
      const Register step =
          fixed_groups > 0 ? kept_steps[group] : Vector::broadcast(query.steps[group]);
      for (size_t r = 0; r < registers; ++r) {
        Register x = Vector::load(sketches + group * 64 + r * sizeof(Register));
        if (masked) x = x & Vector::broadcast(load_group(query.mask + group * 8));
        sums[r] = sums[r] + Vector::product(Vector::sad(x, values), step);
      }
    }
    sketches += query.stored_groups * 64;
    EightInts sum;
    Vector::narrow(sums, sum);
    const EightInts slack = *reinterpret_cast<const EightInts*>(slacks + octet * 8);
    const EightInts used_slack = slack < max_slack ? slack : max_slack;
    const EightInts difference = sum + constant - used_slack;
    const EightInts bound = difference > 0 ? difference : EightInts{};
    *reinterpret_cast<EightInts*>(bounds + octet * 8) = bound;
    smallest = bound < smallest ? bound : smallest;
  }
  uint32_t bounds_of_lanes[8];
  __builtin_memcpy(bounds_of_lanes, &smallest, sizeof bounds_of_lanes);
  uint32_t min_bound = bounds_of_lanes[0];
  for (const uint32_t bound : bounds_of_lanes) min_bound = bound < min_bound ? bound : min_bound;
  return min_bound;
}

/// Numbers of which a vector is computed at once: the codes of a dimension, the sums of a group.
template <int lanes>
struct Sums : Vectors<lanes> {
  using Ints = typename Vectors<lanes>::Ints;
  using Floats = typename Vectors<lanes>::Floats;
  typedef uint8_t Bytes __attribute__((vector_size(lanes)));

  static void load(const int32_t* from, Ints& to) { __builtin_memcpy(&to, from, sizeof to); }
  /// Rounds numbers >= 0 down to codes, at most 255.
  static void round_to_codes(const Floats& numbers, Ints& codes) {
    const Floats largest = Floats{} + 255.0F;
    codes = __builtin_convertvector(numbers < largest ? numbers : largest, Ints);
  }
  static void store_bytes(const Ints& ints, uint8_t* to) {
    const Bytes bytes = __builtin_convertvector(ints, Bytes);
    __builtin_memcpy(to, &bytes, sizeof bytes);
  }
};

bool is_unmasked(const DistanceKernels::SketchQuery& query) {
  for (size_t group = 0; group < query.groups; ++group) {
    if (load_group(query.mask + group * 8) != ~uint64_t{0}) return false;
  }
  return true;
}

}  // namespace

template <Instructions set>
uint32_t DistanceBody<set>::l1(const uint8_t* a, const uint8_t* b, size_t count) {
  return compute_l1<set, false>(a, b, nullptr, count);
}

template <Instructions set>
uint32_t DistanceBody<set>::masked_l1(const uint8_t* a, const uint8_t* b, const uint8_t* mask,
                                      size_t count) {
  return compute_l1<set, true>(a, b, mask, count);
}

template <Instructions set>
uint32_t DistanceBody<set>::sketch_bounds(const uint8_t* sketches, const int32_t* slacks,
                                          size_t octets, const DistanceKernels::SketchQuery& query,
                                          uint32_t* bounds) {
  // The default of 15 components has 5 groups. Other shapes, and instruction sets with too few
  // registers for the query, use the general body.
  if constexpr (set == Instructions::avx512) {
    if (query.groups == 5 && is_unmasked(query)) {
      return compute_interleaved_bounds<set, 5, false>(sketches, slacks, octets, query, bounds);
    }
  }
  return compute_interleaved_bounds<set, 0, true>(sketches, slacks, octets, query, bounds);
}

template <Instructions set>
void DistanceBody<set>::sketch_bounds_at(const uint8_t* sketches, const int32_t* slacks,
                                         const uint32_t* indices, size_t count,
                                         const DistanceKernels::SketchQuery& query,
                                         uint32_t* bounds) {
  using Vector = ByteVector<set>;
  using Register = typename Vector::Register;
  constexpr size_t prefetch_distance = 24;
  const auto prefetch = [&](size_t i) {
    if (i >= count) return;
    const uint8_t* const sketch = sketches + indices[i] * query.stored_groups * 8;
    for (size_t group = 0; group < query.groups; group += 8) __builtin_prefetch(sketch + group * 8);
  };
  for (size_t i = 0; i < prefetch_distance; ++i) prefetch(i);
  for (size_t i = 0; i < count; ++i) {
    prefetch(i + prefetch_distance);
    const uint8_t* const sketch = sketches + indices[i] * query.stored_groups * 8;
    Register sums{};
    for (size_t group = 0; group < query.groups; group += sizeof(Register) / 8) {
      const Register x = Vector::load(sketch + group * 8) & Vector::load(query.mask + group * 8);
      const Register sad = Vector::sad(x, Vector::load(query.values + group * 8));
      sums = sums + Vector::product(sad, Vector::load(query.steps + group));
    }
    const int32_t slack = slacks == nullptr ? query.max_slack : slacks[indices[i]];
    const int32_t used_slack = slack < query.max_slack ? slack : query.max_slack;
    const int64_t bound = static_cast<int64_t>(Vector::total(sums)) + query.constant - used_slack;
    bounds[i] = bound < 0 ? 0U : static_cast<uint32_t>(bound);
  }
}

template <Instructions set>
void DistanceBody<set>::cell_tables(const int32_t* low, const int32_t* high, const int32_t* sums,
                                    const float* factors, size_t dimensions, uint8_t* tables) {
  using Codes = Sums<16>;
  using Ints = Codes::Ints;
  for (size_t d = 0; d < dimensions; ++d) {
    Ints lowest;
    Ints highest;
    Codes::load(low + 16 * d, lowest);
    Codes::load(high + 16 * d, highest);
    const Ints below = lowest - sums[d];
    const Ints above = sums[d] - highest;
    const Ints larger = below > above ? below : above;
    const Ints outside = larger > 0 ? larger : Ints{};
    Ints codes;
    Codes::round_to_codes(__builtin_convertvector(outside, Codes::Floats) * factors[d], codes);
    Codes::store_bytes(codes, tables + 16 * d);
  }
}

template <Instructions set>
int32_t DistanceBody<set>::encode_query(const int32_t* sums, const int32_t* flags,
                                        const SumScale& scale, uint8_t* values) {
  constexpr int lanes = 8;  // sums of a group
  using Group = Sums<lanes>;
  using Ints = Group::Ints;
  Ints constant{};
  for (size_t group = 0; group < scale.groups; ++group) {
    Ints sum;
    Ints flag;
    Ints lowest;
    Ints highest;
    Group::load(sums + group * lanes, sum);
    Group::load(flags + group * lanes, flag);
    Group::load(scale.offsets + group * lanes, lowest);
    Group::load(scale.highest + group * lanes, highest);
    const Ints at_least = sum > lowest ? sum : lowest;
    const Ints inside = at_least < highest ? at_least : highest;
    const Ints above = inside - lowest;
    Ints code;
    Group::round_to_codes(
        __builtin_convertvector(above, Group::Floats) * scale.inverse_steps[group] + 0.5F, code);
    const Ints difference = above - code * static_cast<int32_t>(scale.steps[group]);
    const Ints missed = difference < 0 ? -difference : difference;
    const Ints outside = sum > inside ? sum - inside : inside - sum;
    constant += flag * (outside - missed);
    Group::store_bytes(flag * code, values + group * lanes);
  }
  int32_t total = 0;
  for (int i = 0; i < lanes; ++i) total += constant[i];
  return total;
}

template <Instructions set>
size_t DistanceBody<set>::cell_bounds(const uint8_t* codes, size_t blocks,
                                      const DistanceKernels::CellQuery& query, uint8_t* bounds,
                                      uint32_t* indices) {
  size_t found = 0;
  for (size_t block = 0; block < blocks; ++block) {
    const auto first = static_cast<uint32_t>(block * cell_block);
    if constexpr (set == Instructions::scalar) {
      uint16_t sums[cell_block] = {};
      for (size_t pair = 0; pair < query.pairs; ++pair) {
        const uint8_t* const tables = query.tables + pair * 32;
        const uint8_t* const row = codes + pair * cell_block;
        for (size_t i = 0; i < cell_block; ++i) {
          const int sum = sums[i] + tables[row[i] & 15] + tables[16 + (row[i] >> 4)];
          sums[i] = static_cast<uint16_t>(sum < 255 ? sum : 255);
        }
      }
      for (size_t i = 0; i < cell_block; ++i) {
        bounds[i] = static_cast<uint8_t>(sums[i]);
        indices[found] = first + static_cast<uint32_t>(i);
        found += bounds[i] <= query.limit ? 1 : 0;
      }
    } else {
      using Vector = ByteVector<set>;
      using Register = typename Vector::Register;
      for (size_t at = 0; at < cell_block; at += sizeof(Register)) {
        Register sums{};
        for (size_t pair = 0; pair < query.pairs; ++pair) {
          const uint8_t* const tables = query.tables + pair * 32;
          const Register row = Vector::load(codes + pair * cell_block + at);
          sums = Vector::add_saturated(sums, Vector::lookup(tables, row));
          sums = Vector::add_saturated(sums, Vector::lookup_upper(tables + 16, row));
        }
        __builtin_memcpy(bounds + at, &sums, sizeof sums);
        uint64_t bits = Vector::at_most(sums, query.limit);
        for (; bits != 0; bits &= bits - 1) {
          indices[found++] =
              first + static_cast<uint32_t>(at) + static_cast<uint32_t>(__builtin_ctzll(bits));
        }
      }
    }
    codes += query.pairs * cell_block;
    bounds += cell_block;
  }
  return found;
}

template <Instructions set>
size_t DistanceBody<set>::collect_at_most(const uint32_t* values, size_t count, uint32_t limit,
                                          uint32_t* indices) {
  size_t found = 0;
  size_t i = 0;
  if constexpr (set != Instructions::scalar) {
    constexpr size_t values_per_register =
        sizeof(typename ByteVector<set>::Register) / sizeof(uint32_t);
    for (; i + values_per_register <= count; i += values_per_register) {
      found +=
          ByteVector<set>::collect(values + i, limit, static_cast<uint32_t>(i), indices + found);
    }
  }
  for (; i < count; ++i) {
    indices[found] = static_cast<uint32_t>(i);
    found += values[i] <= limit ? 1 : 0;
  }
  return found;
}

template struct DistanceBody<Instructions::PANONAV_TARGET>;

}  // namespace panonav::kernels
