#pragma once

#include <optional>

#include "panonav/core/options.hpp"
#include "panonav/relative_pose/home_vector.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

void visit_options(FourierHomingOptions& options, OptionVisitor& visitor);

/// Returns the coefficients of a view; valid as long as the view.
[[nodiscard]] CoefficientView view_coefficients(const HomingView& view) noexcept;

/// Computes the home vector by Fourier homing [S06 section 2.3, eq. 16-30; see docs/equations.md]:
/// the heading first, then displacement and a correction of the heading in least squares over the
/// components of all rows. Iterations move the current view by the result and solve again.
/// Identical views give the zero vector. Views without structure, or a `window`
/// without a local maximum of the correlation, give all zeros and residual 1. Throws OptionError;
/// ContractError if the views differ in rows or share fewer than K + 2 components, and for a window
/// unless 0 < half_width_rad <= pi and the turn estimate is global. Cost: O(rows K), below a
/// microsecond for one row and K = 5.
[[nodiscard]] HomeVector home_vector(const HomingView& home, const HomingView& current,
                                     const FourierHomingOptions& options = {},
                                     const std::optional<HeadingWindow>& window = std::nullopt);

/// Computes the correlation of `home_vector` alone, to the bit; throws as it. Solves for the
/// displacement only if several headings compete or the options ask for iterations.
[[nodiscard]] double home_vector_correlation(
    const HomingView& home, const HomingView& current, const FourierHomingOptions& options = {},
    const std::optional<HeadingWindow>& window = std::nullopt);

/// Computes the home vector without checks of options and views, for inner loops.
[[nodiscard]] HomeVector home_vector_unchecked(const HomingView& home, const HomingView& current,
                                               const FourierHomingOptions& options);

/// Computes the sum of squared differences of the first K components at the heading of their best
/// correlation [S06 eq. 15, 28], relative to the energy of both views: 0 for the same place, about
/// 1 for unrelated views. If elevations are known, differences that a tilt of the robot by a few
/// degrees explains are ignored. Throws ContractError as `home_vector`.
[[nodiscard]] double image_difference(const HomingView& home, const HomingView& current,
                                      int highest = 0);

}  // namespace panonav
