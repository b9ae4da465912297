#pragma once

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/memory/visual_memory.hpp"

namespace panonav::testing {

/// A memory as plain as can be: what `VisualMemory` must agree with.
struct Oracle {
  SignatureShape shape;
  std::map<ViewId, PackedSignature> views;

  [[nodiscard]] std::uint32_t dissimilarity(const PackedSignature& a, const PackedSignature& b,
                                            int components,
                                            std::span<const std::uint8_t> allowed_rows) const {
    std::uint32_t sum = 0;
    for (int k = 0; k < components; ++k) {
      for (int row = 0; row < shape.rows; ++row) {
        if (!allowed_rows.empty() && allowed_rows[row] == 0) continue;
        const std::size_t i = static_cast<std::size_t>(k) * shape.rows + row;
        sum += static_cast<std::uint32_t>(std::abs(a.magnitudes[i] - b.magnitudes[i]));
      }
    }
    return sum;
  }

  /// All views that are not excluded, ascending (dissimilarity, view).
  [[nodiscard]] std::vector<Match> all(const PackedSignature& query, int components,
                                       const SearchMask& mask) const {
    std::vector<Match> matches;
    for (const auto& [view, signature] : views) {
      if (std::ranges::count(mask.excluded_views, view) > 0) continue;
      matches.push_back({view, dissimilarity(query, signature, components, mask.allowed_rows)});
    }
    std::ranges::sort(matches, [](const Match& a, const Match& b) {
      return std::pair(a.dissimilarity, a.view) < std::pair(b.dissimilarity, b.view);
    });
    return matches;
  }

  [[nodiscard]] std::vector<Match> nearest(const PackedSignature& query, int top, int components,
                                           const SearchMask& mask) const {
    std::vector<Match> matches = all(query, components, mask);
    matches.resize(std::min(matches.size(), static_cast<std::size_t>(top)));
    return matches;
  }
};

/// Distribution of the views of a test.
enum class Kind { random, clustered, repeated, dark };

/// Random bytes; or smooth curves that drift slowly, as along a path, with rare jumps; or few
/// different views, most of them several times; or nearly black ones with some saturated bytes.
class ViewMaker {
 public:
  ViewMaker(SignatureShape shape, Kind kind, std::uint64_t seed)
      : shape_(shape), kind_(kind), random_(seed) {}

  PackedSignature next() {
    PackedSignature view{shape_, std::vector<std::uint8_t>(shape_.size()),
                         std::vector<std::uint8_t>(shape_.size())};
    for (auto& phase : view.phases) phase = static_cast<std::uint8_t>(random_.next());
    switch (kind_) {
      case Kind::random:
        for (auto& byte : view.magnitudes) byte = static_cast<std::uint8_t>(random_.next());
        break;
      case Kind::clustered:
        drift();
        for (std::size_t i = 0; i < view.magnitudes.size(); ++i) {
          const double value = place_[i] + random_.normal(0.0, 1.5);
          view.magnitudes[i] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
        }
        break;
      case Kind::repeated: {
        const auto which = static_cast<std::uint8_t>(random_.index(7));
        for (std::size_t i = 0; i < view.magnitudes.size(); ++i) {
          view.magnitudes[i] = static_cast<std::uint8_t>(which * (i % 5));
        }
        break;
      }
      case Kind::dark:
        for (auto& byte : view.magnitudes) {
          byte = random_.index(50) == 0 ? 255 : static_cast<std::uint8_t>(random_.index(3));
        }
        break;
    }
    return view;
  }

 private:
  void drift() {
    if (place_.empty() || random_.index(150) == 0) {
      place_.assign(shape_.size(), 0.0);
      for (int k = 0; k < shape_.components; ++k) {
        double value = random_.uniform(0.0, 150.0 / (k + 1));
        for (int row = 0; row < shape_.rows; ++row) {
          value = std::abs(value + random_.normal(0.0, 8.0 / (k + 1)));
          place_[static_cast<std::size_t>(k) * shape_.rows + row] = value;
        }
      }
    }
    for (int k = 0; k < shape_.components; ++k) {
      double step = random_.normal(0.0, 6.0 / (k + 1));
      for (int row = 0; row < shape_.rows; ++row) {
        step += random_.normal(0.0, 1.0 / (k + 1));
        place_[static_cast<std::size_t>(k) * shape_.rows + row] += step;
      }
    }
  }

  SignatureShape shape_;
  Kind kind_;
  Random random_;
  std::vector<double> place_;
};

inline ReferenceInfo named(std::size_t number) {
  return {"view " + std::to_string(number), {}, {}};
}

}  // namespace panonav::testing
