#include "panonav/relative_pose/internal/pair_equations.hpp"

#include <algorithm>

namespace panonav {

namespace {

/// Derivatives of a component in one row by turn (t) and displacement forwards and to the left (x,
/// y); each for cosines (a) and sines (b).
struct RowSlopes {
  float ta, tb, xa, xb, ya, yb;
};
/// Derivatives by elevation in the same two directions (r, s).
struct RowRises {
  float ra, rb, sa, sb;
};

/// The rows of component k and of its neighbours.
class ComponentRows {
 public:
  ComponentRows(PairCoefficients& c, int k)
      : ha(c.home_a(k)),
        hb(c.home_b(k)),
        ca(c.current_a(k)),
        cb(c.current_b(k)),
        la_(c.middle_a(k - 1)),
        lb_(c.middle_b(k - 1)),
        ua_(c.middle_a(k + 1)),
        ub_(c.middle_b(k + 1)),
        lra_(c.rise_a(k - 1)),
        lrb_(c.rise_b(k - 1)),
        ura_(c.rise_a(k + 1)),
        urb_(c.rise_b(k + 1)),
        frequency_(static_cast<float>(k)) {}

  // a^h - a = k b^h Delta + a^x xi + a^y eta, b^h - b = -k a^h Delta + b^x xi + b^y eta.
  [[nodiscard]] RowSlopes slopes(std::size_t y) const noexcept {
    const float lower = 0.5F * (frequency_ - 1.0F);
    const float upper = 0.5F * (frequency_ + 1.0F);
    return {.ta = frequency_ * hb[y],
            .tb = -frequency_ * ha[y],
            .xa = upper * ua_[y] - lower * la_[y],
            .xb = upper * ub_[y] - lower * lb_[y],
            .ya = upper * ub_[y] + lower * lb_[y],
            .yb = -upper * ua_[y] - lower * la_[y]};
  }
  [[nodiscard]] RowRises rises(std::size_t y) const noexcept {
    return {.ra = 0.5F * (lra_[y] + ura_[y]),
            .rb = 0.5F * (lrb_[y] + urb_[y]),
            .sa = 0.5F * (urb_[y] - lrb_[y]),
            .sb = 0.5F * (lra_[y] - ura_[y])};
  }

  const float* ha;
  const float* hb;
  const float* ca;
  const float* cb;

 private:
  const float *la_, *lb_, *ua_, *ub_, *lra_, *lrb_, *ura_, *urb_;
  float frequency_;
};

// Adds the vertical motion of things off the horizon as the robot approaches.
RowSlopes add_approach(RowSlopes slopes, const RowRises& rises, float approach) noexcept {
  slopes.xa -= approach * rises.ra;
  slopes.xb -= approach * rises.rb;
  slopes.ya -= approach * rises.sa;
  slopes.yb -= approach * rises.sb;
  return slopes;
}

}  // namespace

void PairEquations::add(const PairEquations& other, double weight) noexcept {
  for (std::size_t i = 0; i < 6; ++i) matrix[i] += weight * other.matrix[i];
  for (std::size_t i = 0; i < 3; ++i) right[i] += weight * other.right[i];
  energy += weight * other.energy;
  energy_of_views += weight * other.energy_of_views;
}

void TiltEquations::add(const TiltEquations& other, double weight) noexcept {
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += weight * other.sums[i];
}

PairEquations sum_equations(PairCoefficients& coefficients, int k, std::size_t rows,
                            const RowTerms& terms) {
  const ComponentRows at(coefficients, k);
  float m00 = 0, m01 = 0, m02 = 0, m11 = 0, m12 = 0, m22 = 0, v0 = 0, v1 = 0, v2 = 0, energy = 0,
        both = 0;
  for (std::size_t y = 0; y < rows; ++y) {
    RowSlopes s = at.slopes(y);
    if (!terms.approach.empty()) s = add_approach(s, at.rises(y), terms.approach[y]);
    const float ea = at.ha[y] - at.ca[y];
    const float eb = at.hb[y] - at.cb[y];
    const float weight = terms.weights.empty() ? 1.0F : terms.weights[y];
    m00 += weight * (s.ta * s.ta + s.tb * s.tb);
    m01 += weight * (s.ta * s.xa + s.tb * s.xb);
    m02 += weight * (s.ta * s.ya + s.tb * s.yb);
    m11 += weight * (s.xa * s.xa + s.xb * s.xb);
    m12 += weight * (s.xa * s.ya + s.xb * s.yb);
    m22 += weight * (s.ya * s.ya + s.yb * s.yb);
    v0 += weight * (s.ta * ea + s.tb * eb);
    v1 += weight * (s.xa * ea + s.xb * eb);
    v2 += weight * (s.ya * ea + s.yb * eb);
    energy += weight * (ea * ea + eb * eb);
    both += weight *
            (at.ha[y] * at.ha[y] + at.hb[y] * at.hb[y] + at.ca[y] * at.ca[y] + at.cb[y] * at.cb[y]);
  }
  return {{m00, m01, m02, m11, m12, m22}, {v0, v1, v2}, energy, both};
}

TiltEquations sum_tilt_equations(PairCoefficients& coefficients, int k, std::size_t rows,
                                 const RowTerms& terms) {
  const ComponentRows at(coefficients, k);
  std::array<float, 11> sums{};
  for (std::size_t y = 0; y < rows; ++y) {
    const RowSlopes flat = at.slopes(y);
    const RowRises rises = at.rises(y);
    const RowSlopes s =
        terms.approach.empty() ? flat : add_approach(flat, rises, terms.approach[y]);
    const float pa = terms.tangent[y] * flat.xa - rises.ra;
    const float pb = terms.tangent[y] * flat.xb - rises.rb;
    const float qa = terms.tangent[y] * flat.ya - rises.sa;
    const float qb = terms.tangent[y] * flat.yb - rises.sb;
    const float ea = at.ha[y] - at.ca[y];
    const float eb = at.hb[y] - at.cb[y];
    const float weight = terms.weights.empty() ? 1.0F : terms.weights[y];
    sums[0] += weight * (pa * s.ta + pb * s.tb);
    sums[1] += weight * (pa * s.xa + pb * s.xb);
    sums[2] += weight * (pa * s.ya + pb * s.yb);
    sums[3] += weight * (qa * s.ta + qb * s.tb);
    sums[4] += weight * (qa * s.xa + qb * s.xb);
    sums[5] += weight * (qa * s.ya + qb * s.yb);
    sums[6] += weight * (pa * pa + pb * pb);
    sums[7] += weight * (pa * qa + pb * qb);
    sums[8] += weight * (qa * qa + qb * qb);
    sums[9] += weight * (pa * ea + pb * eb);
    sums[10] += weight * (qa * ea + qb * eb);
  }
  TiltEquations equations;
  std::copy(sums.begin(), sums.end(), equations.sums.begin());
  return equations;
}

PairEquations eliminate_tilt(PairEquations equations, const TiltEquations& tilt,
                             double certainty) noexcept {
  const auto& s = tilt.sums;
  const double pp = s[6] + certainty;
  const double qq = s[8] + certainty;
  const double determinant = pp * qq - s[7] * s[7];
  if (!(determinant > 0.0)) return equations;
  const auto product = [&](double p1, double q1, double p2, double q2) {
    return (qq * p1 * p2 - s[7] * (p1 * q2 + q1 * p2) + pp * q1 * q2) / determinant;
  };
  std::size_t at = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      equations.matrix[at++] -= product(s[i], s[3 + i], s[j], s[3 + j]);
    }
    equations.right[i] -= product(s[i], s[3 + i], s[9], s[10]);
  }
  equations.energy -= product(s[9], s[10], s[9], s[10]);
  return equations;
}

// Solves by Cholesky's decomposition [S06 eq. 30].
PairSolution solve(const PairEquations& equations) noexcept {
  const auto& m = equations.matrix;
  // Smallest pivot as a share of its diagonal entry; smaller ones are rounding errors.
  constexpr double min_pivot = 1e-6;
  std::array<double, 3> d{};
  const double d0 = m[0];
  d[0] = d0 > 0.0 ? 1.0 / d0 : 0.0;
  const double l10 = m[1] * d[0];
  const double l20 = m[2] * d[0];
  const double d1 = m[3] - l10 * m[1];
  d[1] = d1 > min_pivot * m[3] && d1 > 0.0 ? 1.0 / d1 : 0.0;
  const double l21 = (m[4] - l20 * m[1]) * d[1];
  const double d2 = m[5] - l20 * m[2] - l21 * (m[4] - l20 * m[1]);
  d[2] = d2 > min_pivot * m[5] && d2 > 0.0 ? 1.0 / d2 : 0.0;
  const double y0 = equations.right[0];
  const double y1 = equations.right[1] - l10 * y0;
  const double y2 = equations.right[2] - l20 * y0 - l21 * y1;
  PairSolution s;
  s.eta = y2 * d[2];
  s.xi = y1 * d[1] - l21 * s.eta;
  s.turn = y0 * d[0] - l10 * s.xi - l20 * s.eta;
  s.explained = y0 * y0 * d[0] + y1 * y1 * d[1] + y2 * y2 * d[2];
  // The inverse of the matrix, by the inverse of its lower factor.
  const double i10 = -l10;
  const double i20 = l10 * l21 - l20;
  const double i21 = -l21;
  s.covariance = {d[0] + i10 * i10 * d[1] + i20 * i20 * d[2],
                  i10 * d[1] + i20 * i21 * d[2],
                  i20 * d[2],
                  d[1] + i21 * i21 * d[2],
                  i21 * d[2],
                  d[2]};
  return s;
}

}  // namespace panonav
