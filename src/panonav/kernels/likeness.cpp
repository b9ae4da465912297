#include "panonav/kernels/likeness.hpp"

#include <string>

#include "panonav/core/error.hpp"

namespace panonav::kernels {

void explain_likeness(const LikenessLanes& lanes, const LikenessFall& fall,
                      std::span<const float> x_m, std::span<const float> y_m,
                      std::span<const float> heading_rad, std::span<float> explained,
                      Instructions instructions) {
  if (y_m.size() != x_m.size() || heading_rad.size() != x_m.size() ||
      explained.size() != x_m.size()) {
    throw ContractError("poses", static_cast<double>(explained.size()),
                        to_text(static_cast<double>(x_m.size())));
  }
  const auto count = static_cast<int>(x_m.size());
  const auto run = [&](auto body) {
    body(lanes, fall, x_m.data(), y_m.data(), heading_rad.data(), explained.data(), count);
  };
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return run(avx2::explain_likeness);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return run(avx512::explain_likeness);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return run(neon::explain_likeness);
#endif
    default:
      return run(scalar::explain_likeness);
  }
}

void exponentials(std::span<const float> logarithms, float scale, std::span<float> values,
                  Instructions instructions) {
  if (values.size() != logarithms.size()) {
    throw ContractError("values", static_cast<double>(values.size()),
                        to_text(static_cast<double>(logarithms.size())));
  }
  const auto run = [&](auto body) {
    body(logarithms.data(), scale, values.data(), static_cast<int>(values.size()));
  };
  switch (instructions) {
#ifdef PANONAV_HAS_AVX2
    case Instructions::avx2:
      return run(avx2::exponentials);
#endif
#ifdef PANONAV_HAS_AVX512
    case Instructions::avx512:
      return run(avx512::exponentials);
#endif
#ifdef PANONAV_HAS_NEON
    case Instructions::neon:
      return run(neon::exponentials);
#endif
    default:
      return run(scalar::exponentials);
  }
}

}  // namespace panonav::kernels
