#pragma once

#include <array>
#include <optional>

#include "panonav/core/options.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// The displacement and turn between two views.
struct HomeVector {
  /// Forward displacement to home in the frame of the robot at the current view, in units of R, the
  /// assumed distance of all things.
  double xi = 0.0;
  double eta = 0.0;  ///< the same to the left
  /// Heading of the home view minus heading of the current view, in [-pi, pi).
  double heading_rad = 0.0;
  /// Normalised correlation of the views at the first estimate of the heading, -1 .. 1 [S06 eq.
  /// 33].
  double correlation = 0.0;
  /// Share of the energy of both views that turn and displacement leave unexplained, 0 .. 1.
  double residual = 1.0;
  /// Covariance of xi, eta and the heading, row-major, in units of R^2, R rad and rad^2, from the
  /// residual of the least squares: valid if the vector is right, and says nothing of whether it
  /// is.
  std::array<double, 9> covariance{};
  /// Effective number of frequencies: the sum of their weights.
  double frequencies = 0.0;

  [[nodiscard]] double length() const noexcept;         ///< in units of R
  [[nodiscard]] double direction_rad() const noexcept;  ///< in the current robot frame
  /// Standard deviation of the direction by the least squares; at most pi, as at home.
  [[nodiscard]] double direction_deviation_rad() const noexcept;
  /// True if the vector is longer than its standard deviation. False at home, where there is no
  /// direction.
  [[nodiscard]] bool has_direction() const noexcept;
  /// Logarithm of the likelihood of the residual against unrelated views, except for a constant.
  /// Residuals alone cannot be compared: at a wrong heading only the few frequencies that match
  /// have weight.
  [[nodiscard]] double log_likelihood() const noexcept;
};

/// Largest value of `FourierHomingOptions::starting_estimates`.
inline constexpr int max_starting_estimates = 6;

/// Options of Fourier homing. The defaults are our own rule; `published_homing_options` returns the
/// rule of S06.
struct FourierHomingOptions {
  /// Rule by which the heading between the views is estimated first.
  enum class TurnEstimate {
    sequential,  ///< S06's rule: each component refines those before [S06 eq. 40-43]
    global,      ///< the maximum of the correlation over all headings
  };
  /// The view at which the derivative of the image is taken.
  enum class Gradient {
    current,  ///< as published [S06 eq. 20]
    both,     ///< the mean of both views: errors of second order in the displacement cancel
  };
  /// Weights of components and rows.
  enum class Weights {
    equal,  ///< as published: equal weights
    /// Weights by the coherence of both views: components whose phases are unrelated get less
    /// weight. With the distance of the views this happens at ever lower frequencies, so that far
    /// views are compared coarsely and near ones finely, without a known distance.
    coherence,
  };

  int highest = 0;     ///< K, the highest compared frequency; 0: all common ones but the last
  int iterations = 0;  ///< N_it of S06 section 2.3
  /// Compare few frequencies in the first iteration and more in each further one, up to K [S06
  /// footnote 6].
  bool rising = false;
  TurnEstimate turn = TurnEstimate::global;  ///< how the first heading is estimated
  Gradient gradient = Gradient::both;        ///< where the slope of the image is taken
  Weights weights = Weights::coherence;      ///< of components and rows
  /// Number of headings for which the displacement is solved; the solution with the least residual
  /// is used [S06 footnote 10].
  int starting_estimates = 2;
  /// Test displacements up to two thirds of R first, as hs_ei does, and start the least squares
  /// from the best one, with the current view transformed to its expected image there; needed for
  /// far views.
  bool displacement_search = true;
  /// Model the vertical motion of things off the horizon in the image as the robot approaches; used
  /// only if elevations are known.
  bool vertical_motion = true;
  /// Also solve for the tilt of the robot relative to the home view, one or two degrees on uneven
  /// ground; used only if elevations are known.
  bool tilt = true;
  friend bool operator==(const FourierHomingOptions&, const FourierHomingOptions&) = default;
};
void visit_options(FourierHomingOptions& options, OptionVisitor& visitor);

/// Returns the options of hs_Fi as published, with K = `highest`.
[[nodiscard]] FourierHomingOptions published_homing_options(int highest, int iterations = 0);

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
