#include "panonav/localisation/monte_carlo.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/internal/explained_injection.hpp"
#include "panonav/localisation/internal/particle_motion.hpp"
#include "panonav/localisation/internal/particle_weighing.hpp"
#include "panonav/localisation/internal/pose_sampler.hpp"
#include "panonav/localisation/internal/position_error.hpp"
#include "panonav/localisation/internal/resampling.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

namespace {

// Sectors of the circle in which particles are gathered: 15 degrees each. Chosen.
constexpr int heading_bins = 24;

// Views that the search finds for each image, and references near the particles that are compared;
// fewer while the robot is localised. Chosen: all modes are followed, in a time that the search
// does not exceed.
constexpr int searched_views = 16;
constexpr int searched_views_when_localised = 4;
constexpr std::size_t followed_sites = 256;
constexpr std::size_t followed_sites_when_localised = 16;
// Least share of the particles' weight near a reference that is compared for them. Chosen.
constexpr double min_followed_weight = 1e-3;

// Probabilities from one image to the next: that the robot was carried anywhere (docs/decisions.md,
// particle injection), that it leaves the memorised area, and that it comes back. Chosen.
constexpr double p_kidnap = 0.01;
constexpr double p_leave = 0.02;
constexpr double p_return = 0.1;
// Probability of being elsewhere than where the particles were strewn while nothing is known.
// Chosen.
constexpr double p_elsewhere_at_start = 0.9;
// Belief in being inside the memorised area before the first image: none either way.
constexpr double p_inside_at_start = 0.5;

// Log-likelihood ratio that a view of another place reaches by chance; one in a hundred reaches it
// (docs/decisions.md, "Lost is a second belief"). One image never speaks against the area by more.
constexpr double log_ratio_by_chance = 1.0;
// The most by which one image speaks for it, by its likelihood or by its difference alone. Chosen.
constexpr double max_log_ratio = 5.0;
constexpr double max_log_ratio_of_difference = 2.0;
// Log-likelihood ratio for each part of the way from an explained to an unrelated difference; and
// the shortest such way, in differences. Chosen.
constexpr double log_ratio_per_margin = 4.0;
constexpr double min_margin_unit = 0.05;

// Least exponent by which a view counts, however near it was taken to the one before. Chosen.
constexpr double min_view_exponent = 0.05;

// The robot is localised with this much of the weight in one mode, and in the memorised area up to
// so many spacings or ranges of similarity from a reference (docs/decisions.md, "Localised means").
constexpr double min_localised_weight = 0.9;
constexpr double memorised_reach = 2.0;
constexpr double min_inside = 0.5;

double position_variance_m2(const ParticleModes& modes) {
  return modes.modes.front().covariance[0] + modes.modes.front().covariance[4];
}

}  // namespace

struct MonteCarloLocaliser::Implementation {
  std::shared_ptr<const ColumnRanking> ranking;
  ObservationModel model;
  MonteCarloOptions options;
  OdometryNoise odometry;
  ViewLikelihood likelihood;
  PoseSampler sampler;
  ParticleWeighing weighing;
  MonteCarloLocaliser::InjectionRule injection_rule;  // empty: none but the filter's own
  Random random;
  Particles particles;
  double travelled_m = 0.0;  // since the last image
  PositionError error;
  bool knows_nothing = true;          // no image was seen since the start
  double inside = p_inside_at_start;  // belief that the robot is in the memorised area
  MonteCarloEstimate latest;

  Implementation(std::shared_ptr<const ColumnRanking> ranking_, const ObservationModel& model_,
                 const MonteCarloOptions& options_, const OdometryNoise& odometry_)
      : ranking(std::move(ranking_)),
        model(model_),
        options(options_),
        odometry(odometry_),
        likelihood(*ranking, model, options.compass),
        sampler(likelihood, model, options.compass),
        random(static_cast<std::uint64_t>(options.seed)) {
    validate(options);
    validate(odometry);
    require(options.min_particles <= options.max_particles, "min_particles", options.min_particles,
            "<= max_particles, " + to_text(options.max_particles));
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  [[nodiscard]] PoseBins bins() const {
    return {.cell_m = model.spacing_m, .headings = heading_bins};
  }
  [[nodiscard]] ParticleModes modes() const { return find_modes(particles, bins()); }

  void restart(bool is_known);
  MonteCarloEstimate observe(const PackedSignature& view);
  void compare_views(const PackedSignature& view, bool was_localised);
  void compare_found(const PackedSignature& view, int count);
  void compare_around_best();
  void inject_by_rule(const PackedSignature& view);
  void inject_explained();
  void update_inside();
  void update_error(const ParticleModes& before, const ParticleModes& after, double exponent,
                    double correlation);
  void describe(MonteCarloEstimate& estimate, const ParticleModes& found) const;
  void resample_if_needed(std::size_t occupied_bins);
  [[nodiscard]] bool is_memorised(Point2 place) const;
};

void MonteCarloLocaliser::Implementation::restart(bool is_known) {
  error = {};
  inside = is_known ? 1.0 - p_leave : p_inside_at_start;
  knows_nothing = !is_known;
  latest = {};
}

MonteCarloEstimate MonteCarloLocaliser::Implementation::observe(const PackedSignature& view) {
  const bool was_localised = latest.state == LocalisationState::localised;
  latest = {};
  likelihood.arrange(particles);
  compare_views(view, was_localised);  // [M03 section 4]: similarities at the references
  inject_by_rule(view);                // [M03 section 4.1]
  // Views from nearly the same place are alike, also in what misleads: a view counts as far as it
  // is new.
  const double correlation = std::exp(-travelled_m / model.range_m);
  const double exponent = knows_nothing ? 1.0 : std::max(min_view_exponent, 1.0 - correlation);
  const ParticleModes before = knows_nothing ? ParticleModes{} : modes();
  latest.log_here = weighing.weigh(particles, likelihood, exponent, bins(), random);
  inject_explained();  // Bayes' rule for a robot that was kidnapped
  update_inside();
  knows_nothing = false;
  travelled_m = 0.0;
  const ParticleModes after = modes();
  latest.particles = static_cast<int>(particles.size());
  latest.effective_particles = effective_sample_size(particles.weight);
  update_error(before, after, exponent, correlation);
  describe(latest, after);
  resample_if_needed(after.occupied_bins);
  return latest;
}

// Compares column by column the views that the search finds, those around the best of them, and
// those around the particles.
void MonteCarloLocaliser::Implementation::compare_views(const PackedSignature& view,
                                                        bool was_localised) {
  likelihood.begin(view);
  compare_found(view, was_localised ? searched_views_when_localised : searched_views);
  const std::size_t max_followed = was_localised ? followed_sites_when_localised : followed_sites;
  const auto followed = likelihood.sites_near_most(particles, max_followed, min_followed_weight);
  for (const std::uint32_t site : followed) likelihood.compare(site);

  const auto here = likelihood.min_difference(followed);
  const auto anywhere = likelihood.min_difference(likelihood.compared_sites());
  const bool is_followed = was_localised && here && anywhere && *here <= *anywhere;
  const bool is_unexplained = !is_followed && anywhere && *anywhere > model.neighbouring_difference;
  if (knows_nothing || is_unexplained) {
    const auto sites = static_cast<std::uint32_t>(likelihood.sites().size());
    if (sites <= static_cast<std::size_t>(options.reranked_views)) {
      for (std::uint32_t site = 0; site < sites; ++site) likelihood.compare(site);
    } else if (options.reranked_views > searched_views) {
      compare_found(view, options.reranked_views);
    }
  }
  compare_around_best();
  latest.difference_here = likelihood.min_difference(followed);
  latest.difference_anywhere = likelihood.min_difference(likelihood.compared_sites());
  latest.views_compared = likelihood.compared_sites().size();
}

void MonteCarloLocaliser::Implementation::compare_found(const PackedSignature& view, int count) {
  const SearchResult found =
      ranking->memory().search(view, {.top = count, .components = ranking->components()});
  for (const Match& match : found.matches) {
    if (const auto site = likelihood.site_of(match.view)) likelihood.compare(*site);
  }
}

void MonteCarloLocaliser::Implementation::compare_around_best() {
  const auto sites = likelihood.sites();
  std::optional<std::uint32_t> best;
  for (const std::uint32_t site : likelihood.compared_sites()) {
    if (!best || sites[site].similarity > sites[*best].similarity) best = site;
  }
  if (!best) return;
  const Point2 place = sites[*best].position;
  for (const std::uint32_t site : likelihood.sites_near(place)) likelihood.compare(site);
}

// Puts new particles in the place of random ones, as a rule of the caller's says.
void MonteCarloLocaliser::Implementation::inject_by_rule(const PackedSignature& view) {
  if (!injection_rule) return;
  const std::size_t size = particles.size();
  const MonteCarloLocaliser::InjectedParticles wanted = injection_rule(view, size);
  std::vector<std::uint32_t> sites;
  for (const ViewId around : wanted.around) {
    if (const auto site = likelihood.site_of(around)) sites.push_back(*site);
  }
  if (wanted.count == 0 || (sites.empty() && !wanted.around.empty())) return;
  for (std::size_t n = 0; n < wanted.count; ++n) {
    const std::size_t replaced = random.index(size);
    Pose2 pose;
    if (sites.empty()) {
      pose = sampler.draw_anywhere(particles, random);
    } else {
      const std::uint32_t site = sites[random.index(sites.size())];
      likelihood.compare(site);
      pose = sampler.draw_around({site, false}, particles, random);
    }
    particles.set(replaced, pose, 1.0 / static_cast<double>(size));
  }
  double sum = 0.0;
  for (const double weight : particles.weight) sum += weight;
  for (double& weight : particles.weight) weight /= sum;
  latest.injected = static_cast<int>(wanted.count);
}

void MonteCarloLocaliser::Implementation::inject_explained() {
  if (options.injection != MonteCarloOptions::Injection::explained) return;
  ExplainedInjection injection(likelihood, sampler, model, options.compass);
  if (!injection.find_places(particles, random)) return;
  latest.log_there = injection.log_evidence();
  // A robot that was outside may come back anywhere.
  const double prior = knows_nothing ? p_elsewhere_at_start : p_kidnap + (1.0 - inside) * p_return;
  const double elsewhere = kidnap_probability(prior, latest.log_there, latest.log_here);
  latest.injected = injection.inject(particles, elsewhere, random);
}

// Updates the belief in being inside by how much better the view is explained than by chance.
void MonteCarloLocaliser::Implementation::update_inside() {
  double evidence = latest.log_here;
  if (options.injection == MonteCarloOptions::Injection::explained) {
    evidence = std::max(evidence, latest.log_there + std::log(p_kidnap));
  }
  // Where nothing is known yet, a view like one of the memory's speaks for being inside.
  if (latest.difference_anywhere) {
    const double unit =
        std::max(min_margin_unit, model.far_difference - model.explained_difference);
    const double margin = (model.explained_difference - *latest.difference_anywhere) / unit;
    evidence =
        std::max(evidence, std::min(max_log_ratio_of_difference, log_ratio_per_margin * margin) +
                               log_ratio_by_chance);
  }
  inside = inside * (1.0 - p_leave) + (1.0 - inside) * p_return;
  const double ratio =
      std::exp(std::clamp(evidence - log_ratio_by_chance, -log_ratio_by_chance, max_log_ratio));
  inside = inside * ratio / (inside * ratio + 1.0 - inside);
}

void MonteCarloLocaliser::Implementation::update_error(const ParticleModes& before,
                                                       const ParticleModes& after, double exponent,
                                                       double correlation) {
  if (after.modes.empty()) return;
  if (before.modes.empty()) {
    error.begin(position_variance_m2(after));
  } else {
    error.observe(position_variance_m2(before), position_variance_m2(after), exponent, correlation,
                  latest.effective_particles);
  }
}

void MonteCarloLocaliser::Implementation::describe(MonteCarloEstimate& estimate,
                                                   const ParticleModes& found) const {
  estimate.modes = found.modes;
  for (PoseMode& mode : estimate.modes) {
    mode.covariance =
        error.stated(mode.covariance, mode.mean.heading_rad, odometry.translation_scale_error);
    mode.spread_m = std::sqrt(mode.covariance[0] + mode.covariance[4]);
  }
  estimate.spread_m = position_spread_m(particles);
  estimate.inside = inside;
  estimate.probability = found.modes.empty() ? 0.0 : inside * found.modes.front().weight;
  estimate.state = LocalisationState::lost;
  if (inside < min_inside) return;
  if (!found.modes.empty() && !is_memorised(found.modes.front().mean.position())) return;
  estimate.state = LocalisationState::ambiguous;
  if (found.modes.empty()) return;
  const PoseMode& first = found.modes.front();
  estimate.pose = first.mean;
  const double widest_m = std::max(model.spacing_m, model.range_m);
  if (first.weight >= min_localised_weight && first.spread_m <= widest_m) {
    estimate.state = LocalisationState::localised;
  }
}

void MonteCarloLocaliser::Implementation::resample_if_needed(std::size_t occupied_bins) {
  const double min_effective = options.resample_below * static_cast<double>(particles.size());
  if (!(latest.effective_particles < min_effective)) return;
  latest.resampled = true;
  const std::size_t count = std::clamp(kld_sample_size(occupied_bins, options.kld_error),
                                       static_cast<std::size_t>(options.min_particles),
                                       static_cast<std::size_t>(options.max_particles));
  resample_particles(particles, count, random);
}

// Whether a reference stands near enough to tell anything of the place.
bool MonteCarloLocaliser::Implementation::is_memorised(Point2 place) const {
  if (!likelihood.sites_near(place).empty()) return true;
  const double reach_m = memorised_reach * std::max(model.spacing_m, model.range_m);
  return std::ranges::any_of(likelihood.sites(), [&](const ViewLikelihood::Site& site) {
    return distance(site.position, place) <= reach_m;
  });
}

MonteCarloLocaliser::MonteCarloLocaliser(const VisualMemory& memory,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry) {
  validate(options);
  auto ranking = std::make_shared<const ColumnRanking>(memory, 0);
  const ObservationModel model = learn_observation_model(*ranking, {.seed = options.seed});
  implementation_ = std::make_unique<Implementation>(ranking, model, options, odometry);
  start_globally();
}

MonteCarloLocaliser::MonteCarloLocaliser(std::shared_ptr<const ColumnRanking> ranking,
                                         const ObservationModel& model,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry)
    : implementation_(
          std::make_unique<Implementation>(std::move(ranking), model, options, odometry)) {
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
  // Spread evenly over the references: as many particles as references leave none without one.
  const std::size_t sites = own.likelihood.sites().size();
  const double first = own.random.uniform(0.0, 1.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double share = (static_cast<double>(i) + first) / static_cast<double>(count);
    const auto site =
        std::min(sites - 1, static_cast<std::size_t>(share * static_cast<double>(sites)));
    own.particles.set(i, own.sampler.draw_in_square(site, heading_rad, own.random),
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

void MonteCarloLocaliser::move(const Pose2& step) {
  require(is_finite(step), "step of the odometry", step.x_m, "numbers");
  auto& own = *implementation_;
  own.error.move(step);
  own.travelled_m += std::hypot(step.x_m, step.y_m);
  move_particles(own.particles, StepSampler(step, own.odometry), own.random);
}

MonteCarloEstimate MonteCarloLocaliser::observe(const PackedSignature& view) {
  return implementation_->observe(view);
}

MonteCarloEstimate MonteCarloLocaliser::estimate() const {
  MonteCarloEstimate estimate = implementation_->latest;
  implementation_->describe(estimate, implementation_->modes());
  return estimate;
}

const Particles& MonteCarloLocaliser::particles() const noexcept {
  return implementation_->particles;
}

const ObservationModel& MonteCarloLocaliser::model() const noexcept {
  return implementation_->model;
}

}  // namespace panonav
