#pragma once

#include <optional>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// The relative heading of two views [F11 section 3.2, M04 section 3.4, S06 section 2.4].
struct CompassReading {
  /// Heading of the query minus heading of the reference, in [-pi, pi).
  double heading_rad = 0.0;
  /// Normalised correlation at this heading without k = 0, -1 .. 1; 1 for the same view turned.
  double correlation = 0.0;
  /// Relative distance between the highest and the second highest maximum of the correlation, 0 ..
  /// 1: 0 if another heading fits equally well, 1 if no other fits at all.
  double distinctness = 0.0;
};

/// Finds the heading of `query` relative to `reference`: the global maximum of C(sigma) = sum_{y,k}
/// A^q A^r cos(psi^q - psi^r - k sigma) [S06 eq. 33], exact to rounding between columns. This
/// trigonometric polynomial is evaluated at eight points per period of its highest frequency, and
/// each maximum that may be the highest is refined by Newton's rule. `components`:
/// k = 1 .. components - 1 are used; 0 takes all that both signatures have. Empty when a view has
/// no structure: no component k >= 1 above the rounding of its computation. Throws ContractError on
/// different rows, or components outside 0, 2 .. those of both signatures. Cost: a few microseconds
/// for 80 x 15.
[[nodiscard]] std::optional<CompassReading> compass(const FourierSignature& query,
                                                    const FourierSignature& reference,
                                                    int components = 0);

/// Computes the heading directly from packed signatures; the full scale cancels. The quantised
/// phases (steps of 2 pi / 256) change the heading by at most a few thousandths of a radian.
[[nodiscard]] std::optional<CompassReading> compass(const PackedSignature& query,
                                                    const PackedSignature& reference,
                                                    int components = 0);

/// Finds the best heading within `within_rad` of `heading_rad`, a coarse heading from another
/// source. `distinctness` is 1, because other headings are not searched. Throws as `compass`, and
/// ContractError unless 0 < within_rad <= pi.
[[nodiscard]] std::optional<CompassReading> compass_near(const PackedSignature& query,
                                                         const PackedSignature& reference,
                                                         double heading_rad, double within_rad,
                                                         int components = 0);

}  // namespace panonav
