#include "panonav/relative_pose/fourier_homing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/relative_pose/internal/coherence_weights.hpp"
#include "panonav/relative_pose/internal/displacement.hpp"
#include "panonav/relative_pose/internal/pair_equations.hpp"
#include "panonav/relative_pose/turn_correlation.hpp"

namespace panonav {

namespace {

// Calls visit(k, cos(k turn), sin(k turn)) for k = 0 .. frequencies - 1.
template <class Visit>
void for_frequencies(int frequencies, double turn_rad, const Visit& visit) {
  const double step_cosine = std::cos(turn_rad);
  const double step_sine = std::sin(turn_rad);
  double cosine = 1.0;
  double sine = 0.0;
  for (int k = 0; k < frequencies; ++k) {
    visit(k, static_cast<float>(cosine), static_cast<float>(sine));
    const double next = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = next;
  }
}

// What one row becomes when the robot turns.
void turn_row(std::span<float> a, std::span<float> b, double turn_rad) {
  for_frequencies(static_cast<int>(a.size()), turn_rad, [&](int k, float cosine, float sine) {
    const float turned = a[k] * cosine + b[k] * sine;
    b[k] = b[k] * cosine - a[k] * sine;
    a[k] = turned;
  });
}

class PairOfViews {
 public:
  PairOfViews(const HomingView& home, const HomingView& current,
              const FourierHomingOptions& options, int highest, const TurnWindow& window = {})
      : home_(home),
        current_(current),
        options_(options),
        window_(window),
        rows_(static_cast<std::size_t>(home.rows())),
        highest_(highest),
        // Iterations need one frequency more each [S06 eq. 23-26].
        known_(std::min(std::min(home.components(), current.components()) - 1,
                        highest + 1 + options.iterations)),
        c_(rows_, static_cast<std::size_t>(known_) + 1) {
    for (int k = 0; k <= known_; ++k) {
      std::copy_n(current.cosines(k).data(), rows_, c_.current_a(k));
      std::copy_n(current.sines(k).data(), rows_, c_.current_b(k));
    }
    if (!sees_rise()) return;
    const auto& band = home.elevations();
    const double row_rad = (band->top_rad - band->bottom_rad) / static_cast<double>(rows_);
    for (std::size_t y = 0; y < rows_; ++y) {
      const double elevation = band->top_rad - (static_cast<double>(y) + 0.5) * row_rad;
      approach_.push_back(static_cast<float>(std::sin(elevation) * std::cos(elevation)));
      tangent_.push_back(static_cast<float>(std::tan(elevation)));
    }
  }

  HomeVector result();
  [[nodiscard]] double difference();

 private:
  void correlate();
  void turn_home(double turn_rad);
  void weigh();
  void take_slopes();
  // Whether it is known how the image changes from row to row.
  [[nodiscard]] bool sees_rise() const noexcept {
    return (options_.vertical_motion || options_.tilt) && home_.elevations() && rows_ >= 3;
  }
  void sum_equations();
  [[nodiscard]] PairSolution solve_at(double turn_rad);
  void move_current(double xi, double eta);
  // Where the least squares start, with the heading that fits there.
  struct Start {
    Displacement displacement;
    double ahead_rad = 0.0;  // from which the displacement's direction is counted
    double turn_rad = 0.0;
  };
  [[nodiscard]] Start search() const;
  void move_current(const Start& start);

  const HomingView& home_;
  const HomingView& current_;
  const FourierHomingOptions& options_;
  TurnWindow window_;
  std::size_t rows_;
  int highest_;
  int known_;
  PairCoefficients c_;
  TurnCorrelation correlation_;
  double home_energy_ = 0.0;
  double current_energy_ = 0.0;
  PerFrequency component_weights_{};
  // By row: how fast things rise as the robot comes nearer, and the tangent of the elevation.
  std::vector<float> approach_, tangent_;
  std::vector<float> row_weights_;  // empty: all alike
  PairEquations normal_;
};

// Correlation of the home view, not turned, with the current view, summed over the rows.
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

void PairOfViews::turn_home(double turn_rad) {
  for_frequencies(known_ + 1, turn_rad, [&](int k, float c, float s) {
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

// By coherence at the present turn: components by a Gaussian as wide as there are coherent ones,
// over their amplitude, rows by their coherence within it. The power of views falls with about the
// square of the frequency [S06 section 4.5], so that without the amplitude the first few would
// decide alone. What unequal distances leave unexplained is a share of the power, what pixels leave
// is the same for all frequencies: the amplitude is half way between the two.
void PairOfViews::weigh() {
  for (int k = 1; k <= highest_; ++k) component_weights_[static_cast<std::size_t>(k)] = 1.0;
  row_weights_.clear();
  if (options_.weights == HomingWeights::equal) return;

  PerFrequency coherences{};
  PerFrequency powers{};
  double power = 0.0;
  for (int k = 1; k <= highest_; ++k) {
    float common = 0.0F;
    float home = 0.0F;
    float current = 0.0F;
    const float* const ha = c_.home_a(k);
    const float* const hb = c_.home_b(k);
    const float* const ca = c_.current_a(k);
    const float* const cb = c_.current_b(k);
    for (std::size_t y = 0; y < rows_; ++y) {
      common += ha[y] * ca[y] + hb[y] * cb[y];
      home += ha[y] * ha[y] + hb[y] * hb[y];
      current += ca[y] * ca[y] + cb[y] * cb[y];
    }
    const float most = std::sqrt(home) * std::sqrt(current);
    if (most > 0.0F) coherences[static_cast<std::size_t>(k)] = static_cast<double>(common / most);
    powers[static_cast<std::size_t>(k)] = static_cast<double>(home + current);
    power += powers[static_cast<std::size_t>(k)] / highest_;
  }
  component_weights_ = fitted_gaussian(coherences, highest_);
  over_amplitude(component_weights_, powers, power, highest_);
  if (rows_ == 1) return;

  std::vector<double> common(rows_);
  std::vector<double> home(rows_);
  std::vector<double> current(rows_);
  for (int k = 1; k <= highest_; ++k) {
    const double weight = component_weights_[static_cast<std::size_t>(k)];
    const float* const ha = c_.home_a(k);
    const float* const hb = c_.home_b(k);
    const float* const ca = c_.current_a(k);
    const float* const cb = c_.current_b(k);
    for (std::size_t y = 0; y < rows_; ++y) {
      common[y] += weight * static_cast<double>(ha[y] * ca[y] + hb[y] * cb[y]);
      home[y] += weight * static_cast<double>(ha[y] * ha[y] + hb[y] * hb[y]);
      current[y] += weight * static_cast<double>(ca[y] * ca[y] + cb[y] * cb[y]);
    }
  }
  constexpr double least = 0.05;  // no row is left out, so that a bad compass can recover
  row_weights_.resize(rows_);
  for (std::size_t y = 0; y < rows_; ++y) {
    const double most = std::sqrt(home[y]) * std::sqrt(current[y]);
    row_weights_[y] =
        static_cast<float>(most > 0.0 ? std::clamp(common[y] / most, least, 1.0) : least);
  }
}

void PairOfViews::take_slopes() {
  const int top = std::min(known_, highest_ + 1);
  const bool both = options_.gradient == HomingGradient::both;
  for (int k = 0; k <= top; ++k) {
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
    const auto& band = home_.elevations();
    if (!sees_rise()) continue;
    const double row_rad = (band->top_rad - band->bottom_rad) / static_cast<double>(rows_);
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

// At the present turn and with the present weights.
void PairOfViews::sum_equations() {
  take_slopes();
  RowTerms terms{.weights = row_weights_, .tangent = tangent_};
  if (options_.vertical_motion) terms.approach = approach_;
  normal_ = {};
  for (int k = 1; k <= highest_; ++k) {
    normal_.add(pair_equations(c_, k, rows_, terms),
                component_weights_[static_cast<std::size_t>(k)]);
  }
  if (options_.tilt && sees_rise()) {
    TiltEquations tilt;
    double equations = 0.0;
    for (int k = 1; k <= highest_; ++k) {
      const double weight = component_weights_[static_cast<std::size_t>(k)];
      tilt.add(tilt_equations(c_, k, rows_, terms), weight);
      equations += 2.0 * weight * static_cast<double>(rows_);
    }
    // Robots tilt by a degree or two: more must be shown by the views.
    constexpr double usual_rad = 0.035;
    const double certain = normal_.energy / std::max(1.0, equations) / (usual_rad * usual_rad);
    normal_ = without_tilt(normal_, tilt, certain);
  }
}

PairSolution PairOfViews::solve_at(double turn_rad) {
  turn_home(turn_rad);
  weigh();
  sum_equations();
  return solve(normal_);
}

// a_k + a_k^x xi + a_k^y eta -> a_k, with the slopes of the current view [S06 section 2.3].
void PairOfViews::move_current(double xi, double eta) {
  const auto x = static_cast<float>(xi);
  const auto y = static_cast<float>(eta);
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

// Rows are averaged to a few bands: things move less than a band up or down, and coarse structure
// decides. Directions are counted from where the first frequency of the current view has its
// maximum, so that a turn of the robot changes nothing.
PairOfViews::Start PairOfViews::search() const {
  constexpr std::size_t max_bands = 8;
  // The current view is known to more frequencies than are compared.
  const int frequencies = std::min(known_, 2 * searched_frequencies);
  const std::size_t bands = std::min(max_bands, rows_);
  const auto stride = static_cast<std::size_t>(frequencies) + 1;
  std::vector<float> values(4 * bands * stride);
  const auto part = [&](std::size_t i) {
    return std::span(values).subspan(i * bands * stride, bands * stride);
  };
  float ahead_a = 0.0F;
  float ahead_b = 0.0F;
  for (std::size_t band = 0; band < bands; ++band) {
    const std::size_t begin = band * rows_ / bands;
    const std::size_t end = (band + 1) * rows_ / bands;
    for (int k = 0; k <= frequencies; ++k) {
      const std::size_t at = band * stride + static_cast<std::size_t>(k);
      for (std::size_t y = begin; y < end; ++y) {
        part(0)[at] += home_.cosines(k)[y];
        part(1)[at] += home_.sines(k)[y];
        part(2)[at] += current_.cosines(k)[y];
        part(3)[at] += current_.sines(k)[y];
      }
    }
    ahead_a += part(2)[band * stride + 1];
    ahead_b += part(3)[band * stride + 1];
  }
  const double ahead_rad = std::atan2(static_cast<double>(ahead_b), static_cast<double>(ahead_a));
  for (std::size_t band = 0; band < bands; ++band) {
    turn_row(part(2).subspan(band * stride, stride), part(3).subspan(band * stride, stride),
             ahead_rad);
  }
  const BestDisplacement best = best_displacement(
      part(0), part(1), part(2), part(3), static_cast<int>(bands), frequencies,
      {window_.middle_rad - static_cast<float>(ahead_rad), window_.half_width_rad});
  return {best.displacement, ahead_rad, static_cast<double>(best.turn_rad) + ahead_rad};
}

// The expected image at a displacement of any length.
void PairOfViews::move_current(const Start& start) {
  const auto count = static_cast<std::size_t>(known_) + 1;
  std::array<float, max_displaced_frequencies + 1> a{};
  std::array<float, max_displaced_frequencies + 1> b{};
  std::array<float, max_displaced_frequencies + 1> to_a{};
  std::array<float, max_displaced_frequencies + 1> to_b{};
  for (std::size_t y = 0; y < rows_; ++y) {
    for (int k = 0; k <= known_; ++k) {
      a[static_cast<std::size_t>(k)] = c_.current_a(k)[y];
      b[static_cast<std::size_t>(k)] = c_.current_b(k)[y];
    }
    turn_row(std::span(a).first(count), std::span(b).first(count), start.ahead_rad);
    displace(start.displacement, std::span(a).first(count), std::span(b).first(count),
             std::span(to_a).first(count), std::span(to_b).first(count));
    turn_row(std::span(to_a).first(count), std::span(to_b).first(count), -start.ahead_rad);
    for (int k = 0; k <= known_; ++k) {
      c_.current_a(k)[y] = to_a[static_cast<std::size_t>(k)];
      c_.current_b(k)[y] = to_b[static_cast<std::size_t>(k)];
    }
  }
}

HomeVector PairOfViews::result() {
  HomeVector vector;
  std::optional<Start> found;
  if (options_.displacement_search) {
    found = search();
    const double direction = found->displacement.direction_rad() + found->ahead_rad;
    if (found->displacement.ring > 0) move_current(*found);
    vector.xi = found->displacement.length() * std::cos(direction);
    vector.eta = found->displacement.length() * std::sin(direction);
  }
  const int last = options_.iterations;
  const int max_frequencies = highest_;
  for (int iteration = 0;; ++iteration) {
    if (options_.rising) {
      highest_ = std::max(1, max_frequencies * (iteration + 1) / (last + 1));
    }
    correlate();
    const double most = std::sqrt(home_energy_) * std::sqrt(current_energy_);
    // Views are of the order of 1, so a transform in single precision leaves less than this of
    // nothing.
    constexpr double rounding = 1e-6;
    if (!(most > rounding * rounding * static_cast<double>(rows_))) return {};

    std::array<float, max_starting_estimates> turns{};
    int starts = 1;
    if (found && found->displacement.ring > 0 && iteration == 0) {
      turns[0] = static_cast<float>(found->turn_rad);
    } else if (options_.turn == TurnEstimate::sequential) {
      turns[0] = sequential_turn(correlation_);
    } else {
      starts = highest_turns(
          correlation_,
          std::span(turns).first(static_cast<std::size_t>(options_.starting_estimates)), window_);
      if (starts == 0) return {};
    }
    PairSolution best;
    double best_residual = 2.0;
    double best_turn = 0.0;
    double variance = 0.0;
    for (int i = 0; i < starts; ++i) {
      const double turn = static_cast<double>(turns[static_cast<std::size_t>(i)]);
      // A heading at which the views do not even correlate half as well explains nothing better.
      const auto value = static_cast<double>(correlation_.at(static_cast<float>(turn)));
      if (i > 0 && value < 0.5 * static_cast<double>(correlation_.at(turns[0]))) break;
      const PairSolution solution = solve_at(turn);
      const double left = std::max(0.0, normal_.energy - solution.explained);
      const double residual = normal_.energy_of_views > 0.0 ? left / normal_.energy_of_views : 1.0;
      if (residual >= best_residual) continue;
      best = solution;
      best_residual = residual;
      best_turn = turn;
      double equations = 0.0;
      for (int k = 1; k <= highest_; ++k) {
        equations += component_weights_[static_cast<std::size_t>(k)];
      }
      vector.frequencies = equations;
      equations *= 2.0 * static_cast<double>(rows_);
      // Coefficients have about four digits at best: noise of pixels, rounding of phases.
      constexpr double certain = 1e-8;
      const double noise = std::max(left, certain * normal_.energy_of_views);
      variance = noise / std::max(1.0, equations - 3.0) * best.variance;
      vector.correlation = std::clamp(value / most, -1.0, 1.0);
    }
    vector.xi += best.xi;
    vector.eta += best.eta;
    vector.heading_rad = wrap_angle(best_turn + best.turn);
    vector.residual = std::min(1.0, best_residual);
    const double square = vector.xi * vector.xi + vector.eta * vector.eta;
    vector.confidence = square > 0.0 ? square / (square + variance) : 0.0;
    if (iteration >= last) return vector;
    move_current(best.xi, best.eta);
  }
}

double PairOfViews::difference() {
  correlate();
  std::array<float, 1> turn{};
  if (!(home_energy_ + current_energy_ > 0.0) || highest_turns(correlation_, turn) == 0) return 1.0;
  turn_home(static_cast<double>(turn[0]));
  weigh();
  sum_equations();
  return std::clamp(normal_.energy / normal_.energy_of_views, 0.0, 2.0);
}

int highest_used(const HomingView& home, const HomingView& current, int highest) {
  const int common = std::min(home.components(), current.components());
  const int most = std::min(common - 2, TurnCorrelation::max_frequencies);
  return highest == 0 ? most : highest;
}

void check_pair(const HomingView& home, const HomingView& current, int highest) {
  require(home.rows() == current.rows(), "rows of the current view", current.rows(),
          to_text(home.rows()) + ", as of the home view");
  const int common = std::min(home.components(), current.components());
  require(common >= 3, "components of the views", common, ">= 3");
  const int most = std::min(common - 2, TurnCorrelation::max_frequencies);
  require(highest >= 0 && highest <= most, "highest frequency", highest,
          "0 (all) or 1 .. " + to_text(most));
}

}  // namespace

double HomeVector::length() const noexcept {
  return std::hypot(xi, eta);
}

double HomeVector::direction_rad() const noexcept {
  return std::atan2(eta, xi);
}

HomeVector home_vector(const HomingView& home, const HomingView& current,
                       const FourierHomingOptions& options) {
  validate(options);
  check_pair(home, current, options.highest);
  return home_vector_unchecked(home, current, options);
}

HomeVector home_vector_near(const HomingView& home, const HomingView& current, double heading_rad,
                            double within_rad, const FourierHomingOptions& options) {
  validate(options);
  check_pair(home, current, options.highest);
  require(std::isfinite(heading_rad), "heading", heading_rad, "finite");
  require(within_rad > 0.0 && within_rad <= std::numbers::pi, "within", within_rad,
          "> 0 and <= pi");
  require(options.turn == TurnEstimate::global, "turn estimate", static_cast<double>(options.turn),
          "global");
  return PairOfViews(home, current, options, highest_used(home, current, options.highest),
                     {static_cast<float>(heading_rad), static_cast<float>(within_rad)})
      .result();
}

HomeVector home_vector_unchecked(const HomingView& home, const HomingView& current,
                                 const FourierHomingOptions& options) {
  return PairOfViews(home, current, options, highest_used(home, current, options.highest)).result();
}

double image_difference(const HomingView& home, const HomingView& current, int highest) {
  check_pair(home, current, highest);
  FourierHomingOptions options = published_homing(highest);
  options.gradient = HomingGradient::both;
  options.tilt = true;
  return PairOfViews(home, current, options, highest_used(home, current, highest)).difference();
}

}  // namespace panonav
