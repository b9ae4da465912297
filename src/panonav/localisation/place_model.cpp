#include "panonav/localisation/place_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/localisation/sample.hpp"

namespace panonav {

namespace {

// Tolerance of a loop of three compass readings, and how often chance stays within it.
constexpr double loop_tolerance_rad = radians(20.0);
constexpr double loop_chance = loop_tolerance_rad / std::numbers::pi;

double log_residual(double correlation) {
  // What is left below this is rounding to bytes.
  constexpr double least_residual = 1e-6;
  return -std::log(std::clamp(1.0 - correlation, least_residual, 1.0));
}

double magnitude_correlation(const PackedSignature& a, const PackedSignature& b) {
  std::uint64_t dot = 0;
  std::uint64_t norm_a = 0;
  std::uint64_t norm_b = 0;
  for (std::size_t i = 0; i < a.magnitudes.size(); ++i) {
    const std::uint32_t x = a.magnitudes[i];
    const std::uint32_t y = b.magnitudes[i];
    dot += x * y;
    norm_a += x * x;
    norm_b += y * y;
  }
  if (norm_a == 0 || norm_b == 0) return norm_a == norm_b ? 1.0 : 0.0;
  return std::min(1.0, static_cast<double>(dot) / (std::sqrt(static_cast<double>(norm_a)) *
                                                   std::sqrt(static_cast<double>(norm_b))));
}

struct PhaseTable {
  std::array<double, 256> cosine{};
  std::array<double, 256> sine{};
  PhaseTable() {
    for (std::size_t step = 0; step < cosine.size(); ++step) {
      cosine[step] = std::cos(std::numbers::pi * static_cast<double>(step) / 128.0);
      sine[step] = std::sin(std::numbers::pi * static_cast<double>(step) / 128.0);
    }
  }
};

double phase_correlation(const PackedSignature& query, const PackedSignature& reference,
                         std::span<const double> weights, double heading_rad) {
  static const PhaseTable table;
  const auto rows = static_cast<std::size_t>(query.shape.rows);
  double dot = 0.0;
  double query_energy = 0.0;
  double reference_energy = 0.0;
  for (int k = 1; k < query.shape.components; ++k) {
    double real = 0.0;
    double imaginary = 0.0;
    std::uint64_t query_sum = 0;
    std::uint64_t reference_sum = 0;
    for (std::size_t i = k * rows; i < (k + 1) * rows; ++i) {
      const std::uint32_t a = query.magnitudes[i];
      const std::uint32_t b = reference.magnitudes[i];
      const auto turn = static_cast<std::uint8_t>(query.phases[i] - reference.phases[i]);
      real += a * b * table.cosine[turn];
      imaginary += a * b * table.sine[turn];
      query_sum += a * a;
      reference_sum += b * b;
    }
    const double weight = weights.empty() ? 1.0 : weights[k];
    // cos(psi^q - psi^r - k sigma), summed.
    dot += weight * (real * std::cos(k * heading_rad) + imaginary * std::sin(k * heading_rad));
    query_energy += weight * static_cast<double>(query_sum);
    reference_energy += weight * static_cast<double>(reference_sum);
  }
  if (!(query_energy > 0.0 && reference_energy > 0.0)) return 0.0;
  return std::clamp(dot / (std::sqrt(query_energy) * std::sqrt(reference_energy)), 0.0, 1.0);
}

// 1 / (mean square of the packed magnitudes of a component, plus what rounding to whole numbers may
// add), so that components which are nothing but rounding do not count.
std::vector<double> equalising_weights(const VisualMemory& memory, std::span<const ViewId> views) {
  const SignatureShape shape = memory.shape();
  const auto rows = static_cast<std::size_t>(shape.rows);
  std::vector<double> squares(static_cast<std::size_t>(shape.components), 0.0);
  for (const ViewId view : views) {
    const PackedSignature signature = memory.packed(view);
    for (std::size_t i = 0; i < signature.magnitudes.size(); ++i) {
      squares[i / rows] += static_cast<double>(signature.magnitudes[i]) * signature.magnitudes[i];
    }
  }
  const double count = static_cast<double>(rows) * static_cast<double>(views.size());
  std::vector<double> weights(squares.size(), 0.0);
  for (std::size_t k = 1; k < weights.size(); ++k) weights[k] = 1.0 / (squares[k] / count + 0.25);
  return weights;
}

// Number of neighbours that a place of a grid has at the same distance; along a path it is that of
// two steps.
constexpr std::size_t ring = 4;
// Evidence beyond `impostor_high` that is enough in any case.
constexpr double ample_margin = 1.0;

struct Trial {
  double evidence = 0.0;
  double gain = 0.0;  // of the nearest ring of neighbours over the next one
  bool closed = false;
};

// The view searched among the others.
Trial leave_one_out(const VisualMemory& memory, ViewId view, const PlaceModel& model) {
  const PackedSignature query = memory.packed(view);
  const std::array excluded = {view};
  const SearchResult found = memory.search(query, {.top = model.candidates, .components = 0},
                                           {.excluded_views = excluded, .allowed_rows = {}});
  struct Candidate {
    PackedSignature signature;
    PlaceEvidence evidence;
  };
  std::vector<Candidate> candidates;
  for (const Match& match : found.matches) {
    PackedSignature signature = memory.packed(match.view);
    PlaceEvidence evidence = place_evidence(query, signature, model.component_weights);
    candidates.push_back({std::move(signature), evidence});
  }
  std::ranges::stable_sort(candidates, [](const Candidate& a, const Candidate& b) {
    return a.evidence.value > b.evidence.value;
  });
  Trial trial;
  trial.evidence = candidates.front().evidence.value;
  if (candidates.size() >= 2 * ring) {
    for (std::size_t i = 0; i < ring; ++i) {
      trial.gain += (candidates[i].evidence.value - candidates[i + ring].evidence.value) / ring;
    }
  }
  const auto& first = candidates[0];
  const auto& second = candidates[1];
  const auto between = compass(first.signature, second.signature);
  if (first.evidence.compass && second.evidence.compass && between) {
    const double error = wrap_angle(second.evidence.compass->heading_rad -
                                    first.evidence.compass->heading_rad - between->heading_rad);
    trial.closed = std::abs(error) < loop_tolerance_rad;
  }
  return trial;
}

// The x with a share `share` of a normal distribution below it, by bisection.
double normal_quantile(double share) {
  double low = -9.0;
  double high = 9.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < share ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

void visit_options(PlaceModelOptions& options, OptionVisitor& visitor) {
  visitor.visit({.name = "sampled_views", .help = "views used for learning", .low = 8, .high = 1e6},
                options.sampled_views);
  visitor.visit({.name = "candidates",
                 .help = "nearest views whose evidence is looked at",
                 .low = 2,
                 .high = 1000},
                options.candidates);
  visitor.visit({.name = "rejected_share",
                 .help = "share of own queries that may be taken for unknown",
                 .low = 0,
                 .high = 0.5},
                options.rejected_share);
  visitor.visit({.name = "accepted_share",
                 .help = "share of foreign queries that may be taken for known",
                 .low = 0,
                 .high = 0.5,
                 .low_open = true},
                options.accepted_share);
  visitor.visit({.name = "seed", .help = "seed of the draws", .low = 0}, options.seed);
}

PlaceEvidence place_evidence(const PackedSignature& query, const PackedSignature& reference,
                             std::span<const double> component_weights) {
  require(query.shape == reference.shape, "rows of the query", query.shape.rows,
          to_text(reference.shape.rows) + ", with the components of the reference");
  require(component_weights.empty() ||
              component_weights.size() == static_cast<std::size_t>(query.shape.components),
          "number of component weights", static_cast<double>(component_weights.size()),
          "0 or " + to_text(query.shape.components));
  PlaceEvidence evidence;
  evidence.magnitude_correlation = magnitude_correlation(query, reference);
  if (query.shape.components >= 2) evidence.compass = compass(query, reference);
  if (evidence.compass) {
    evidence.phase_correlation =
        phase_correlation(query, reference, component_weights, evidence.compass->heading_rad);
  }
  evidence.value =
      log_residual(evidence.magnitude_correlation) + log_residual(evidence.phase_correlation);
  return evidence;
}

PlaceModel learn_place_model(const VisualMemory& memory, const PlaceModelOptions& options) {
  validate(options);
  PlaceModel model;
  model.candidates = options.candidates;
  const auto seed = static_cast<std::uint64_t>(options.seed);
  const std::vector<ViewId> sample = sample_views(memory.views(), options.sampled_views, seed);
  model.sampled_views = static_cast<int>(sample.size());
  if (memory.empty()) return model;
  model.component_weights = equalising_weights(memory, sample);
  if (memory.size() < PlaceModel::least_views) return model;

  std::vector<double> evidence;
  std::vector<double> gains;
  int closed = 0;
  for (const ViewId view : sample) {
    const Trial trial = leave_one_out(memory, view, model);
    evidence.push_back(trial.evidence);
    gains.push_back(trial.gain);
    closed += trial.closed ? 1 : 0;
  }
  const double closed_rate = static_cast<double>(closed) / static_cast<double>(sample.size());
  model.closed_share = std::max(0.0, (closed_rate - loop_chance) / (1.0 - loop_chance));
  model.genuine_low =
      quantile(evidence, 1.0 - model.closed_share + options.rejected_share * model.closed_share);

  model.density_gain = quantile(gains, 0.5);
  std::vector<double> strangers;
  Random random(seed, 1);
  for (const ViewId view : sample) {
    const PackedSignature signature = memory.packed(view);
    for (int i = 0; i < options.candidates; ++i) {
      const ViewId other = memory.views()[random.index(memory.size())];
      if (other == view) continue;
      strangers.push_back(
          place_evidence(signature, memory.packed(other), model.component_weights).value);
    }
  }
  const double median = quantile(strangers, 0.5);
  // One standard deviation below the median of a normal distribution lie 15.87 %.
  const double deviation = median - quantile(strangers, 0.1587);
  model.impostor_high =
      median + normal_quantile(1.0 - options.accepted_share / options.candidates) * deviation;
  model.threshold = std::min({model.genuine_low + 0.5 * model.density_gain,
                              model.impostor_high + ample_margin, PlaceModel::highest_threshold});
  model.learnt = true;
  return model;
}

}  // namespace panonav
