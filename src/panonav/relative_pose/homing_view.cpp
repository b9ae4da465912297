#include "panonav/relative_pose/homing_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

HomingView::HomingView(int rows, int components, std::vector<float> cosines,
                       std::vector<float> sines, std::optional<ElevationBand> elevations)
    : rows_(rows),
      components_(components),
      cosines_(std::move(cosines)),
      sines_(std::move(sines)),
      elevations_(elevations) {
  require(rows >= 1, "rows", rows, ">= 1");
  require(components >= 2, "components", components, ">= 2");
  const std::size_t size = static_cast<std::size_t>(rows) * static_cast<std::size_t>(components);
  for (const auto* values : {&cosines_, &sines_}) {
    require(values->size() == size, "number of coefficients", static_cast<double>(values->size()),
            to_text(static_cast<double>(size)));
    for (const float value : *values) require(std::isfinite(value), "coefficient", value, "finite");
  }
  for (int y = 0; y < rows; ++y) require(b(y, 0) == 0.0F, "b_0", b(y, 0), "0");
}

namespace {

/// Cosine and sine of the phase of a byte.
struct Direction {
  float cosine;
  float sine;
};

const std::array<Direction, 256>& byte_directions() {
  static const std::array<Direction, 256> table = [] {
    std::array<Direction, 256> filled{};
    PackedSignature packed{{1, 1}, {255}, {0}};
    for (std::size_t i = 0; i < filled.size(); ++i) {
      packed.phases[0] = static_cast<std::uint8_t>(i);
      const FourierSignature unpacked = unpack(packed, 1.0F, std::nullopt);
      const float phase = unpacked.phases_rad()[0];
      filled[i] = {std::cos(phase), std::sin(phase)};
    }
    return filled;
  }();
  return table;
}

}  // namespace

HomingView homing_view(const VisualMemory& memory, ViewId view) {
  const PackedSignature packed = memory.packed(view);
  const auto& table = byte_directions();
  const float unit = memory.full_scale() / 255.0F;
  const auto rows = static_cast<std::size_t>(packed.shape.rows);
  std::vector<float> cosines(packed.shape.size());
  std::vector<float> sines(packed.shape.size());
  for (std::size_t i = 0; i < cosines.size(); ++i) {
    const float magnitude = static_cast<float>(packed.magnitudes[i]) * unit;
    // The phase of a magnitude of 0 is undefined.
    const Direction direction = table[packed.magnitudes[i] == 0 ? 0 : packed.phases[i]];
    cosines[i] = magnitude * direction.cosine;
    sines[i] = i < rows ? 0.0F : -magnitude * direction.sine;
  }
  return {packed.shape.rows, packed.shape.components, std::move(cosines), std::move(sines),
          memory.elevations()};
}

HomingView homing_view(const FourierSignature& signature) {
  const std::size_t size = signature.shape().size();
  std::vector<float> cosines(size);
  std::vector<float> sines(size);
  const auto rows = static_cast<std::size_t>(signature.rows());
  for (std::size_t i = 0; i < size; ++i) {
    const float magnitude = signature.magnitudes()[i];
    const float phase = signature.phases_rad()[i];
    // a_k = A_k cos psi_k, b_k = -A_k sin psi_k [S06 eq. 12, 13].
    cosines[i] = magnitude * std::cos(phase);
    sines[i] = i < rows ? 0.0F : -magnitude * std::sin(phase);
  }
  return {signature.rows(), signature.components(), std::move(cosines), std::move(sines),
          signature.elevations()};
}

HomingView horizon_view(const FourierSignature& signature, double half_band_rad) {
  require(half_band_rad > 0.0, "half_band_rad", half_band_rad, "> 0");
  const HomingView all = homing_view(signature);
  const int rows = all.rows();
  std::vector<int> used_rows;
  if (const auto& band = all.elevations()) {
    const double row_rad = (band->top_rad - band->bottom_rad) / rows;
    int nearest = 0;
    double min_elevation = 1e9;
    for (int y = 0; y < rows; ++y) {
      const double elevation = std::abs(band->top_rad - (y + 0.5) * row_rad);
      if (elevation <= half_band_rad) used_rows.push_back(y);
      if (elevation < min_elevation) {
        min_elevation = elevation;
        nearest = y;
      }
    }
    if (used_rows.empty()) used_rows.push_back(nearest);
  } else {
    for (int y = 0; y < rows; ++y) used_rows.push_back(y);
  }
  const auto components = static_cast<std::size_t>(all.components());
  std::vector<float> cosines(components);
  std::vector<float> sines(components);
  const float share = 1.0F / static_cast<float>(used_rows.size());
  for (int k = 0; k < all.components(); ++k) {
    for (const int y : used_rows) {
      cosines[static_cast<std::size_t>(k)] += share * all.a(y, k);
      sines[static_cast<std::size_t>(k)] += share * all.b(y, k);
    }
  }
  return {1, all.components(), std::move(cosines), std::move(sines)};
}

HomingView first_components(const HomingView& view, int components) {
  require(components >= 2 && components <= view.components(), "components", components,
          "2 .. " + to_text(view.components()));
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < components; ++k) {
    cosines.insert(cosines.end(), view.cosines(k).begin(), view.cosines(k).end());
    sines.insert(sines.end(), view.sines(k).begin(), view.sines(k).end());
  }
  return {view.rows(), components, std::move(cosines), std::move(sines), view.elevations()};
}

HomingView rotate(const HomingView& view, double turn_rad) {
  std::vector<float> cosines;
  std::vector<float> sines;
  // I'(phi) = I(phi + turn).
  for (int k = 0; k < view.components(); ++k) {
    const double cosine = std::cos(k * turn_rad);
    const double sine = std::sin(k * turn_rad);
    for (int y = 0; y < view.rows(); ++y) {
      const auto a = static_cast<double>(view.a(y, k));
      const auto b = static_cast<double>(view.b(y, k));
      cosines.push_back(static_cast<float>(a * cosine + b * sine));
      sines.push_back(k == 0 ? 0.0F : static_cast<float>(b * cosine - a * sine));
    }
  }
  return {view.rows(), view.components(), std::move(cosines), std::move(sines), view.elevations()};
}

}  // namespace panonav
