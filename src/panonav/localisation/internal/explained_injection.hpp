#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/localisation/internal/pose_sampler.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

/// Particle injection by Bayes' rule (docs/decisions.md): the probability that the robot was
/// carried elsewhere follows from the view's likelihood at all places of the memory.
class ExplainedInjection {
 public:
  /// Evaluates the view set in `likelihood`, at the references to which it was compared.
  ExplainedInjection(ViewLikelihood& likelihood, const PoseSampler& sampler,
                     const ObservationModel& model, bool compass);

  /// Collects the poses at the compared references and their likelihoods. Returns false if no
  /// reference was compared.
  bool collect_candidates(const Particles& particles, Random& random);
  /// Logarithm of the view's mean likelihood over all places and headings of the memory, relative
  /// to an unexplained view. Valid after `collect_candidates`.
  [[nodiscard]] double log_evidence() const { return log_evidence_; }

  /// Replaces the lightest particles by new ones at the candidates, which together get the weight
  /// `probability`. Returns the number of new particles; 0 if `probability` corresponds to less
  /// than half a particle.
  int inject(Particles& particles, double probability, Random& random) const;

 private:
  /// Draws `count` particles around the candidates. Their weights are their likelihood relative to
  /// that of the candidate.
  [[nodiscard]] Particles sample_particles(const Particles& particles, std::size_t count,
                                           Random& random) const;

  ViewLikelihood* likelihood_;
  const PoseSampler* sampler_;
  double heading_share_;  // share of the circle that explains a view at a reference
  std::vector<PoseSampler::Candidate> candidates_;
  std::vector<double> likelihoods_;  // at the candidates, relative to the largest
  double log_largest_ = 0.0;
  double log_evidence_ = 0.0;
};

/// Replaces `count` random particles by new ones around these sites, anywhere if there are none,
/// and normalises the weights.
void inject_around(Particles& particles, std::size_t count, std::span<const std::uint32_t> sites,
                   ViewLikelihood& likelihood, const PoseSampler& sampler, Random& random);

/// Replaces the lightest particles by poses that `sample` draws, which together get the weight
/// `probability`, in equal shares. Returns their number; 0 if `probability` corresponds to less
/// than half a particle.
int inject_samples(Particles& particles, double probability, const std::function<Pose2()>& sample);

/// Returns the probability that the robot was kidnapped, from its prior and the logarithms of the
/// view's likelihood elsewhere and here.
[[nodiscard]] double kidnap_probability(double prior, double log_ratio_elsewhere,
                                        double log_ratio_here);

}  // namespace panonav
