#include "panonav/localisation/monte_carlo.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/kernels/similarity.hpp"
#include "panonav/localisation/hierarchical.hpp"
#include "panonav/localisation/internal/particle_motion.hpp"
#include "panonav/localisation/internal/position_error.hpp"
#include "panonav/localisation/internal/resampling.hpp"
#include "panonav/localisation/internal/view_likelihood.hpp"

namespace panonav {

namespace {

constexpr int searched_views = 16;
constexpr int searched_when_localised = 4;
constexpr std::size_t followed_sites = 256;
constexpr double min_followed = 1e-3;  // share of the weight near a site
constexpr std::size_t followed_when_localised = 16;
constexpr int max_stages = 6;
constexpr double min_share = 0.05;
constexpr double nothing_left = 1e-37;      // the least exponential is 1e-38
constexpr double enough_effective = 200.0;  // stand for a mode in three dimensions
constexpr double max_against = 9.0;         // about 1 : 10 000
// Chances from one image to the next.
constexpr double kidnapped = 0.01;
constexpr double leaving = 0.02;
constexpr double coming_back = 0.1;
// Log-likelihood ratio that a view of another place reaches by chance; one in a hundred reaches it
// (docs/decisions.md).
constexpr double by_chance = 1.0;
constexpr double max_for = 5.0;
constexpr double max_for_similar = 2.0;
constexpr double localised_weight = 0.9;
constexpr double memorised_reach = 2.0;  // times the spacing or the range of similarity
constexpr double min_injected = 0.5;     // particles' worth of weight
constexpr double nothing_known = 0.9;  // chance of being elsewhere than where particles were strewn
// Deviations of new particles from the reference that tells them: within its square of the grid,
// and within the turns that explain a view.
constexpr double drawn_spacings = 0.4;
constexpr double drawn_heading_widths = 0.25;

}  // namespace

struct MonteCarloLocaliser::Implementation {
  std::shared_ptr<const ColumnRanking> ranking;
  ObservationModel model;
  MonteCarloOptions options;
  OdometryNoise odometry;
  ViewLikelihood likelihood;
  std::optional<ReferenceAreas> areas;
  Random random;
  Particles particles;
  std::vector<double> log_ratios;  // of the particles; scratch space of `weigh`, as the next two
  std::vector<float> log_ratios_below_most;
  std::vector<float> factors;
  double travelled_m = 0.0;  // since the last image
  PositionError error;
  bool knows_nothing = true;
  double inside = 0.5;  // belief that the robot is in the memorised area
  MonteCarloEstimate latest;

  Implementation(std::shared_ptr<const ColumnRanking> ranking_, const ObservationModel& model_,
                 const MonteCarloOptions& options_, const OdometryNoise& odometry_)
      : ranking(std::move(ranking_)),
        model(model_),
        options(options_),
        odometry(odometry_),
        likelihood(*ranking, model, options.compass),
        random(static_cast<std::uint64_t>(options.seed)) {
    validate(options);
    validate(odometry);
    require(options.min_particles <= options.max_particles, "min_particles", options.min_particles,
            "<= max_particles, " + to_text(options.max_particles));
    if (options.injection == ParticleInjection::topological) areas.emplace(ranking->memory());
  }

  [[nodiscard]] PoseBins bins() const { return {.cell_m = model.spacing_m, .headings = 24}; }

  Pose2 anywhere(std::optional<double> heading_rad) {
    return anywhere_around(random.index(likelihood.sites().size()), heading_rad);
  }
  Pose2 anywhere_around(std::size_t number, std::optional<double> heading_rad) {
    const auto& site = likelihood.sites()[number];
    const double half = 0.5 * model.spacing_m;
    const double x = site.position.x_m + random.uniform(-half, half);
    const double y = site.position.y_m + random.uniform(-half, half);
    const double turn = random.uniform(-std::numbers::pi, std::numbers::pi);
    return {x, y, heading_rad.value_or(turn)};
  }

  // The heading that a new particle has when no compass tells it: somebody else's.
  double borrowed_heading() { return particles.heading_rad[random.index(particles.size())]; }

  void compare_views(const PackedSignature& view, bool was_localised);
  // Whether a reference stands near enough to tell anything of the place.
  [[nodiscard]] bool is_memorised(Point2 place) const {
    if (!likelihood.sites_near(place).empty()) return true;
    const double reach_m = memorised_reach * std::max(model.spacing_m, model.range_m);
    return std::ranges::any_of(likelihood.sites(), [&](const ViewLikelihood::Site& site) {
      return distance(site.position, place) <= reach_m;
    });
  }

  // A site, and which of the two headings that fit there.
  struct Candidate {
    std::uint32_t site;
    bool other;
  };
  [[nodiscard]] bool tells_heading(std::uint32_t site) const {
    return options.compass && !std::isnan(likelihood.sites()[site].heading_rad);
  }
  // At a site, as far as the compass tells the heading, else with somebody's heading.
  Pose2 pose_told_by(Candidate candidate) {
    const auto& s = likelihood.sites()[candidate.site];
    const double told = static_cast<double>(candidate.other ? s.other_heading_rad : s.heading_rad);
    return {s.position.x_m, s.position.y_m,
            wrap_angle(tells_heading(candidate.site) ? told : borrowed_heading())};
  }
  // As far around it as the truth may be.
  Pose2 drawn_around(Candidate candidate) {
    Pose2 pose = pose_told_by(candidate);
    pose.x_m += random.normal(0.0, drawn_spacings * model.spacing_m);
    pose.y_m += random.normal(0.0, drawn_spacings * model.spacing_m);
    if (tells_heading(candidate.site)) {
      pose.heading_rad = wrap_angle(
          pose.heading_rad + random.normal(0.0, drawn_heading_widths * model.heading_width_rad));
    }
    return pose;
  }
  struct Weighed {
    double sum = 0.0;
    double squares = 0.0;
  };
  Weighed take_share(double share);
  Weighed take_bearable_share(double& share);
  double weigh(double whole);
  void resample(std::size_t count, bool spread);
  int inject_explained(double log_here);
  int inject_fixed(const PackedSignature& view);
  MonteCarloEstimate observe(const PackedSignature& view);
  void describe(MonteCarloEstimate& estimate, const ParticleModes& found) const;
};

// What is compared column by column: the views that the search finds, those around the best of
// them, and those around the particles.
void MonteCarloLocaliser::Implementation::compare_views(const PackedSignature& view,
                                                        bool was_localised) {
  likelihood.begin(view);
  const auto sites = likelihood.sites();
  const auto compare_found = [&](int count) {
    const SearchResult found =
        ranking->memory().search(view, {.top = count, .components = ranking->components()});
    for (const Match& match : found.matches) {
      if (const auto site = likelihood.site_of(match.view)) likelihood.compare(*site);
    }
  };
  compare_found(was_localised ? searched_when_localised : searched_views);

  const auto carried = likelihood.sites_near_most(
      particles, was_localised ? followed_when_localised : followed_sites, min_followed);
  for (const std::uint32_t site : carried) likelihood.compare(site);

  const auto best_of = [&](std::span<const std::uint32_t> of) {
    std::optional<std::uint32_t> best;
    for (const std::uint32_t site : of) {
      if (likelihood.compared(site) &&
          (!best || sites[site].similarity > sites[*best].similarity)) {
        best = site;
      }
    }
    return best;
  };
  const auto here = likelihood.min_difference(carried);
  const auto min_anywhere = likelihood.min_difference(likelihood.compared_sites());
  const bool held = was_localised && here && min_anywhere && *here <= *min_anywhere;
  if (knows_nothing || (!held && min_anywhere && *min_anywhere > model.neighbouring_difference)) {
    if (sites.size() <= static_cast<std::size_t>(options.reranked_views)) {
      for (std::uint32_t s = 0; s < sites.size(); ++s) likelihood.compare(s);
    } else if (options.reranked_views > searched_views) {
      compare_found(options.reranked_views);
    }
  }
  if (const auto best = best_of(likelihood.compared_sites())) {
    const Point2 place = sites[*best].position;
    for (const std::uint32_t site : likelihood.sites_near(place)) likelihood.compare(site);
  }
  latest.difference_here = likelihood.min_difference(carried);
  latest.difference_anywhere = likelihood.min_difference(likelihood.compared_sites());
  latest.views_compared = likelihood.compared_sites().size();
}

// The uniform and the topological injection: new particles in the place of random ones.
int MonteCarloLocaliser::Implementation::inject_fixed(const PackedSignature& view) {
  const std::size_t size = particles.size();
  std::size_t count = 0;
  std::vector<Match> candidates;
  if (options.injection == ParticleInjection::uniform) {
    count = std::min(size, static_cast<std::size_t>(options.injection_number));
  } else if (options.injection == ParticleInjection::topological) {
    constexpr double tolerance = 0.25;
    auto levels =
        localise_hierarchically(ranking->memory(), *areas, view,
                                {.components = ranking->components(), .tolerance = tolerance});
    if (!levels.empty()) candidates = std::move(levels.back().candidates);
    std::erase_if(candidates, [&](const Match& m) { return !likelihood.site_of(m.view); });
    if (candidates.empty()) return 0;
    count =
        static_cast<std::size_t>(std::lround(options.injection_share * static_cast<double>(size)));
  }
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t replaced = random.index(size);
    Pose2 pose;
    if (options.injection == ParticleInjection::uniform) {
      const double heading = borrowed_heading();
      pose = anywhere(options.compass ? std::nullopt : std::optional(heading));
    } else {
      const auto site = *likelihood.site_of(candidates[random.index(candidates.size())].view);
      likelihood.compare(site);
      pose = drawn_around({site, false});
    }
    particles.set(replaced, pose, 1.0 / static_cast<double>(size));
  }
  double sum = 0.0;
  for (const double weight : particles.weight) sum += weight;
  for (double& weight : particles.weight) weight /= sum;
  return static_cast<int>(count);
}

// Takes the exponentials of `share` of the log-likelihoods; what they leave of the particles.
MonteCarloLocaliser::Implementation::Weighed MonteCarloLocaliser::Implementation::take_share(
    double share) {
  factors.resize(log_ratios.size());
  kernels::exponentials(log_ratios_below_most, static_cast<float>(share), factors,
                        kernels::chosen_instructions());
  Weighed weighed;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const double weight = particles.weight[i] * static_cast<double>(factors[i]);
    weighed.sum += weight;
    weighed.squares += weight * weight;
  }
  return weighed;
}

// The share of the log-likelihood, at most `most`, after which enough particles still count; it is
// taken.
MonteCarloLocaliser::Implementation::Weighed
MonteCarloLocaliser::Implementation::take_bearable_share(double& share) {
  const double wanted = std::min(enough_effective, static_cast<double>(particles.size()) / 3.0);
  const auto bearable = [&](const Weighed& weighed) {
    return weighed.sum * weighed.sum >= wanted * weighed.squares;
  };
  const double most = share;
  const Weighed weighed = take_share(most);
  if (bearable(weighed)) return weighed;
  double low = 0.0;
  double high = most;
  for (int i = 0; i < 6; ++i) {
    const double middle = 0.5 * (low + high);
    (bearable(take_share(middle)) ? low : high) = middle;
  }
  share = std::max(low, most / 64.0);
  return take_share(share);
}

// Weighs the particles by the view, in stages when one would leave only few of them: after each
// stage they are resampled and spread by the kernel that their number and spread call for
// (progressive correction of a regularised particle filter; Musso, Oudjane and Le Gland 2001).
// The view counts by the exponent `whole`. Returns the logarithm of the mean likelihood.
double MonteCarloLocaliser::Implementation::weigh(double whole) {
  double evidence = 0.0;
  double evidence_in_full = 0.0;
  double left = whole;
  for (int stage = 0; stage < max_stages; ++stage) {
    log_ratios.resize(particles.size());
    likelihood.log_ratios(particles, log_ratios);
    const double most = *std::ranges::max_element(log_ratios);
    log_ratios_below_most.resize(log_ratios.size());
    std::ranges::transform(log_ratios, log_ratios_below_most.begin(),
                           [most](double ratio) { return static_cast<float>(ratio - most); });
    if (stage == 0) evidence_in_full = most + std::log(take_share(1.0).sum);
    double share = left;
    const double sum =
        (stage + 1 == max_stages ? take_share(share) : take_bearable_share(share)).sum;
    if (!(sum > nothing_left)) {  // what explains the view had lost all its weight
      std::ranges::fill(particles.weight, 1.0 / static_cast<double>(particles.size()));
      return evidence_in_full;
    }
    for (std::size_t i = 0; i < particles.size(); ++i) {
      particles.weight[i] *= static_cast<double>(factors[i]) / sum;
    }
    evidence += share * most + std::log(sum);
    left -= share;
    if (!(left > 1e-9)) break;
    resample(particles.size(), true);
    likelihood.arrange(particles);
  }
  // Few particles may all miss a narrow maximum that the stages find; a small share of the view
  // says little of the whole.
  return whole >= 0.2 ? std::max(evidence_in_full, evidence / whole) : evidence_in_full;
}

void MonteCarloLocaliser::Implementation::resample(std::size_t count, bool spread) {
  const auto survivors = low_variance_resample(particles.weight, count, random);
  ParticleModes found;
  std::vector<std::size_t> members;
  if (spread) {
    found = find_modes(particles, bins());
    members.resize(found.modes.size());
    for (const std::size_t s : survivors) {
      if (found.mode_of[s] >= 0) ++members[static_cast<std::size_t>(found.mode_of[s])];
    }
  }
  Particles next;
  next.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t s = survivors[i];
    Pose2 pose = particles.pose(s);
    if (spread && found.mode_of[s] >= 0) {
      // The kernel of least mean squared error for a normal distribution in three dimensions
      // (Silverman 1986, eq. 4.14 and table 4.1: exponent 1 / (d + 4), factor (4 / (d + 2))).
      const auto m = static_cast<std::size_t>(found.mode_of[s]);
      const PoseMode& mode = found.modes[m];
      const double width =
          std::pow(0.8 / static_cast<double>(std::max<std::size_t>(1, members[m])), 1.0 / 7.0);
      const auto [x, y] = random.normal_pair();
      pose.x_m += x * width * std::sqrt(mode.covariance[0]);
      pose.y_m += y * width * std::sqrt(mode.covariance[4]);
      pose.heading_rad =
          wrap_angle(pose.heading_rad + random.normal(0.0, width * std::sqrt(mode.covariance[8])));
    }
    next.set(i, pose, 1.0 / static_cast<double>(count));
  }
  particles = std::move(next);
}

// New particles where the view is explained, with the share of the weight that their evidence
// earns them.
int MonteCarloLocaliser::Implementation::inject_explained(double log_here) {
  std::vector<Candidate> places;
  Particles told;
  const auto add = [&](Candidate candidate) {
    places.push_back(candidate);
    told.add(pose_told_by(candidate), 0.0);
  };
  for (const std::uint32_t site : likelihood.compared_sites()) {
    add({site, false});
    if (tells_heading(site) && likelihood.sites()[site].other_similarity > 0.0F) add({site, true});
  }
  if (places.empty()) return 0;
  std::vector<double> values(told.size());
  likelihood.log_ratios(told, values);
  const double most = std::max(0.0, *std::ranges::max_element(values));
  // Anywhere else, and in any other heading, nothing explains the view.
  const double share = (options.compass ? model.heading_width_rad / std::numbers::pi : 1.0) /
                       static_cast<double>(likelihood.sites().size());
  double sum = 0.0;
  for (double& value : values) {
    value = std::exp(value - most);
    sum += value;
  }
  const double unexplained = std::max(0.0, 1.0 - share * static_cast<double>(values.size()));
  const double log_there = most + std::log(share * sum + unexplained * std::exp(-most));
  latest.log_there = log_there;
  // A robot that was outside may come back anywhere.
  const double hazard = knows_nothing ? nothing_known : kidnapped + (1.0 - inside) * coming_back;
  const double odds =
      hazard / (1.0 - hazard) * std::exp(std::clamp(log_there - log_here, -50.0, 50.0));
  const double mass = odds / (1.0 + odds);
  const auto size = static_cast<double>(particles.size());
  if (mass * size < min_injected) return 0;

  const auto count =
      static_cast<std::size_t>(std::max(1L, std::lround(std::max(0.05, 0.9 * mass) * size)));
  const std::vector<std::size_t> drawn = low_variance_resample(values, count, random);
  Particles fresh;
  for (const std::size_t d : drawn) fresh.add(drawn_around(places[d]), 0.0);
  std::vector<double> fresh_values(fresh.size());
  likelihood.log_ratios(fresh, fresh_values);
  double fresh_sum = 0.0;
  for (std::size_t n = 0; n < fresh.size(); ++n) {
    fresh.weight[n] = std::exp(std::max(fresh_values[n] - most, -max_against)) / values[drawn[n]];
    fresh_sum += fresh.weight[n];
  }
  // They take the places of the lightest particles.
  std::vector<std::size_t> order(particles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto lightest = order.begin() + static_cast<std::ptrdiff_t>(fresh.size());
  std::nth_element(order.begin(), lightest, order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(particles.weight[a], a) < std::pair(particles.weight[b], b);
  });
  for (std::size_t n = 0; n < fresh.size(); ++n) particles.set(order[n], fresh.pose(n), 0.0);
  double kept = 0.0;
  for (const double weight : particles.weight) kept += weight;
  for (double& weight : particles.weight) weight *= kept > 0.0 ? (1.0 - mass) / kept : 0.0;
  for (std::size_t n = 0; n < fresh.size(); ++n) {
    particles.weight[order[n]] = (kept > 0.0 ? mass : 1.0) * fresh.weight[n] / fresh_sum;
  }
  return static_cast<int>(fresh.size());
}

MonteCarloEstimate MonteCarloLocaliser::Implementation::observe(const PackedSignature& view) {
  const bool was_localised = latest.state == LocalisationState::localised;
  latest = {};
  likelihood.arrange(particles);
  compare_views(view, was_localised);
  if (options.injection == ParticleInjection::uniform ||
      options.injection == ParticleInjection::topological) {
    latest.injected = inject_fixed(view);
  }
  // Views from nearly the same place are alike, also in what misleads: they count for less, as far
  // as views at that distance resemble each other.
  const double correlation = std::exp(-travelled_m / model.range_m);
  const double share = knows_nothing ? 1.0 : std::max(min_share, 1.0 - correlation);
  const ParticleModes before = knows_nothing ? ParticleModes{} : find_modes(particles, bins());
  latest.log_here = weigh(share);
  double evidence = latest.log_here;
  if (options.injection == ParticleInjection::explained) {
    latest.injected = inject_explained(latest.log_here);
    evidence = std::max(evidence, latest.log_there + std::log(kidnapped));
  }
  // Where nothing is known yet, a view like one of the memory's speaks for being inside.
  if (latest.difference_anywhere) {
    const double margin = (model.explained_difference - *latest.difference_anywhere) /
                          std::max(0.05, model.far_difference - model.explained_difference);
    evidence = std::max(evidence, std::min(max_for_similar, 4.0 * margin) + by_chance);
  }
  knows_nothing = false;
  travelled_m = 0.0;
  inside = inside * (1.0 - leaving) + (1.0 - inside) * coming_back;
  const double ratio = std::exp(std::clamp(evidence - by_chance, -by_chance, max_for));
  inside = inside * ratio / (inside * ratio + 1.0 - inside);

  const ParticleModes found = find_modes(particles, bins());
  latest.particles = static_cast<int>(particles.size());
  latest.effective_particles = effective_sample_size(particles.weight);
  if (!found.modes.empty()) {
    const auto variance_m2 = [](const ParticleModes& of) {
      return of.modes.front().covariance[0] + of.modes.front().covariance[4];
    };
    if (before.modes.empty()) {
      error.begin(variance_m2(found));
    } else {
      error.observe(variance_m2(before), variance_m2(found), share, correlation,
                    latest.effective_particles);
    }
  }
  describe(latest, found);
  if (latest.effective_particles < options.resample_below * static_cast<double>(particles.size())) {
    latest.resampled = true;
    resample(std::clamp(kld_sample_size(found.occupied_bins, options.kld_error),
                        static_cast<std::size_t>(options.min_particles),
                        static_cast<std::size_t>(options.max_particles)),
             false);
  }
  return latest;
}

void MonteCarloLocaliser::Implementation::describe(MonteCarloEstimate& estimate,
                                                   const ParticleModes& found) const {
  estimate.modes = found.modes;
  for (PoseMode& mode : estimate.modes) {
    mode.covariance =
        error.stated(mode.covariance, mode.mean.heading_rad, odometry.translation_scale_error);
    mode.spread_m = std::sqrt(mode.covariance[0] + mode.covariance[4]);
  }
  estimate.spread_m = spread_of(particles);
  estimate.inside = inside;
  estimate.probability = found.modes.empty() ? 0.0 : inside * found.modes.front().weight;
  estimate.state = LocalisationState::lost;
  if (inside < 0.5) return;
  if (!found.modes.empty() && !is_memorised(found.modes.front().mean.position())) return;
  estimate.state = LocalisationState::ambiguous;
  if (found.modes.empty()) return;
  const PoseMode& first = found.modes.front();
  estimate.pose = first.mean;
  const double widest_m = std::max(model.spacing_m, model.range_m);
  if (first.weight >= localised_weight && first.spread_m <= widest_m) {
    estimate.state = LocalisationState::localised;
  }
}

MonteCarloLocaliser::MonteCarloLocaliser(const VisualMemory& memory,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry) {
  validate(options);
  auto ranking = std::make_shared<const ColumnRanking>(memory, 0);
  const ObservationModel model = learn_observation_model(*ranking, {.seed = options.seed});
  implementation_ = std::make_unique<Implementation>(ranking, model, options, odometry);
  start_anywhere();
}

MonteCarloLocaliser::MonteCarloLocaliser(std::shared_ptr<const ColumnRanking> ranking,
                                         const ObservationModel& model,
                                         const MonteCarloOptions& options,
                                         const OdometryNoise& odometry)
    : implementation_(
          std::make_unique<Implementation>(std::move(ranking), model, options, odometry)) {
  start_anywhere();
}

MonteCarloLocaliser::~MonteCarloLocaliser() = default;
MonteCarloLocaliser::MonteCarloLocaliser(MonteCarloLocaliser&&) noexcept = default;
MonteCarloLocaliser& MonteCarloLocaliser::operator=(MonteCarloLocaliser&&) noexcept = default;

void MonteCarloLocaliser::start_anywhere(std::optional<double> heading_rad) {
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
    own.particles.set(i, own.anywhere_around(site, heading_rad), 1.0 / static_cast<double>(count));
  }
  own.error = {};
  own.inside = 0.5;
  own.knows_nothing = true;
  own.latest = {};
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
  own.error = {};
  own.inside = 1.0 - leaving;
  own.knows_nothing = false;
  own.latest = {};
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
  implementation_->describe(estimate,
                            find_modes(implementation_->particles, implementation_->bins()));
  return estimate;
}

const Particles& MonteCarloLocaliser::particles() const noexcept {
  return implementation_->particles;
}

const ObservationModel& MonteCarloLocaliser::model() const noexcept {
  return implementation_->model;
}

}  // namespace panonav
