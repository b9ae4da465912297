#include "panonav/kernels/similarity.hpp"

#include <string>

#include "panonav/core/error.hpp"
#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

void explain_similarity(const SimilarityLanes& lanes, const SimilarityLanes::Decay& decay,
                        std::span<const float> x_m, std::span<const float> y_m,
                        std::span<const float> heading_rad, std::span<float> explained,
                        Instructions instructions) {
  if (y_m.size() != x_m.size() || heading_rad.size() != x_m.size() ||
      explained.size() != x_m.size()) {
    throw ContractError("poses", static_cast<double>(explained.size()),
                        to_text(static_cast<double>(x_m.size())));
  }
  const auto count = static_cast<int>(x_m.size());
  with_body<SimilarityBody>(instructions, [&](auto body) {
    body.explain_similarity(lanes, decay, x_m.data(), y_m.data(), heading_rad.data(),
                            explained.data(), count);
  });
}

void exponentials(std::span<const float> logarithms, float scale, std::span<float> values,
                  Instructions instructions) {
  if (values.size() != logarithms.size()) {
    throw ContractError("values", static_cast<double>(values.size()),
                        to_text(static_cast<double>(logarithms.size())));
  }
  with_body<SimilarityBody>(instructions, [&](auto body) {
    body.exponentials(logarithms.data(), scale, values.data(), static_cast<int>(values.size()));
  });
}

}  // namespace panonav::kernels
