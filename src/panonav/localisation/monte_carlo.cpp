#include "panonav/localisation/monte_carlo.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/alternative_places.hpp"
#include "panonav/localisation/internal/explained_injection.hpp"
#include "panonav/localisation/internal/inside_belief.hpp"
#include "panonav/localisation/internal/particle_motion.hpp"
#include "panonav/localisation/internal/particle_weighing.hpp"
#include "panonav/localisation/internal/place_likelihood.hpp"
#include "panonav/localisation/internal/pose_sampler.hpp"
#include "panonav/localisation/internal/position_error.hpp"
#include "panonav/localisation/internal/resampling.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

namespace {

/// Number of heading sectors in which particles are clustered: 15 degrees each, between the
/// compass's error of about 5 degrees and the quarter rotation after which rooms look similar.
constexpr int heading_bins = 24;

// Limits of the work per image; lower while the robot is localised.
constexpr int searched_views = 16;                ///< views that the search finds
constexpr int searched_views_when_localised = 4;  ///< the same while localised
constexpr std::size_t max_followed_sites = 256;   ///< compared references near the particles
constexpr std::size_t max_followed_sites_when_localised = 16;
/// A reference is compared if the particles around it have at least this share of the weight:
/// five of 5000 particles.
constexpr double min_followed_weight = 1e-3;

// Probabilities from one image to the next (docs/decisions.md, particle injection).
constexpr double p_kidnap = 0.01;  ///< that the robot is carried elsewhere
/// Probability at the first image that the robot is not near any particle.
constexpr double p_elsewhere_at_start = 0.9;
/// Limit of the evidence of one image for being in the memorised area by its difference alone. Odds
/// are then 7, which a few images can refute (tests/localisation/monte_carlo_test.cpp).
constexpr double max_log_ratio_of_difference = 2.0;
/// Log-likelihood ratio of an explained difference against an unrelated one (the same tests).
constexpr double log_ratio_per_margin = 4.0;
/// Smallest unit of the margin; avoids a division by 0 if both differences are equal.
constexpr double min_margin_unit = 0.05;

/// Smallest exponent of a view's likelihood, even if it was taken where the previous view was, so
/// that a standing robot can be localised.
constexpr double min_view_exponent = 0.05;

// When the robot is localised (docs/decisions.md, "Localised means").
constexpr double min_localised_weight = 0.9;    ///< of the heaviest mode
constexpr double memorised_reach_factor = 2.0;  ///< largest distance from a reference, in spacings
constexpr double min_p_inside = 0.5;            ///< probability of being in the memorised area

double position_variance_m2(const ParticleModes& modes) {
  return modes.modes.front().covariance[0] + modes.modes.front().covariance[4];
}

}  // namespace

struct MonteCarloLocaliser::Implementation {
  ObservationModel model;
  MonteCarloOptions options;
  OdometryNoise odometry;
  ViewLikelihood likelihood;
  PoseSampler sampler;
  ParticleWeighing weighing;
  InjectionRule injection_rule;  // empty: only the filter's own injection
  Random random;
  Particles particles;
  double travelled_m = 0.0;  // since the last image
  PositionError error;
  bool is_uninformed = true;  // no image since a start without a known pose
  InsideBelief inside;
  // Probability by the last image that the robot is at the heaviest mode, not carried elsewhere.
  double p_explained_here = 1.0;
  std::size_t counted_sites = 0;  // number of references when `places` was counted
  std::size_t places = 1;         // in the memory
  MonteCarloEstimate latest;

  Implementation(std::unique_ptr<ComparedViews> views, const ObservationModel& model_,
                 const MonteCarloOptions& options_, const OdometryNoise& odometry_)
      : model(model_),
        options(options_),
        odometry(odometry_),
        likelihood(std::move(views), model, options.compass),
        sampler(likelihood, model, options.compass),
        random(static_cast<std::uint64_t>(options.seed)) {
    validate(options);
    validate(odometry);
    require(options.min_particles <= options.max_particles, "min_particles", options.min_particles,
            "<= max_particles, " + to_text(options.max_particles));
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  /// Returns bins whose modes reach as far as views are similar: what one image fits is one place.
  [[nodiscard]] PoseBins bins(int headings = heading_bins) const {
    return {std::max(model.spacing_m, model.range_m / (mode_reach + 0.5)), headings};
  }
  [[nodiscard]] ParticleModes modes() const { return find_modes(particles, bins()); }

  /// Number of memorised places of the size of a mode. Cost: linear in new references.
  [[nodiscard]] std::size_t count_places() {
    if (counted_sites == likelihood.sites().size()) return places;
    counted_sites = likelihood.sites().size();
    return places = likelihood.count_cells((2.0 * mode_reach + 1.0) * bins().cell_m);
  }

  void restart(bool is_known) {
    error = {};
    inside.restart(is_known);
    p_explained_here = 1.0;
    is_uninformed = !is_known;
    latest = {};
  }

  /// Monte-Carlo localisation by one image [M03 section 4].
  MonteCarloEstimate observe(const PackedSignature& view) {
    const bool was_localised = latest.state == LocalisationState::localised;
    latest = {};
    likelihood.reorder_by_cell(particles);
    compare_views(view, was_localised);  // [M03 section 4]: similarities at the references
    inject_by_rule(view);                // [M03 section 4.1]
    const auto inject = [&] {
      inject_explained();  // Bayes' rule for a kidnapped robot
      update_inside();     // Bayes' rule for the memorised area
    };
    weigh(likelihood, inject, [&](const ParticleModes& found) { update_explained_here(found); });
    likelihood.release();
    return latest;
  }

  /// Monte-Carlo localisation by the answer of a localiser to one image.
  MonteCarloEstimate observe(const Place& place) {
    PlaceLikelihood answer(place, likelihood.sites().size(), model.spacing_m, options.compass);
    latest = {};
    const auto inject = [&] {
      inside.update(std::log(place.known_probability / (1.0 - place.known_probability)));
      if (options.injection == MonteCarloOptions::Injection::none || !answer.is_informed()) return;
      // The mean likelihood over all places is 1, as the answer is a probability.
      const double elsewhere = kidnap_probability(prior_elsewhere(), 0.0, latest.log_ratio_here);
      latest.injected = inject_samples(particles, elsewhere, [&] { return answer.sample(random); });
    };
    weigh(answer, inject, [&](const ParticleModes& found) {
      if (found.modes.empty()) return;
      const double log_ratio = answer.log_ratio(found.modes.front().mean);
      p_explained_here =
          std::min(1.0, (1.0 - kidnap_probability(p_kidnap, 0.0, log_ratio)) / (1.0 - p_kidnap));
    });
    return latest;
  }

  /// Weighs the particles by an image and fills the latest estimate.
  template <class Inject, class UpdateExplained>
  void weigh(PoseLikelihood& by_image, const Inject& inject, const UpdateExplained& explain) {
    const double correlation = correlation_with_last_view();
    const double exponent = is_uninformed ? 1.0 : std::max(min_view_exponent, 1.0 - correlation);
    const ParticleModes before = is_uninformed ? ParticleModes{} : modes();
    latest.log_ratio_here = weighing.update_weights(particles, by_image, exponent, bins(), random);
    inject();
    is_uninformed = false;
    travelled_m = 0.0;
    const ParticleModes after = modes();
    latest.particles = static_cast<int>(particles.size());
    latest.effective_particles = effective_sample_size(particles.weight);
    update_error(before, after, exponent, correlation);
    explain(after);
    fill_estimate(latest, after);
    resample_if_needed(after.occupied_bins);  // [Fox 2003]
  }

  /// Views from nearly the same place have the same errors, so a view's weight falls with its
  /// correlation with the previous view.
  [[nodiscard]] double correlation_with_last_view() const {
    return std::exp(-travelled_m / model.range_m);
  }

  /// Compares column by column: the views found by the search, those near the particles and those
  /// near the best match.
  void compare_views(const PackedSignature& view, bool was_localised) {
    likelihood.set_view(view);
    likelihood.compare(
        likelihood.search(was_localised ? searched_views_when_localised : searched_views));
    const std::size_t max_followed =
        was_localised ? max_followed_sites_when_localised : max_followed_sites;
    const auto followed = likelihood.heaviest_sites(particles, max_followed, min_followed_weight);
    likelihood.compare(followed);

    const auto here = likelihood.min_difference(followed);
    const auto anywhere = likelihood.min_difference(likelihood.compared_sites());
    const bool is_followed = was_localised && here && anywhere && *here <= *anywhere;
    const bool is_unexplained =
        !is_followed && anywhere && *anywhere > model.neighbouring_difference;
    if (is_uninformed || is_unexplained) {
      if (likelihood.sites().size() <= static_cast<std::size_t>(options.reranked_views)) {
        std::vector<std::uint32_t> all(likelihood.sites().size());
        std::iota(all.begin(), all.end(), 0U);
        likelihood.compare(all);
      } else if (options.reranked_views > searched_views) {
        likelihood.compare(likelihood.search(options.reranked_views));
      }
    }
    compare_views_near_best();
    latest.difference_here = likelihood.min_difference(followed);
    latest.difference_anywhere = likelihood.min_difference(likelihood.compared_sites());
    latest.views_compared = likelihood.compared_sites().size();
  }

  void compare_views_near_best() {
    const auto sites = likelihood.sites();
    std::optional<std::uint32_t> best;
    for (const std::uint32_t site : likelihood.compared_sites()) {
      if (!best || sites[site].similarity > sites[*best].similarity) best = site;
    }
    if (!best) return;
    likelihood.compare(likelihood.sites_near(sites[*best].position));
  }

  /// Replaces random particles by new ones according to the caller's rule.
  void inject_by_rule(const PackedSignature& view) {
    if (!injection_rule) return;
    const InjectedParticles injected = injection_rule(view, particles.size());
    std::vector<std::uint32_t> sites;
    for (const ViewId around : injected.around) {
      if (const auto site = likelihood.site_of(around)) sites.push_back(*site);
    }
    if (injected.count == 0 || (sites.empty() && !injected.around.empty())) return;
    inject_around(particles, injected.count, sites, likelihood, sampler, random);
    latest.injected = static_cast<int>(injected.count);
  }

  /// Probability before an image that the robot is not where the particles are: one that was
  /// outside the memorised area may return anywhere.
  [[nodiscard]] double prior_elsewhere() const {
    return is_uninformed ? p_elsewhere_at_start
                         : p_kidnap + (1.0 - inside.probability()) * InsideBelief::p_return;
  }

  void inject_explained() {
    if (options.injection != MonteCarloOptions::Injection::explained) return;
    ExplainedInjection injection(likelihood, sampler, model, options.compass);
    if (!injection.collect_candidates(particles, random)) return;
    latest.log_ratio_anywhere = injection.log_evidence();
    const double elsewhere =
        kidnap_probability(prior_elsewhere(), latest.log_ratio_anywhere, latest.log_ratio_here);
    latest.injected = injection.inject(particles, elsewhere, random);
  }

  /// Updates the probability of being inside the memorised area, by Bayes' rule: evidence is how
  /// much better than chance the view is explained.
  void update_inside() {
    double evidence = latest.log_ratio_here;
    if (options.injection == MonteCarloOptions::Injection::explained) {
      evidence = std::max(evidence, latest.log_ratio_anywhere + std::log(p_kidnap));
    }
    // If the particles are still spread over all places, a view similar to one of the memory is
    // evidence for being inside.
    if (latest.difference_anywhere) {
      const double unit =
          std::max(min_margin_unit, model.far_difference - model.explained_difference);
      const double margin = (model.explained_difference - *latest.difference_anywhere) / unit;
      evidence =
          std::max(evidence, std::min(max_log_ratio_of_difference, log_ratio_per_margin * margin) +
                                 InsideBelief::chance_log_ratio);
    }
    inside.update(evidence - InsideBelief::chance_log_ratio);
  }

  /// A carried robot keeps its particles until views at the new place outweigh them. Meanwhile the
  /// image fits the heaviest mode worse than another place, which doubts the estimate: by the odds
  /// with which places share the probability of one image (`share_probability`). An image that fits
  /// no place, such as one with people in view, is no evidence.
  void update_explained_here(const ParticleModes& found) {
    p_explained_here = 1.0;
    if (found.modes.empty() || !latest.difference_anywhere) return;
    const double anywhere = std::max(*latest.difference_anywhere, min_shared_difference);
    if (anywhere > model.explained_difference) return;
    const auto sites = likelihood.sites_near(found.modes.front().mean.position());
    likelihood.compare(sites);
    const auto here = likelihood.min_difference(sites);
    if (!here || *here <= anywhere) return;
    // It may have been carried to any place; the image fits the best one of them also by chance.
    const double log_ratio =
        share_exponent * std::log(*here / anywhere) - std::log(static_cast<double>(count_places()));
    if (log_ratio <= 0.0) return;  // the weights of the particles account for the prior
    p_explained_here = (1.0 - kidnap_probability(p_kidnap, log_ratio, 0.0)) / (1.0 - p_kidnap);
  }

  void update_error(const ParticleModes& before, const ParticleModes& after, double exponent,
                    double correlation) {
    if (after.modes.empty()) return;
    if (before.modes.empty()) {
      error.begin(position_variance_m2(after));
    } else {
      error.observe(position_variance_m2(before), position_variance_m2(after), exponent,
                    correlation, latest.effective_particles);
    }
  }

  /// Returns the modes with the covariance of the position error.
  [[nodiscard]] std::vector<PoseMode> correct_modes(std::vector<PoseMode> modes) const {
    for (PoseMode& mode : modes) {
      mode.covariance = error.corrected_covariance(mode.covariance, mode.mean.heading_rad,
                                                   odometry.translation_scale_error);
      mode.spread_m = std::sqrt(mode.covariance[0] + mode.covariance[4]);
    }
    return modes;
  }

  /// True if the first mode has almost all the weight, also by the last image alone, and is no
  /// wider than the references' resolution.
  [[nodiscard]] bool is_certain(const std::vector<PoseMode>& modes) const {
    return !modes.empty() && modes.front().weight * p_explained_here >= min_localised_weight &&
           modes.front().spread_m <= std::max(model.spacing_m, model.range_m);
  }

  void fill_estimate(MonteCarloEstimate& estimate, const ParticleModes& found) const {
    estimate.modes = correct_modes(found.modes);
    estimate.spread_m = position_spread_m(particles);
    estimate.p_inside = inside.probability();
    const double p_here = estimate.p_inside * p_explained_here;
    estimate.probability = found.modes.empty() ? 0.0 : p_here * found.modes.front().weight;
    estimate.state = LocalisationState::lost;
    if (estimate.p_inside < min_p_inside) return;
    if (!found.modes.empty() && !is_in_memorised_area(found.modes.front().mean.position())) return;
    estimate.state = LocalisationState::ambiguous;
    if (found.modes.empty()) return;
    estimate.pose = found.modes.front().mean;
    estimate.position = estimate.pose->position();
    if (is_certain(estimate.modes)) {
      estimate.state = LocalisationState::localised;
      return;
    }
    std::vector<PoseMode> by_position = correct_modes(find_modes(particles, bins(1)).modes);
    if (!is_certain(by_position)) return;
    estimate.state = LocalisationState::position_known;
    estimate.modes = std::move(by_position);
    estimate.pose.reset();
    estimate.position = estimate.modes.front().mean.position();
    estimate.probability = p_here * estimate.modes.front().weight;
  }

  void resample_if_needed(std::size_t occupied_bins) {
    const double min_effective = options.resample_below * static_cast<double>(particles.size());
    if (!(latest.effective_particles < min_effective)) return;
    latest.resampled = true;
    const std::size_t count = std::clamp(kld_sample_size(occupied_bins, options.kld_error),
                                         static_cast<std::size_t>(options.min_particles),
                                         static_cast<std::size_t>(options.max_particles));
    resample_particles(particles, count, random);
  }

  /// True if a reference is near enough to be compared at this position.
  [[nodiscard]] bool is_in_memorised_area(Point2 position) const {
    return !likelihood.sites_near(position).empty() ||
           likelihood.has_site_within(
               position, memorised_reach_factor * std::max(model.spacing_m, model.range_m));
  }
};

MonteCarloLocaliser::MonteCarloLocaliser(const VisualMemory& memory,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry) {
  validate(options);
  auto ranking = std::make_shared<const ColumnRanking>(memory, 0);
  const ObservationModel model = learn_observation_model(*ranking, {.seed = options.seed});
  implementation_ =
      std::make_unique<Implementation>(make_compared_views(ranking), model, options, odometry);
  start_globally();
}

MonteCarloLocaliser::MonteCarloLocaliser(std::shared_ptr<const ColumnRanking> ranking,
                                         const ObservationModel& model,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry)
    : implementation_(std::make_unique<Implementation>(make_compared_views(std::move(ranking)),
                                                       model, options, odometry)) {
  start_globally();
}

MonteCarloLocaliser::MonteCarloLocaliser(std::function<std::unique_ptr<ViewIndex>()> open_index,
                                         SignatureShape shape, const ObservationModel& model,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry)
    : implementation_(std::make_unique<Implementation>(
          make_compared_views(std::move(open_index), shape), model, options, odometry)) {
  implementation_->likelihood.release();
  start_globally();
}

MonteCarloLocaliser::~MonteCarloLocaliser() = default;
MonteCarloLocaliser::MonteCarloLocaliser(MonteCarloLocaliser&&) noexcept = default;
MonteCarloLocaliser& MonteCarloLocaliser::operator=(MonteCarloLocaliser&&) noexcept = default;

void MonteCarloLocaliser::set_injection_rule(MonteCarloLocaliser::InjectionRule rule) {
  implementation_->injection_rule = std::move(rule);
}

void MonteCarloLocaliser::start_globally(std::optional<double> heading_rad) {
  auto& own = *implementation_;
  const auto count = static_cast<std::size_t>(own.options.max_particles);
  own.particles.resize(count);
  // Spreads the particles evenly over the references: if there are as many particles as references,
  // each reference gets one.
  const std::size_t sites = own.likelihood.sites().size();
  const double first = own.random.uniform(0.0, 1.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double share = (static_cast<double>(i) + first) / static_cast<double>(count);
    const auto site =
        std::min(sites - 1, static_cast<std::size_t>(share * static_cast<double>(sites)));
    own.particles.set(i, own.sampler.sample_in_square(site, heading_rad, own.random),
                      1.0 / static_cast<double>(count));
  }
  own.restart(false);
}

void MonteCarloLocaliser::start_at(const Pose2& pose, double deviation_m,
                                   double heading_deviation_rad) {
  auto& own = *implementation_;
  const auto count = static_cast<std::size_t>(own.options.max_particles);
  own.particles.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = own.random.normal(pose.x_m, deviation_m);
    const double y = own.random.normal(pose.y_m, deviation_m);
    const double heading = own.random.normal(pose.heading_rad, heading_deviation_rad);
    own.particles.set(i, {x, y, wrap_angle(heading)}, 1.0 / static_cast<double>(count));
  }
  own.restart(true);
}

void MonteCarloLocaliser::set_odometry_noise(const OdometryNoise& noise) {
  validate(noise);
  implementation_->odometry = noise;
}

void MonteCarloLocaliser::move(const Pose2& step) {
  require(is_finite(step), "step of the odometry", step.x_m, "numbers");
  auto& own = *implementation_;
  own.error.move(step);
  own.travelled_m += std::hypot(step.x_m, step.y_m);
  move_particles(own.particles, StepSampler(step, own.odometry), own.random);
}

void MonteCarloLocaliser::spread(double deviation_m, double heading_deviation_rad) {
  auto& own = *implementation_;
  spread_particles(own.particles, deviation_m, heading_deviation_rad, own.random);
  own.travelled_m += deviation_m;
}

void MonteCarloLocaliser::update_views() {
  implementation_->likelihood.update_sites();
  implementation_->likelihood.release();
}

ViewId MonteCarloLocaliser::find_nearest_view(Point2 position) const {
  const auto sites = implementation_->likelihood.sites();
  return std::ranges::min_element(
             sites, {},
             [&](const ViewLikelihood::Site& site) { return distance(site.position, position); })
      ->view;
}

MonteCarloEstimate MonteCarloLocaliser::observe(const PackedSignature& view) {
  Implementation& own = *implementation_;
  const MonteCarloEstimate before = own.latest;
  try {
    return own.observe(view);
  } catch (const FileError&) {
    own.likelihood.release();
    own.latest = before;
    throw;
  }
}

MonteCarloEstimate MonteCarloLocaliser::observe(const Place& place) {
  return implementation_->observe(place);
}

MonteCarloEstimate MonteCarloLocaliser::estimate() const {
  MonteCarloEstimate estimate = implementation_->latest;
  implementation_->fill_estimate(estimate, implementation_->modes());
  return estimate;
}

const Particles& MonteCarloLocaliser::particles() const noexcept {
  return implementation_->particles;
}

const ObservationModel& MonteCarloLocaliser::model() const noexcept {
  return implementation_->model;
}

}  // namespace panonav
