#pragma once

#include "panonav/core/options.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

/// The displacement and turn between two views.
struct HomeVector {
  /// Displacement to home, forwards, in the frame of the robot that took the current view; in units
  /// of the distance R at which all things are assumed to be.
  double xi = 0.0;
  double eta = 0.0;  ///< the same to the left
  /// Heading of the home view minus heading of the current view, in [-pi, pi).
  double heading_rad = 0.0;
  /// Correlation of the views at the heading found first, -1 .. 1 [S06 eq. 33 over its largest
  /// possible value].
  double correlation = 0.0;
  /// Share of the energy of both views that turn and displacement leave unexplained, 0 .. 1.
  double residual = 1.0;
  /// Confidence 0 .. 1: the square of the vector's length over that square plus its variance, which
  /// follows from the residual. Near 0 at home, where there is no direction.
  double confidence = 0.0;
  /// Effective number of frequencies: the sum of their weights.
  double frequencies = 0.0;

  [[nodiscard]] double length() const noexcept;         ///< in units of R
  [[nodiscard]] double direction_rad() const noexcept;  ///< in the current robot frame
};

/// Largest value of `FourierHomingOptions::starting_estimates`.
inline constexpr int max_starting_estimates = 6;

/// The defaults are our own rule; `published_homing_options` is S06's.
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
    /// Weights by the coherence of both views: components fade out where their phases are
    /// unrelated, which happens at lower frequencies the farther the views are apart. A far view is
    /// thus compared coarsely and a near one finely, without a known distance.
    coherence,
  };

  int highest = 0;     ///< K, the highest frequency; 0: all but one that both views have
  int iterations = 0;  ///< N_it of S06 section 2.3
  /// The first iteration compares a few frequencies, each further one more, up to K [S06 footnote
  /// 6].
  bool rising = false;
  TurnEstimate turn = TurnEstimate::global;  ///< how the first heading is estimated
  Gradient gradient = Gradient::both;        ///< where the slope of the image is taken
  Weights weights = Weights::coherence;      ///< of components and rows
  /// Headings from which the displacement is solved; the best explanation of the views counts [S06
  /// footnote 10].
  int starting_estimates = 2;
  /// Tries displacements up to two thirds of R first, as hs_ei does, and starts the least squares
  /// from the best one: views from far away are thus compared as they would look from there.
  bool displacement_search = true;
  /// Things off the horizon also move up and down in the image as the robot approaches. Used only
  /// where elevations are known.
  bool vertical_motion = true;
  /// Solves also for the robot's tilt against the home view, a degree or two on uneven ground. Used
  /// only where elevations are known.
  bool tilt = true;
  friend bool operator==(const FourierHomingOptions&, const FourierHomingOptions&) = default;
};
void visit_options(FourierHomingOptions& options, OptionVisitor& visitor);

/// Returns the options of hs_Fi as published, with K = `highest`.
[[nodiscard]] FourierHomingOptions published_homing_options(int highest, int iterations = 0);

/// Computes the home vector by Fourier homing [S06 section 2.3, eq. 16-30; see docs/equations.md]:
/// the heading first, then displacement and a correction of the heading in least squares over the
/// components of all rows. Iterations move the current view by the result and solve again.
/// Identical views give the zero vector with confidence 0; without structure all zeros and
/// residual 1, as does a `window` in which no heading fits better than its neighbours. Throws
/// OptionError; ContractError if the views differ in rows or share fewer than K + 2 components, and
/// for a window unless 0 < half_width_rad <= pi and the turn estimate is global. Cost: O(rows K),
/// below a microsecond for one row and K = 5.
[[nodiscard]] HomeVector home_vector(const HomingView& home, const HomingView& current,
                                     const FourierHomingOptions& options = {},
                                     const std::optional<HeadingWindow>& window = std::nullopt);

/// Computes the same without checks of options and views, for loops.
[[nodiscard]] HomeVector home_vector_unchecked(const HomingView& home, const HomingView& current,
                                               const FourierHomingOptions& options);

/// Computes the sum of squared differences of the first K components at the heading of their best
/// correlation [S06 eq. 15, 28], relative to the energy of both views: 0 for the same place, about
/// 1 for unrelated views. Where elevations are known, differences by a tilt of the robot by a few
/// degrees do not count. Throws ContractError as `home_vector`.
[[nodiscard]] double image_difference(const HomingView& home, const HomingView& current,
                                      int highest = 0);

}  // namespace panonav
