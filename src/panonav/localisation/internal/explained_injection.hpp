#pragma once

#include <cstddef>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/pose_sampler.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

/// Particle injection by Bayes' rule (docs/decisions.md): a robot that may have been carried
/// anywhere in the memory is there with the probability that the view's likelihood there earns.
class ExplainedInjection {
 public:
  /// Judges the view that `likelihood` holds at the references that it was compared with.
  ExplainedInjection(ViewLikelihood& likelihood, const PoseSampler& sampler,
                     const ObservationModel& model, bool compass);

  /// Finds where the view is explained. False where it was compared with no reference.
  bool find_places(const Particles& particles, Random& random);
  /// Logarithm of the mean likelihood of the view over all places and headings of the memory, over
  /// that of a view that nothing explains. After `find_places`.
  [[nodiscard]] double log_evidence() const { return log_evidence_; }

  /// Gives new particles there the share `probability` of the weight, in the place of the lightest
  /// particles. Returns how many; 0 where the share is less than a part of one particle.
  int inject(Particles& particles, double probability, Random& random) const;

 private:
  /// Draws particles around the places, weighed by how much better than there they are explained.
  [[nodiscard]] Particles draw(const Particles& particles, std::size_t count, Random& random) const;

  ViewLikelihood* likelihood_;
  const PoseSampler* sampler_;
  double heading_share_;  ///< of the circle, in which a view is explained
  std::vector<PoseSampler::Candidate> places_;
  std::vector<double> likelihoods_;  ///< at the places, over the largest
  double log_largest_ = 0.0;
  double log_evidence_ = 0.0;
};

/// Probability that the robot was carried away, given that it is so with `prior` before the view,
/// and the logarithms of the view's likelihood elsewhere and here.
[[nodiscard]] double kidnap_probability(double prior, double log_elsewhere, double log_here);

}  // namespace panonav
