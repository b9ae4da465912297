#include "panonav/homing/fourier_homing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/homing/displacement.hpp"
#include "panonav/homing/turn_correlation.hpp"

namespace panonav {

namespace {

constexpr int most_starts = 6;

// What is computed for one pair of views. One row lives on the stack, more rows on the heap.
class Coefficients {
 public:
  Coefficients(std::size_t rows, std::size_t components) : rows_(rows), size_(rows * components) {
    if (arrays * size_ > on_stack_.size()) on_heap_.resize(arrays * size_);
  }

  // Component-major like HomingView.
  [[nodiscard]] float* home_a(int k) noexcept { return at(0, k); }
  [[nodiscard]] float* home_b(int k) noexcept { return at(1, k); }
  [[nodiscard]] float* current_a(int k) noexcept { return at(2, k); }
  [[nodiscard]] float* current_b(int k) noexcept { return at(3, k); }
  // The view whose slope counts.
  [[nodiscard]] float* middle_a(int k) noexcept { return at(4, k); }
  [[nodiscard]] float* middle_b(int k) noexcept { return at(5, k); }
  // Its change with elevation.
  [[nodiscard]] float* rise_a(int k) noexcept { return at(6, k); }
  [[nodiscard]] float* rise_b(int k) noexcept { return at(7, k); }

 private:
  static constexpr std::size_t arrays = 8;
  static constexpr std::size_t stacked = TurnCorrelation::most_frequencies + 2;
  [[nodiscard]] float* at(std::size_t array, int k) noexcept {
    float* const first = on_heap_.empty() ? on_stack_.data() : on_heap_.data();
    return first + array * size_ + static_cast<std::size_t>(k) * rows_;
  }
  std::size_t rows_;
  std::size_t size_;
  std::array<float, arrays * stacked> on_stack_;  // not initialised: written before it is read
  std::vector<float> on_heap_;
};

// Normal equations of Delta, xi, eta, in this order.
struct Normal {
  std::array<double, 6> matrix{};  // 00 01 02 11 12 22
  std::array<double, 3> right{};
  double energy = 0.0;           // of what is to be explained
  double energy_of_views = 0.0;  // of both

  void add(const Normal& other, double weight) noexcept {
    for (std::size_t i = 0; i < 6; ++i) matrix[i] += weight * other.matrix[i];
    for (std::size_t i = 0; i < 3; ++i) right[i] += weight * other.right[i];
    energy += weight * other.energy;
    energy_of_views += weight * other.energy_of_views;
  }
};

// The same of a lean in two directions, P and Q: PD Px Pe, QD Qx Qe, PP PQ QQ, right sides P Q.
struct LeanTerms {
  std::array<double, 11> sums{};

  void add(const LeanTerms& other, double weight) noexcept {
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += weight * other.sums[i];
  }
};

// The normal equations once the lean that fits best is taken out. `certain`: the inverse variance
// of the lean, in units of that of an equation.
Normal without_lean(Normal normal, const LeanTerms& lean, double certain) noexcept {
  const auto& s = lean.sums;
  const double pp = s[6] + certain;
  const double qq = s[8] + certain;
  const double determinant = pp * qq - s[7] * s[7];
  if (!(determinant > 0.0)) return normal;
  const auto product = [&](double p1, double q1, double p2, double q2) {
    return (qq * p1 * p2 - s[7] * (p1 * q2 + q1 * p2) + pp * q1 * q2) / determinant;
  };
  std::size_t at = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      normal.matrix[at++] -= product(s[i], s[3 + i], s[j], s[3 + j]);
    }
    normal.right[i] -= product(s[i], s[3 + i], s[9], s[10]);
  }
  normal.energy -= product(s[9], s[10], s[9], s[10]);
  return normal;
}

struct Solution {
  double turn = 0.0;
  double xi = 0.0;
  double eta = 0.0;
  double explained = 0.0;
  // Of xi and eta, for unit variance of an equation.
  double variance = 0.0;
};

// Cholesky's rule; directions in which the views tell nothing stay 0.
Solution solve(const Normal& normal) noexcept {
  const auto& m = normal.matrix;
  // Below this share of its own size a pivot is rounding.
  constexpr double least = 1e-6;
  std::array<double, 3> d{};
  const double d0 = m[0];
  d[0] = d0 > 0.0 ? 1.0 / d0 : 0.0;
  const double l10 = m[1] * d[0];
  const double l20 = m[2] * d[0];
  const double d1 = m[3] - l10 * m[1];
  d[1] = d1 > least * m[3] && d1 > 0.0 ? 1.0 / d1 : 0.0;
  const double l21 = (m[4] - l20 * m[1]) * d[1];
  const double d2 = m[5] - l20 * m[2] - l21 * (m[4] - l20 * m[1]);
  d[2] = d2 > least * m[5] && d2 > 0.0 ? 1.0 / d2 : 0.0;
  const double y0 = normal.right[0];
  const double y1 = normal.right[1] - l10 * y0;
  const double y2 = normal.right[2] - l20 * y0 - l21 * y1;
  Solution s;
  s.eta = y2 * d[2];
  s.xi = y1 * d[1] - l21 * s.eta;
  s.turn = y0 * d[0] - l10 * s.xi - l20 * s.eta;
  s.explained = y0 * y0 * d[0] + y1 * y1 * d[1] + y2 * y2 * d[2];
  // The lower right block of the inverse.
  s.variance = d[1] + l21 * l21 * d[2] + d[2];
  return s;
}

// What one row becomes when the robot turns.
void turn_row(std::span<float> a, std::span<float> b, double turn_rad) {
  const double step_cosine = std::cos(turn_rad);
  const double step_sine = std::sin(turn_rad);
  double cosine = 1.0;
  double sine = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const auto c = static_cast<float>(cosine);
    const auto s = static_cast<float>(sine);
    const float turned = a[k] * c + b[k] * s;
    b[k] = b[k] * c - a[k] * s;
    a[k] = turned;
    const double next = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = next;
  }
}

using PerFrequency = std::array<double, TurnCorrelation::most_frequencies + 1>;

// The bell exp(-k^2 / (2 width^2)) that is nearest to the coherences in least squares, up to its
// height: noise lowers all coherences, distance the high ones first. One row gives little more than
// a sign for each frequency, so only one number is asked of all of them.
PerFrequency fitted_bell(const PerFrequency& coherences, int highest) {
  PerFrequency best{};
  double most = -std::numeric_limits<double>::infinity();
  for (double width = 1.5; width < 3.0 * highest; width *= 1.19) {
    PerFrequency bell{};
    const double step = std::exp(-0.5 / (width * width));
    double value = step;
    double ratio = step * step * step;  // step^(2 k + 1)
    double common = 0.0;
    double square = 0.0;
    for (int k = 1; k <= highest; ++k) {
      const auto i = static_cast<std::size_t>(k);
      bell[i] = value;
      common += value * coherences[i];
      square += value * value;
      value *= ratio;
      ratio *= step * step;
    }
    const double gain = common / std::sqrt(square);
    if (gain > most) {
      most = gain;
      best = bell;
    }
  }
  return best;
}

// Weights over amplitudes; their sum stays. `power`: the mean of the powers.
void over_amplitude(PerFrequency& weights, const PerFrequency& powers, double power, int highest) {
  if (!(power > 0.0)) return;
  constexpr double faint = 0.02;  // of the mean: fainter ones are mostly noise
  double before = 0.0;
  double after = 0.0;
  for (int k = 1; k <= highest; ++k) {
    const auto i = static_cast<std::size_t>(k);
    before += weights[i];
    weights[i] /= std::sqrt(powers[i] / power + faint);
    after += weights[i];
  }
  for (int k = 1; k <= highest; ++k) weights[static_cast<std::size_t>(k)] *= before / after;
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
  [[nodiscard]] Normal equations(int k);
  [[nodiscard]] LeanTerms lean_terms(int k);
  // Whether it is known how the image changes from row to row.
  [[nodiscard]] bool sees_rise() const noexcept {
    return (options_.vertical_motion || options_.lean) && home_.elevations() && rows_ >= 3;
  }
  void sum_equations();
  [[nodiscard]] Solution solve_at(double turn_rad);
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
  Coefficients c_;
  TurnCorrelation correlation_;
  double home_energy_ = 0.0;
  double current_energy_ = 0.0;
  PerFrequency component_weights_{};
  // By row: how fast things rise as the robot comes nearer, and the tangent of the elevation.
  std::vector<float> approach_, tangent_;
  std::vector<float> row_weights_;  // empty: all alike
  Normal normal_;
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
  const double step_cosine = std::cos(turn_rad);
  const double step_sine = std::sin(turn_rad);
  double cosine = 1.0;
  double sine = 0.0;
  for (int k = 0; k <= known_; ++k) {
    const auto c = static_cast<float>(cosine);
    const auto s = static_cast<float>(sine);
    const float* const a = home_.cosines(k).data();
    const float* const b = home_.sines(k).data();
    float* const turned_a = c_.home_a(k);
    float* const turned_b = c_.home_b(k);
    for (std::size_t y = 0; y < rows_; ++y) {
      turned_a[y] = a[y] * c - b[y] * s;
      turned_b[y] = a[y] * s + b[y] * c;
    }
    const double next = cosine * step_cosine - sine * step_sine;
    sine = sine * step_cosine + cosine * step_sine;
    cosine = next;
  }
}

// By coherence at the present turn: components by a bell as wide as there are coherent ones, over
// their amplitude, rows by their coherence within it. The power of views falls with about the
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
  component_weights_ = fitted_bell(coherences, highest_);
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

Normal PairOfViews::equations(int k) {
  const float* const row_weights = row_weights_.empty() ? nullptr : row_weights_.data();
  const float* const approach =
      options_.vertical_motion && sees_rise() ? approach_.data() : nullptr;
  const float* const ha = c_.home_a(k);
  const float* const hb = c_.home_b(k);
  const float* const ca = c_.current_a(k);
  const float* const cb = c_.current_b(k);
  const float* const la = c_.middle_a(k - 1);
  const float* const lb = c_.middle_b(k - 1);
  const float* const ua = c_.middle_a(k + 1);
  const float* const ub = c_.middle_b(k + 1);
  const float* const lra = c_.rise_a(k - 1);
  const float* const lrb = c_.rise_b(k - 1);
  const float* const ura = c_.rise_a(k + 1);
  const float* const urb = c_.rise_b(k + 1);
  const auto frequency = static_cast<float>(k);
  const float lower = 0.5F * (frequency - 1.0F);
  const float upper = 0.5F * (frequency + 1.0F);
  float m00 = 0, m01 = 0, m02 = 0, m11 = 0, m12 = 0, m22 = 0, v0 = 0, v1 = 0, v2 = 0, energy = 0,
        both = 0;
  for (std::size_t y = 0; y < rows_; ++y) {
    // a^h - a = k b^h Delta + a^x xi + a^y eta, b^h - b = -k a^h Delta + b^x xi + b^y eta.
    const float ta = frequency * hb[y];
    const float tb = -frequency * ha[y];
    float xa = upper * ua[y] - lower * la[y];
    float ya = upper * ub[y] + lower * lb[y];
    float xb = upper * ub[y] - lower * lb[y];
    float yb = -upper * ua[y] - lower * la[y];
    if (approach != nullptr) {
      const float half = 0.5F * approach[y];
      xa -= half * (lra[y] + ura[y]);
      xb -= half * (lrb[y] + urb[y]);
      ya -= half * (urb[y] - lrb[y]);
      yb -= half * (lra[y] - ura[y]);
    }
    const float ea = ha[y] - ca[y];
    const float eb = hb[y] - cb[y];
    const float weight = row_weights != nullptr ? row_weights[y] : 1.0F;
    m00 += weight * (ta * ta + tb * tb);
    m01 += weight * (ta * xa + tb * xb);
    m02 += weight * (ta * ya + tb * yb);
    m11 += weight * (xa * xa + xb * xb);
    m12 += weight * (xa * ya + xb * yb);
    m22 += weight * (ya * ya + yb * yb);
    v0 += weight * (ta * ea + tb * eb);
    v1 += weight * (xa * ea + xb * eb);
    v2 += weight * (ya * ea + yb * eb);
    energy += weight * (ea * ea + eb * eb);
    both += weight * (ha[y] * ha[y] + hb[y] * hb[y] + ca[y] * ca[y] + cb[y] * cb[y]);
  }
  return {{m00, m01, m02, m11, m12, m22}, {v0, v1, v2}, energy, both};
}

// A lean of the robot moves things up and down by P cos phi + Q sin phi, and those off the horizon
// to the side by tan(elevation) (P sin phi - Q cos phi).
LeanTerms PairOfViews::lean_terms(int k) {
  const float* const row_weights = row_weights_.empty() ? nullptr : row_weights_.data();
  const float* const ha = c_.home_a(k);
  const float* const hb = c_.home_b(k);
  const float* const ca = c_.current_a(k);
  const float* const cb = c_.current_b(k);
  const float* const la = c_.middle_a(k - 1);
  const float* const lb = c_.middle_b(k - 1);
  const float* const ua = c_.middle_a(k + 1);
  const float* const ub = c_.middle_b(k + 1);
  const float* const lra = c_.rise_a(k - 1);
  const float* const lrb = c_.rise_b(k - 1);
  const float* const ura = c_.rise_a(k + 1);
  const float* const urb = c_.rise_b(k + 1);
  const auto frequency = static_cast<float>(k);
  const float lower = 0.5F * (frequency - 1.0F);
  const float upper = 0.5F * (frequency + 1.0F);
  std::array<float, 11> sums{};
  for (std::size_t y = 0; y < rows_; ++y) {
    const float ta = frequency * hb[y];
    const float tb = -frequency * ha[y];
    const float xa = upper * ua[y] - lower * la[y];
    const float ya = upper * ub[y] + lower * lb[y];
    const float xb = upper * ub[y] - lower * lb[y];
    const float yb = -upper * ua[y] - lower * la[y];
    const float ra = 0.5F * (lra[y] + ura[y]);
    const float rb = 0.5F * (lrb[y] + urb[y]);
    const float sa = 0.5F * (urb[y] - lrb[y]);
    const float sb = 0.5F * (lra[y] - ura[y]);
    const float near = options_.vertical_motion ? approach_[y] : 0.0F;
    const float mxa = xa - near * ra;
    const float mxb = xb - near * rb;
    const float mya = ya - near * sa;
    const float myb = yb - near * sb;
    const float pa = tangent_[y] * xa - ra;
    const float pb = tangent_[y] * xb - rb;
    const float qa = tangent_[y] * ya - sa;
    const float qb = tangent_[y] * yb - sb;
    const float ea = ha[y] - ca[y];
    const float eb = hb[y] - cb[y];
    const float weight = row_weights != nullptr ? row_weights[y] : 1.0F;
    sums[0] += weight * (pa * ta + pb * tb);
    sums[1] += weight * (pa * mxa + pb * mxb);
    sums[2] += weight * (pa * mya + pb * myb);
    sums[3] += weight * (qa * ta + qb * tb);
    sums[4] += weight * (qa * mxa + qb * mxb);
    sums[5] += weight * (qa * mya + qb * myb);
    sums[6] += weight * (pa * pa + pb * pb);
    sums[7] += weight * (pa * qa + pb * qb);
    sums[8] += weight * (qa * qa + qb * qb);
    sums[9] += weight * (pa * ea + pb * eb);
    sums[10] += weight * (qa * ea + qb * eb);
  }
  LeanTerms terms;
  std::copy(sums.begin(), sums.end(), terms.sums.begin());
  return terms;
}

// At the present turn and with the present weights.
void PairOfViews::sum_equations() {
  take_slopes();
  normal_ = {};
  for (int k = 1; k <= highest_; ++k) {
    normal_.add(equations(k), component_weights_[static_cast<std::size_t>(k)]);
  }
  if (options_.lean && sees_rise()) {
    LeanTerms lean;
    double equations = 0.0;
    for (int k = 1; k <= highest_; ++k) {
      const double weight = component_weights_[static_cast<std::size_t>(k)];
      lean.add(lean_terms(k), weight);
      equations += 2.0 * weight * static_cast<double>(rows_);
    }
    // Robots lean by a degree or two: more must be shown by the views.
    constexpr double usual_rad = 0.035;
    const double certain = normal_.energy / std::max(1.0, equations) / (usual_rad * usual_rad);
    normal_ = without_lean(normal_, lean, certain);
  }
}

Solution PairOfViews::solve_at(double turn_rad) {
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
  constexpr std::size_t most_bands = 8;
  // The current view is known to more frequencies than are compared.
  const int frequencies = std::min(known_, 2 * searched_frequencies);
  const std::size_t bands = std::min(most_bands, rows_);
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
  std::array<float, most_displaced_frequencies + 1> a{};
  std::array<float, most_displaced_frequencies + 1> b{};
  std::array<float, most_displaced_frequencies + 1> to_a{};
  std::array<float, most_displaced_frequencies + 1> to_b{};
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
  const int most_frequencies = highest_;
  for (int iteration = 0;; ++iteration) {
    if (options_.rising) {
      highest_ = std::max(1, most_frequencies * (iteration + 1) / (last + 1));
    }
    correlate();
    const double most = std::sqrt(home_energy_) * std::sqrt(current_energy_);
    // Views are of the order of 1, so a transform in single precision leaves less than this of
    // nothing.
    constexpr double rounding = 1e-6;
    if (!(most > rounding * rounding * static_cast<double>(rows_))) return {};

    std::array<float, most_starts> turns{};
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
    Solution best;
    double best_residual = 2.0;
    double best_turn = 0.0;
    double variance = 0.0;
    for (int i = 0; i < starts; ++i) {
      const double turn = static_cast<double>(turns[static_cast<std::size_t>(i)]);
      // A heading at which the views do not even correlate half as well explains nothing better.
      const auto value = static_cast<double>(correlation_.at(static_cast<float>(turn)));
      if (i > 0 && value < 0.5 * static_cast<double>(correlation_.at(turns[0]))) break;
      const Solution solution = solve_at(turn);
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
  const int most = std::min(common - 2, TurnCorrelation::most_frequencies);
  return highest == 0 ? most : highest;
}

void check_pair(const HomingView& home, const HomingView& current, int highest) {
  require(home.rows() == current.rows(), "rows of the current view", current.rows(),
          to_text(home.rows()) + ", as of the home view");
  const int common = std::min(home.components(), current.components());
  require(common >= 3, "components of the views", common, ">= 3");
  const int most = std::min(common - 2, TurnCorrelation::most_frequencies);
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

void visit_options(FourierHomingOptions& options, OptionVisitor& visitor) {
  visitor.visit(
      {.name = "highest", .help = "highest frequency compared; 0 takes all", .low = 0, .high = 62},
      options.highest);
  visitor.visit(
      {.name = "iterations", .help = "times that the solution is refined", .low = 0, .high = 20},
      options.iterations);
  visitor.visit({.name = "rising", .help = "each iteration compares higher frequencies"},
                options.rising);
  constexpr std::array<std::string_view, 2> turns{"sequential", "global"};
  int turn = static_cast<int>(options.turn);
  visitor.visit({.name = "turn", .help = "how the heading is found first"}, turns, turn);
  options.turn = static_cast<TurnEstimate>(turn);
  constexpr std::array<std::string_view, 2> gradients{"current", "both"};
  int gradient = static_cast<int>(options.gradient);
  visitor.visit({.name = "gradient", .help = "views whose slopes count"}, gradients, gradient);
  options.gradient = static_cast<HomingGradient>(gradient);
  constexpr std::array<std::string_view, 2> weights{"equal", "coherence"};
  int weight = static_cast<int>(options.weights);
  visitor.visit({.name = "weights", .help = "how much components and rows count"}, weights, weight);
  options.weights = static_cast<HomingWeights>(weight);
  visitor.visit({.name = "starting_estimates",
                 .help = "headings tried",
                 .low = 1,
                 .high = static_cast<double>(most_starts)},
                options.starting_estimates);
  visitor.visit({.name = "displacement_search",
                 .help = "try displacements up to two thirds of R before solving"},
                options.displacement_search);
  visitor.visit({.name = "vertical_motion", .help = "rows off the horizon move up and down, too"},
                options.vertical_motion);
  visitor.visit({.name = "lean", .help = "the robot may lean a little, as on uneven ground"},
                options.lean);
}

FourierHomingOptions published_homing(int highest, int iterations) {
  return {.highest = highest,
          .iterations = iterations,
          .turn = TurnEstimate::sequential,
          .gradient = HomingGradient::current,
          .weights = HomingWeights::equal,
          .starting_estimates = 1,
          .displacement_search = false,
          .vertical_motion = false,
          .lean = false};
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
  options.lean = true;
  return PairOfViews(home, current, options, highest_used(home, current, highest)).difference();
}

}  // namespace panonav
