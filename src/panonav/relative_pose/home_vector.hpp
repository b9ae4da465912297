#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "panonav/relative_pose/turn_correlation.hpp"

/// Home vectors without heap memory, exceptions and files: the part of homing that also runs on a
/// microcontroller, with the same bits. `home_vector` in fourier_homing.hpp checks its arguments.
namespace panonav {

/// The Fourier coefficients of a view, stored elsewhere as `HomingView` stores them:
/// component-major, rows >= 1, components >= 2.
struct CoefficientView {
  int rows = 0;                        ///< from the highest elevation to the lowest
  int components = 0;                  ///< frequencies k = 0 .. components - 1
  const float* all_cosines = nullptr;  ///< rows * components numbers
  const float* all_sines = nullptr;    ///< rows * components numbers
  bool has_elevations = false;         ///< false: all rows are treated as on the horizon
  double bottom_rad = 0.0;             ///< lowest elevation of the rows
  double top_rad = 0.0;                ///< highest elevation of the rows

  /// a_k of all rows.
  [[nodiscard]] std::span<const float> cosines(int k) const noexcept {
    return {all_cosines + offset(k), static_cast<std::size_t>(rows)};
  }
  /// b_k of all rows.
  [[nodiscard]] std::span<const float> sines(int k) const noexcept {
    return {all_sines + offset(k), static_cast<std::size_t>(rows)};
  }

 private:
  [[nodiscard]] std::size_t offset(int k) const noexcept {
    return static_cast<std::size_t>(k) * static_cast<std::size_t>(rows);
  }
};

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
/// Returns the options of hs_Fi as published, with K = `highest`.
[[nodiscard]] FourierHomingOptions published_homing_options(int highest, int iterations = 0);

/// Returns the highest frequency that both views allow to compare, or `highest` unless it is 0.
[[nodiscard]] int choose_highest_frequency(const CoefficientView& home,
                                           const CoefficientView& current, int highest) noexcept;

/// Computes the home vector as `home_vector` does, to the bit. The caller guarantees what that
/// function checks. Uses no heap memory if rows * components <= 64.
[[nodiscard]] HomeVector find_home_vector(const CoefficientView& home,
                                          const CoefficientView& current,
                                          const FourierHomingOptions& options = {},
                                          const HeadingWindow& window = {});

/// Computes the tables that the first home vector would compute, so that no picture waits for them.
void fill_homing_tables() noexcept;

/// Computes the correlation of `find_home_vector` alone, as `home_vector_correlation` does.
[[nodiscard]] double find_correlation(const CoefficientView& home, const CoefficientView& current,
                                      const FourierHomingOptions& options = {},
                                      const HeadingWindow& window = {});

/// Computes the difference of the views as `image_difference` does.
[[nodiscard]] double find_difference(const CoefficientView& home, const CoefficientView& current,
                                     int highest = 0);

}  // namespace panonav
