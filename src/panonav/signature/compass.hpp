#pragma once

#include <optional>

#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Relative heading read from two views [F11 section 3.2, M04 section 3.4, S06 section 2.4].
struct CompassReading {
  /// heading of the query minus heading of the reference, in [-pi, pi).
  double heading_rad = 0.0;
  /// Normalised correlation at the maximum, -1 .. 1; 1 for the same view turned. k = 0 does not
  /// count.
  double correlation = 0.0;
  /// 0 .. 1: how far the maximum stands above the second highest one; 0 when another heading fits
  /// as well.
  double distinctness = 0.0;
};

struct CompassOptions {
  int components = 0;  ///< k = 1 .. components - 1 are used; 0 takes all that both signatures have
};

/// Heading of `query` relative to `reference`: the global maximum of
/// C(sigma) = sum_{y,k} A^q A^r cos(psi^q - psi^r - k sigma) [S06 eq. 33], refined below a column.
/// Empty when neither view has any structure. Throws ContractError on different rows.
[[nodiscard]] std::optional<CompassReading> compass(const FourierSignature& query,
                                                    const FourierSignature& reference,
                                                    const CompassOptions& options = {});

/// S06's sequential rule [S06 eq. 40-43, sign of eq. 41 corrected], as published, kept for
/// comparison.
[[nodiscard]] std::optional<CompassReading> sequential_compass(const FourierSignature& query,
                                                               const FourierSignature& reference,
                                                               const CompassOptions& options = {});

}  // namespace panonav
