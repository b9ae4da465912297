#pragma once

#include <cstddef>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/pose_sampler.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

/// Particle injection by Bayes' rule (docs/decisions.md): a robot that may have been carried
/// anywhere in the memory is elsewhere with the probability that follows from the view's likelihood
/// there.
class ExplainedInjection {
 public:
  /// Evaluates the view of `likelihood` at the references with which it was compared.
  ExplainedInjection(ViewLikelihood& likelihood, const PoseSampler& sampler,
                     const ObservationModel& model, bool compass);

  /// Finds the places that explain the view. False where it was compared with no reference.
  bool find_places(const Particles& particles, Random& random);
  /// Logarithm of the mean likelihood of the view over all places and headings of the memory, over
  /// that of an unexplained view. After `find_places`.
  [[nodiscard]] double log_evidence() const { return log_evidence_; }

  /// Replaces the lightest particles by new ones at these places, with the share `probability` of
  /// the weight. Returns their number; 0 where the share is less than half a particle.
  int inject(Particles& particles, double probability, Random& random) const;

 private:
  /// Draws particles around the places, weighed by their likelihood over that of the place.
  [[nodiscard]] Particles sample_particles(const Particles& particles, std::size_t count,
                                           Random& random) const;

  ViewLikelihood* likelihood_;
  const PoseSampler* sampler_;
  double heading_share_;  // of the circle: headings that explain a view
  std::vector<PoseSampler::Candidate> places_;
  std::vector<double> likelihoods_;  // at the places, over the largest
  double log_largest_ = 0.0;
  double log_evidence_ = 0.0;
};

/// Probability that the robot was kidnapped, by its prior and the logarithms of the view's
/// likelihood elsewhere and here.
[[nodiscard]] double kidnap_probability(double prior, double log_elsewhere, double log_here);

}  // namespace panonav
