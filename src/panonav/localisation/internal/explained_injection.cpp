#include "panonav/localisation/internal/explained_injection.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "panonav/localisation/internal/resampling.hpp"

namespace panonav {

namespace {

/// Smallest total weight of new particles, in units of one particle; below it none are drawn.
constexpr double min_injected_particles = 0.5;
/// Share of particles replaced per unit of the new particles' weight. Below 1, so that a tenth of
/// the old particles remains even if all weight is new.
constexpr double replaced_share_factor = 0.9;
/// Smallest share of particles replaced: 250 of 5000 cover the places that explain a view.
constexpr double min_replaced_share = 0.05;
/// Largest loss of log-likelihood of a drawn particle relative to the best candidate; larger losses
/// are clamped (1 : 8000), so that no weight vanishes.
constexpr double max_log_loss = 9.0;
/// Limit of the log odds that keeps exponentials finite; larger values are certain anyway.
constexpr double max_log_odds = 50.0;

double sum_values(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum;
}

/// Returns the indices of the `count` lightest particles, unordered.
std::vector<std::size_t> find_lightest(const Particles& particles, std::size_t count) {
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(count);
  std::nth_element(order.begin(), end, order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(particles.weight[a], a) < std::pair(particles.weight[b], b);
  });
  order.resize(count);
  return order;
}

}  // namespace

ExplainedInjection::ExplainedInjection(ViewLikelihood& likelihood, const PoseSampler& sampler,
                                       const ObservationModel& model, bool compass)
    : likelihood_(&likelihood),
      sampler_(&sampler),
      heading_share_(compass ? model.heading_width_rad / std::numbers::pi : 1.0) {}

bool ExplainedInjection::collect_candidates(const Particles& particles, Random& random) {
  Particles poses;
  const auto add = [&](PoseSampler::Candidate candidate) {
    candidates_.push_back(candidate);
    poses.add(sampler_->make_pose_at(candidate, particles, random), 0.0);
  };
  const auto sites = likelihood_->sites();
  for (const std::uint32_t site : likelihood_->compared_sites()) {
    add({site, false});
    if (sampler_->has_heading(site) && sites[site].other_similarity > 0.0F) add({site, true});
  }
  if (candidates_.empty()) return false;
  likelihoods_.resize(poses.size());
  likelihood_->compute_log_ratios(poses, likelihoods_);
  log_largest_ = std::max(0.0, *std::ranges::max_element(likelihoods_));
  for (double& value : likelihoods_) value = std::exp(value - log_largest_);
  // At all other positions and headings the likelihood is that of an unexplained view.
  const double share = heading_share_ / static_cast<double>(sites.size());
  const double unexplained = std::max(0.0, 1.0 - share * static_cast<double>(likelihoods_.size()));
  log_evidence_ = log_largest_ + std::log(share * sum_values(likelihoods_) +
                                          unexplained * std::exp(-log_largest_));
  return true;
}

Particles ExplainedInjection::sample_particles(const Particles& particles, std::size_t count,
                                               Random& random) const {
  const std::vector<std::size_t> drawn = resample_systematically(likelihoods_, count, random);
  Particles fresh;
  for (const std::size_t d : drawn) {
    fresh.add(sampler_->sample_around(candidates_[d], particles, random), 0.0);
  }
  std::vector<double> log_ratios(fresh.size());
  likelihood_->compute_log_ratios(fresh, log_ratios);
  for (std::size_t n = 0; n < fresh.size(); ++n) {
    fresh.weight[n] =
        std::exp(std::max(log_ratios[n] - log_largest_, -max_log_loss)) / likelihoods_[drawn[n]];
  }
  return fresh;
}

namespace {

/// Number of new particles that together get the weight `probability`; 0: fewer than half a one.
std::size_t count_injected(const Particles& particles, double probability) {
  const auto size = static_cast<double>(particles.size());
  if (probability * size < min_injected_particles) return 0;
  const double replaced = std::max(min_replaced_share, replaced_share_factor * probability) * size;
  return static_cast<std::size_t>(std::max(1L, std::lround(replaced)));
}

/// Replaces the lightest particles by these, which together get the weight `probability`.
void replace_lightest(Particles& particles, const Particles& fresh, double probability) {
  const std::vector<std::size_t> lightest = find_lightest(particles, fresh.size());
  for (std::size_t n = 0; n < fresh.size(); ++n) particles.set(lightest[n], fresh.pose(n), 0.0);
  const double kept = sum_values(particles.weight);
  for (double& weight : particles.weight) weight *= kept > 0.0 ? (1.0 - probability) / kept : 0.0;
  const double fresh_share = (kept > 0.0 ? probability : 1.0);
  const double fresh_sum = sum_values(fresh.weight);
  for (std::size_t n = 0; n < fresh.size(); ++n) {
    particles.weight[lightest[n]] = fresh_share * fresh.weight[n] / fresh_sum;
  }
}

}  // namespace

int ExplainedInjection::inject(Particles& particles, double probability, Random& random) const {
  const std::size_t count = count_injected(particles, probability);
  if (count == 0) return 0;
  replace_lightest(particles, sample_particles(particles, count, random), probability);
  return static_cast<int>(count);
}

void inject_around(Particles& particles, std::size_t count, std::span<const std::uint32_t> sites,
                   ViewLikelihood& likelihood, const PoseSampler& sampler, Random& random) {
  const std::size_t size = particles.size();
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t replaced = random.index(size);
    Pose2 pose;
    if (sites.empty()) {
      pose = sampler.sample_anywhere(particles, random);
    } else {
      const std::uint32_t site = sites[random.index(sites.size())];
      likelihood.compare(std::span(&site, 1));
      pose = sampler.sample_around({site, false}, particles, random);
    }
    particles.set(replaced, pose, 1.0 / static_cast<double>(size));
  }
  const double sum = sum_values(particles.weight);
  for (double& weight : particles.weight) weight /= sum;
}

int inject_samples(Particles& particles, double probability, const std::function<Pose2()>& sample) {
  const std::size_t count = std::min(count_injected(particles, probability), particles.size());
  Particles fresh;
  for (std::size_t n = 0; n < count; ++n) fresh.add(sample(), 1.0);
  if (count > 0) replace_lightest(particles, fresh, probability);
  return static_cast<int>(count);
}

double kidnap_probability(double prior, double log_ratio_elsewhere, double log_ratio_here) {
  const double log_odds =
      std::clamp(log_ratio_elsewhere - log_ratio_here, -max_log_odds, max_log_odds);
  const double odds = prior / (1.0 - prior) * std::exp(log_odds);
  return odds / (1.0 + odds);
}

}  // namespace panonav
