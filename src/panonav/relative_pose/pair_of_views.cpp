#include "panonav/relative_pose/home_vector.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>

#include "panonav/core/portable_math.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/internal/coherence_weights.hpp"
#include "panonav/relative_pose/internal/displacement.hpp"
#include "panonav/relative_pose/internal/pair_equations.hpp"
#include "panonav/relative_pose/internal/row_buffer.hpp"
#include "panonav/relative_pose/internal/turn_coefficients.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

namespace {

double compute_log_likelihood(double frequencies, double residual) {
  constexpr double min_residual = 1e-12;  // keeps equal views finite
  return -frequencies * portable::log(std::clamp(residual, min_residual, 1.0));
}

class PairOfViews {
 public:
  PairOfViews(const CoefficientView& home, const CoefficientView& current,
              const FourierHomingOptions& options, int highest, const HeadingWindow& window = {})
      : home_(home),
        current_(current),
        options_(options),
        window_(window),
        rows_(static_cast<std::size_t>(home.rows)),
        max_frequency_(highest),
        highest_(highest),
        // Each iteration needs one more frequency [S06 eq. 23-26].
        known_(std::min(std::min(home.components, current.components) - 1,
                        highest + 1 + options.iterations)),
        c_(rows_, static_cast<std::size_t>(known_) + 1),
        approach_(rows_),
        tangent_(rows_),
        row_weights_(rows_) {
    for (int k = 0; k <= known_; ++k) {
      std::copy_n(current.cosines(k).data(), rows_, c_.current_a(k));
      std::copy_n(current.sines(k).data(), rows_, c_.current_b(k));
    }
  }

  HomeVector find_vector();
  [[nodiscard]] double find_correlation();
  [[nodiscard]] double compute_difference();

 private:
  /// True if derivatives of the image by elevation are used.
  [[nodiscard]] bool uses_rows() const noexcept {
    return (options_.vertical_motion || options_.tilt) && home_.has_elevations && rows_ >= 3;
  }
  [[nodiscard]] bool has_start() const noexcept { return start_ && start_->displacement.ring > 0; }

  void search_displacement();
  void set_highest_frequency(int iteration);
  void correlate();
  [[nodiscard]] bool has_structure() const;
  [[nodiscard]] std::span<const float> find_headings(int iteration);
  [[nodiscard]] std::span<const float> drop_weak_headings(std::span<const float> headings) const;
  void solve_at_best_heading(std::span<const float> headings);
  void move_current(const PairSolution& solution);

  [[nodiscard]] PairSolution solve_at(double turn_rad);
  void set_best(float turn_rad, const PairSolution& solution, double residual);
  [[nodiscard]] double correlation_at(float turn_rad) const {
    return static_cast<double>(correlation_.at(turn_rad));
  }
  [[nodiscard]] double normalised_correlation_at(float turn_rad) const;
  void rotate_home(double turn_rad);
  void set_weights();
  [[nodiscard]] double sum_component_weights() const;
  void set_row_geometry_if_needed();
  void average_views();
  void differentiate_rows();
  void sum_equations();
  void eliminate_tilt(const RowTerms& terms);
  void displace_current(const DisplacementStart& start);

  const CoefficientView& home_;
  const CoefficientView& current_;
  const FourierHomingOptions& options_;
  HeadingWindow window_;
  std::size_t rows_;
  int max_frequency_;  // K
  int highest_;        // highest compared frequency of the present iteration
  int known_;
  PairCoefficients c_;
  std::optional<DisplacementStart> start_;
  std::array<float, max_starting_estimates> headings_{};
  TurnCorrelation correlation_;
  double home_energy_ = 0.0;
  double current_energy_ = 0.0;
  PerFrequency component_weights_{};
  // Per row: how fast things rise as the robot approaches, and the tangent of the elevation.
  RowBuffer<float, max_rows_without_heap> approach_, tangent_;
  bool has_row_geometry_ = false;
  RowBuffer<float, max_rows_without_heap> row_weights_;
  bool has_row_weights_ = false;  // false: equal weights
  PairEquations normal_;
  PairSolution best_;  // best one in the present iteration
  HomeVector vector_;
};

// Fourier homing [S06 section 2.3]
HomeVector PairOfViews::find_vector() {
  if (options_.displacement_search) search_displacement();  // eq. 3, as in section 3
  for (int iteration = 0;; ++iteration) {
    set_highest_frequency(iteration);  // footnote 6
    correlate();                       // eq. 33
    if (!has_structure()) return {};
    const auto headings = find_headings(iteration);  // eq. 33-43, footnote 10
    if (headings.empty()) return {};
    solve_at_best_heading(drop_weak_headings(headings));  // eq. 17-20, 29-30
    if (iteration >= options_.iterations) return vector_;
    move_current(best_);  // eq. 23-26
  }
}

// Returns the correlation of `find_vector`. Solves only to choose between several headings.
double PairOfViews::find_correlation() {
  if (options_.iterations > 0) return find_vector().correlation;
  if (options_.displacement_search) search_displacement();
  set_highest_frequency(0);
  correlate();
  if (!has_structure()) return 0.0;
  const auto headings = drop_weak_headings(find_headings(0));
  if (headings.empty()) return 0.0;
  if (headings.size() == 1) return normalised_correlation_at(headings[0]);
  solve_at_best_heading(headings);
  return vector_.correlation;
}

void PairOfViews::search_displacement() {
  start_ = find_displacement_start(home_, current_, known_, window_);
  const double direction = start_->displacement.direction_rad() + start_->ahead_rad;
  if (has_start()) displace_current(*start_);
  vector_.xi = start_->displacement.length() * portable::cos(direction);
  vector_.eta = start_->displacement.length() * portable::sin(direction);
}

void PairOfViews::set_highest_frequency(int iteration) {
  if (!options_.rising) return;
  highest_ = std::max(1, max_frequency_ * (iteration + 1) / (options_.iterations + 1));
}

// Correlates the home view, not rotated, with the current view, summed over the rows [S06 eq. 33].
void PairOfViews::correlate() {
  correlation_.highest = highest_;
  home_energy_ = current_energy_ = 0.0;
  for (int k = 1; k <= highest_; ++k) {
    const float* const ha = home_.cosines(k).data();
    const float* const hb = home_.sines(k).data();
    const float* const ca = c_.current_a(k);
    const float* const cb = c_.current_b(k);
    float real = 0.0F;
    float imaginary = 0.0F;
    float home_energy = 0.0F;
    float current_energy = 0.0F;
    for (std::size_t y = 0; y < rows_; ++y) {
      real += ha[y] * ca[y] + hb[y] * cb[y];
      imaginary += ha[y] * cb[y] - hb[y] * ca[y];
      home_energy += ha[y] * ha[y] + hb[y] * hb[y];
      current_energy += ca[y] * ca[y] + cb[y] * cb[y];
    }
    correlation_.real[static_cast<std::size_t>(k)] = real;
    correlation_.imaginary[static_cast<std::size_t>(k)] = imaginary;
    home_energy_ += static_cast<double>(home_energy);
    current_energy_ += static_cast<double>(current_energy);
  }
}

bool PairOfViews::has_structure() const {
  // Largest rounding error of the coefficients of a constant view in single precision, as values
  // are of the order of 1.
  constexpr double rounding = 1e-6;
  const double max_correlation = std::sqrt(home_energy_) * std::sqrt(current_energy_);
  return max_correlation > rounding * rounding * static_cast<double>(rows_);
}

std::span<const float> PairOfViews::find_headings(int iteration) {
  int count = 1;
  if (has_start() && iteration == 0) {
    headings_[0] = static_cast<float>(start_->turn_rad);
  } else if (options_.turn == FourierHomingOptions::TurnEstimate::sequential) {
    headings_[0] = sequential_heading(correlation_);
  } else {
    const auto estimates = static_cast<std::size_t>(options_.starting_estimates);
    count = find_highest_peaks(correlation_, std::span(headings_).first(estimates), window_);
  }
  return std::span(headings_).first(static_cast<std::size_t>(count));
}

// Drops the headings from the first one on at which the views correlate less than half as well as
// at the best one, as these do not explain the views better.
std::span<const float> PairOfViews::drop_weak_headings(std::span<const float> headings) const {
  constexpr double min_share = 0.5;
  std::size_t count = std::min<std::size_t>(1, headings.size());
  while (count < headings.size() &&
         !(correlation_at(headings[count]) < min_share * correlation_at(headings[0]))) {
    ++count;
  }
  return headings.first(count);
}

void PairOfViews::solve_at_best_heading(std::span<const float> headings) {
  best_ = {};
  vector_.heading_rad = 0.0;
  vector_.residual = 1.0;
  double best_likelihood = -1.0;  // below all
  for (const float turn : headings) {
    const PairSolution solution = solve_at(static_cast<double>(turn));
    const double unexplained = std::max(0.0, normal_.energy - solution.explained);
    const double residual =
        normal_.energy_of_views > 0.0 ? unexplained / normal_.energy_of_views : 1.0;
    const double likelihood = compute_log_likelihood(sum_component_weights(), residual);
    if (likelihood <= best_likelihood) continue;
    best_likelihood = likelihood;
    set_best(turn, solution, residual);
  }
  vector_.xi += best_.xi;
  vector_.eta += best_.eta;
}

double PairOfViews::normalised_correlation_at(float turn_rad) const {
  const double max_correlation = std::sqrt(home_energy_) * std::sqrt(current_energy_);
  return std::clamp(correlation_at(turn_rad) / max_correlation, -1.0, 1.0);
}

void PairOfViews::rotate_home(double turn_rad) {
  for_each_frequency(known_ + 1, turn_rad, [&](int k, float c, float s) {
    const float* const a = home_.cosines(k).data();
    const float* const b = home_.sines(k).data();
    float* const turned_a = c_.home_a(k);
    float* const turned_b = c_.home_b(k);
    for (std::size_t y = 0; y < rows_; ++y) {
      turned_a[y] = a[y] * c - b[y] * s;
      turned_b[y] = a[y] * s + b[y] * c;
    }
  });
}

void PairOfViews::set_weights() {
  has_row_weights_ = false;
  if (options_.weights == FourierHomingOptions::Weights::equal) {
    for (int k = 1; k <= highest_; ++k) component_weights_[static_cast<std::size_t>(k)] = 1.0;
    return;
  }
  component_weights_ = compute_component_weights(c_, highest_, rows_);
  if (rows_ <= 1) return;
  compute_row_weights(c_, highest_, component_weights_, row_weights_.numbers());
  has_row_weights_ = true;
}

double PairOfViews::sum_component_weights() const {
  double sum = 0.0;
  for (int k = 1; k <= highest_; ++k) sum += component_weights_[static_cast<std::size_t>(k)];
  return sum;
}

void PairOfViews::set_row_geometry_if_needed() {
  if (!uses_rows() || has_row_geometry_) return;
  has_row_geometry_ = true;
  const double row_rad = (home_.top_rad - home_.bottom_rad) / static_cast<double>(rows_);
  for (std::size_t y = 0; y < rows_; ++y) {
    const double elevation = home_.top_rad - (static_cast<double>(y) + 0.5) * row_rad;
    const auto [cosine, sine] = portable::cosine_sine(elevation);
    approach_.numbers()[y] = static_cast<float>(sine * cosine);
    tangent_.numbers()[y] = static_cast<float>(sine / cosine);
  }
}

// Sets the view whose derivatives are used: the mean of both views, or the current one [S06 eq.
// 20].
void PairOfViews::average_views() {
  const bool both = options_.gradient == FourierHomingOptions::Gradient::both;
  for (int k = 0; k <= std::min(known_, highest_ + 1); ++k) {
    const float* const ha = c_.home_a(k);
    const float* const hb = c_.home_b(k);
    const float* const ca = c_.current_a(k);
    const float* const cb = c_.current_b(k);
    float* const ma = c_.middle_a(k);
    float* const mb = c_.middle_b(k);
    for (std::size_t y = 0; y < rows_; ++y) {
      ma[y] = both ? 0.5F * (ha[y] + ca[y]) : ca[y];
      mb[y] = both ? 0.5F * (hb[y] + cb[y]) : cb[y];
    }
  }
}

void PairOfViews::differentiate_rows() {
  const double row_rad = (home_.top_rad - home_.bottom_rad) / static_cast<double>(rows_);
  for (int k = 0; k <= std::min(known_, highest_ + 1); ++k) {
    const float* const ma = c_.middle_a(k);
    const float* const mb = c_.middle_b(k);
    float* const ra = c_.rise_a(k);
    float* const rb = c_.rise_b(k);
    for (std::size_t y = 0; y < rows_; ++y) {
      const std::size_t above = y == 0 ? 0 : y - 1;
      const std::size_t below = std::min(y + 1, rows_ - 1);
      const auto factor = static_cast<float>(1.0 / (row_rad * static_cast<double>(below - above)));
      ra[y] = factor * (ma[above] - ma[below]);
      rb[y] = factor * (mb[above] - mb[below]);
    }
  }
}

// Sums the normal equations at the present heading and weights [S06 eq. 30].
void PairOfViews::sum_equations() {
  set_row_geometry_if_needed();
  average_views();
  if (uses_rows()) differentiate_rows();
  RowTerms terms;
  if (has_row_weights_) terms.weights = row_weights_.numbers();
  if (has_row_geometry_) {
    terms.tangent = tangent_.numbers();
    if (options_.vertical_motion) terms.approach = approach_.numbers();
  }
  normal_ = {};
  for (int k = 1; k <= highest_; ++k) {
    normal_.add(panonav::sum_equations(c_, k, rows_, terms),
                component_weights_[static_cast<std::size_t>(k)]);
  }
  if (options_.tilt && uses_rows()) eliminate_tilt(terms);
}

void PairOfViews::eliminate_tilt(const RowTerms& terms) {
  TiltEquations tilt;
  double equations = 0.0;
  for (int k = 1; k <= highest_; ++k) {
    const double weight = component_weights_[static_cast<std::size_t>(k)];
    tilt.add(sum_tilt_equations(c_, k, rows_, terms), weight);
    equations += 2.0 * weight * static_cast<double>(rows_);
  }
  // Expected tilt on uneven ground: one standard deviation, 2 degrees (docs/decisions.md).
  constexpr double tilt_deviation_rad = 0.035;
  const double certainty =
      normal_.energy / std::max(1.0, equations) / (tilt_deviation_rad * tilt_deviation_rad);
  normal_ = panonav::eliminate_tilt(normal_, tilt, certainty);
}

PairSolution PairOfViews::solve_at(double turn_rad) {
  rotate_home(turn_rad);
  set_weights();
  sum_equations();
  return solve(normal_);
}

// Sets the home vector of the best heading so far.
void PairOfViews::set_best(float turn_rad, const PairSolution& solution, double residual) {
  best_ = solution;
  vector_.heading_rad = wrap_angle(static_cast<double>(turn_rad) + solution.turn);
  vector_.residual = std::min(1.0, residual);
  vector_.correlation = normalised_correlation_at(turn_rad);
  vector_.frequencies = sum_component_weights();
  // Coefficients have four digits at best, by the noise of pixels and the rounding of phases.
  constexpr double min_noise = 1e-8;
  const double unexplained = std::max(0.0, normal_.energy - solution.explained);
  const double noise = std::max(unexplained, min_noise * normal_.energy_of_views);
  const double equations = 2.0 * vector_.frequencies * static_cast<double>(rows_);
  const double variance = noise / std::max(1.0, equations - 3.0);
  const auto& s = solution.covariance;
  vector_.covariance = {s[3], s[4], s[1], s[4], s[5], s[2], s[1], s[2], s[0]};
  for (double& entry : vector_.covariance) entry *= variance;
}

// Moves the view: a_k + a_k^x xi + a_k^y eta -> a_k, by its own slopes [S06 eq. 23-26].
void PairOfViews::move_current(const PairSolution& solution) {
  const auto x = static_cast<float>(solution.xi);
  const auto y = static_cast<float>(solution.eta);
  for (std::size_t row = 0; row < rows_; ++row) {
    float la = 0.0F;
    float lb = 0.0F;
    for (int k = 1; k < known_; ++k) {
      const float a = c_.current_a(k)[row];
      const float b = c_.current_b(k)[row];
      const float lower = 0.5F * static_cast<float>(k - 1);
      const float upper = 0.5F * static_cast<float>(k + 1);
      const float ua = c_.current_a(k + 1)[row];
      const float ub = c_.current_b(k + 1)[row];
      c_.current_a(k)[row] += (upper * ua - lower * la) * x + (upper * ub + lower * lb) * y;
      c_.current_b(k)[row] += (upper * ub - lower * lb) * x - (upper * ua + lower * la) * y;
      la = a;
      lb = b;
    }
  }
}

// Replaces the current view by the expected image at a displacement [S06 eq. 3].
void PairOfViews::displace_current(const DisplacementStart& start) {
  const auto count = static_cast<std::size_t>(known_) + 1;
  std::array<float, max_displaced_frequency + 1> a{};
  std::array<float, max_displaced_frequency + 1> b{};
  std::array<float, max_displaced_frequency + 1> to_a{};
  std::array<float, max_displaced_frequency + 1> to_b{};
  for (std::size_t y = 0; y < rows_; ++y) {
    for (int k = 0; k <= known_; ++k) {
      a[static_cast<std::size_t>(k)] = c_.current_a(k)[y];
      b[static_cast<std::size_t>(k)] = c_.current_b(k)[y];
    }
    rotate_row(std::span(a).first(count), std::span(b).first(count), start.ahead_rad);
    displace(start.displacement, std::span(a).first(count), std::span(b).first(count),
             std::span(to_a).first(count), std::span(to_b).first(count));
    rotate_row(std::span(to_a).first(count), std::span(to_b).first(count), -start.ahead_rad);
    for (int k = 0; k <= known_; ++k) {
      c_.current_a(k)[y] = to_a[static_cast<std::size_t>(k)];
      c_.current_b(k)[y] = to_b[static_cast<std::size_t>(k)];
    }
  }
}

double PairOfViews::compute_difference() {
  correlate();
  std::array<float, 1> turn{};
  if (!(home_energy_ + current_energy_ > 0.0) || find_highest_peaks(correlation_, turn) == 0)
    return 1.0;
  rotate_home(static_cast<double>(turn[0]));
  set_weights();
  sum_equations();
  return std::clamp(normal_.energy / normal_.energy_of_views, 0.0, 2.0);
}

}  // namespace

double HomeVector::log_likelihood() const noexcept {
  return compute_log_likelihood(frequencies, residual);
}

int choose_highest_frequency(const CoefficientView& home, const CoefficientView& current,
                             int highest) noexcept {
  const int common = std::min(home.components, current.components);
  const int max_highest = std::min(common - 2, TurnCorrelation::max_frequencies);
  return highest == 0 ? max_highest : highest;
}

void fill_homing_tables() noexcept {
  fill_displacement_tables();
}

HomeVector find_home_vector(const CoefficientView& home, const CoefficientView& current,
                            const FourierHomingOptions& options, const HeadingWindow& window) {
  const int highest = choose_highest_frequency(home, current, options.highest);
  return PairOfViews(home, current, options, highest, window).find_vector();
}

double find_correlation(const CoefficientView& home, const CoefficientView& current,
                        const FourierHomingOptions& options, const HeadingWindow& window) {
  const int highest = choose_highest_frequency(home, current, options.highest);
  return PairOfViews(home, current, options, highest, window).find_correlation();
}

double find_difference(const CoefficientView& home, const CoefficientView& current, int highest) {
  FourierHomingOptions options = published_homing_options(highest);
  options.gradient = FourierHomingOptions::Gradient::both;
  options.tilt = true;
  return PairOfViews(home, current, options, choose_highest_frequency(home, current, highest))
      .compute_difference();
}

}  // namespace panonav
