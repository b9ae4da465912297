// Learns the coefficients of `place_probability` on built-in scenes and prints them: 32 places,
// each remembered with all and with few references, of all and of few
// components, queried with its own places, as memorised and with other light and a tenth hidden,
// for places of other variants of its scene and for places of other scenes. Logistic regression;
// own places, variants and other scenes count a third each. First the coefficients of the columns,
// then those of the local features, from the queries at which the columns leave doubt by the
// coefficients that are in use: where the former have changed, run again with them. About eight
// minutes.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "lab/runs/place_experiment.hpp"
#include "lab/runs/tracking_run.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav_simulation/make_each.hpp"

namespace {

using namespace panonav;

struct Kind {
  const char* scene;
  std::array<double, 4> spacings_m;  // one for each variant
};
constexpr std::array kinds{
    Kind{"office", {0.25, 0.25, 0.5, 0.35}},     Kind{"hall", {0.5, 0.7, 1.0, 0.5}},
    Kind{"hall_periodic", {0.5, 0.7, 1.0, 0.5}}, Kind{"arena", {0.1, 0.15, 0.1, 0.2}},
    Kind{"lab", {0.4, 0.5, 0.7, 0.5}},           Kind{"loop", {0.5, 0.4, 0.5, 0.7}},
    Kind{"corridor", {0.5, 0.5, 0.7, 0.5}},      Kind{"garden", {0.5, 0.7, 1.0, 0.7}}};
constexpr int full_components = 15;
struct Remembering {
  std::uint64_t one_of;  // references kept
  int components;
};
constexpr std::array<Remembering, 5> rememberings{
    {{1, full_components}, {4, full_components}, {1, 6}, {4, 6}, {1, 2}}};
// Components of a memory from which the logistic regression learns, at least. With fewer, it
// learns what built-in scenes differ in and others do not; the last coefficient is then chosen so
// that of the places of other scenes at most this share is known.
constexpr int min_learnt_components = 6;
constexpr double max_others_known = 0.005;
constexpr int queries = 40;
constexpr std::size_t asked_of_others = 6;
// Queries of variants from which the feature model learns: hardly a sixth of them are inconclusive,
// and most of these are of one kind.
constexpr std::size_t asked_of_variants = 20;

enum class Whose { own, variant, other };
struct BuiltPlace {
  std::size_t kind;
  simulation::PlaceRecording recording;
  std::vector<simulation::PlacedView> disturbed;
};
struct Sample {
  PlaceEvidence evidence;
  Whose whose;
  std::size_t kind;  // of the memory
  bool disturbed;
  bool for_features;  // asked for what is learnt of features alone
};
template <int size>
using Vector = Eigen::Matrix<double, size, 1>;
constexpr int column_features = column_term_count - 1;  // without that of the components

std::optional<Vector<column_features>> column_features_of(const PlaceEvidence& evidence) {
  return Eigen::Map<const Vector<column_features>>(column_terms(evidence).data());
}
// None where columns leave no doubt.
std::optional<Vector<feature_term_count>> doubtful_features_of_query(
    const PlaceEvidence& evidence) {
  if (!evidence.features) return std::nullopt;
  return Eigen::Map<const Vector<feature_term_count>>(feature_terms(evidence).data());
}
double logistic(double z) {
  return 1.0 / (1.0 + std::exp(-z));
}

PackedSignature truncated(PackedSignature view, SignatureShape shape) {
  view.shape = shape;
  view.magnitudes.resize(shape.size());
  view.phases.resize(shape.size());
  return view;
}

std::vector<Sample> ask(const std::vector<BuiltPlace>& places, const BuiltPlace& place,
                        const Remembering& how, Executor& executor) {
  Random random(place.recording.seed, how.one_of);
  std::vector<Point2> kept;
  const VisualMemory all =
      lab::make_memory_of_references(place.recording, executor, [&](Point2 position) {
        if (random.index(how.one_of) != 0) return false;
        kept.push_back(position);
        return true;
      });
  const SignatureShape shape{all.shape().rows, how.components};
  VisualMemory memory(shape, all.full_scale(), all.elevations());
  for (const ViewId view : all.views()) {
    memory.append(truncated(all.packed(view), shape), all.info(view));
  }
  Localiser localiser(memory);
  localiser.use_features(lab::extract_reference_features(place.recording, memory, executor), false);
  struct Query {
    const Panorama* view;
    Whose whose;
    bool disturbed;
    bool for_features = false;
  };
  std::vector<Query> place_queries;
  for (const BuiltPlace& other : places) {
    for (const bool disturbed : {false, true}) {
      const auto* const views = disturbed ? &other.disturbed : &other.recording.queries;
      for (std::size_t i = 0; i < views->size(); ++i) {
        const simulation::PlacedView& view = (*views)[i];
        if (&other == &place) {
          const bool is_near = std::ranges::any_of(kept, [&](Point2 position) {
            return distance(position, view.pose.position()) <= place.recording.spacing_m;
          });
          if (is_near) place_queries.push_back({&view.panorama, Whose::own, disturbed});
        } else if (i < (other.kind == place.kind ? asked_of_variants : asked_of_others)) {
          place_queries.push_back({&view.panorama,
                                   other.kind == place.kind ? Whose::variant : Whose::other,
                                   disturbed, i >= asked_of_others});
        }
      }
    }
  }
  return simulation::make_each(executor, place_queries.size(), [&](std::size_t i) {
    const PackedSignature query =
        truncated(lab::compute_packed_signature(*place_queries[i].view, all), shape);
    return Sample{
        localiser.localise(query, {}, lab::make_query_features(*place_queries[i].view)).evidence,
        place_queries[i].whose, place.kind, place_queries[i].disturbed,
        place_queries[i].for_features};
  });
}

std::array<double, 3> counts_of(const std::vector<Sample>& samples) {
  std::array<double, 3> counts{};
  for (const Sample& sample : samples) counts[static_cast<std::size_t>(sample.whose)] += 1.0;
  return counts;
}

// Training sample of one query, with its weight.
template <int size>
struct Lesson {
  Vector<size> x;
  bool own;
  double share;
  std::size_t kind;
};

// Returns the training samples of the samples with numbers; shares are those of all.
template <int size>
std::vector<Lesson<size>> lessons_of(
    const std::vector<Sample>& samples,
    std::optional<Vector<size>> (*numbers_of)(const PlaceEvidence&)) {
  const std::array<double, 3> counts = counts_of(samples);
  std::vector<Lesson<size>> lessons;
  for (const Sample& sample : samples) {
    const auto x = numbers_of(sample.evidence);
    if (!x) continue;
    const double all = static_cast<double>(samples.size()) / 3.0;
    lessons.push_back({*x, sample.whose == Whose::own,
                       all / counts[static_cast<std::size_t>(sample.whose)], sample.kind});
  }
  return lessons;
}

template <int size>
Vector<size> learn(const std::vector<Lesson<size>>& lessons) {
  Vector<size> weights = Vector<size>::Zero();
  for (int step = 0; step < 50; ++step) {
    Vector<size> slope = -1e-3 * weights;
    Eigen::Matrix<double, size, size> curvature = 1e-3 * decltype(curvature)::Identity();
    for (const Lesson<size>& lesson : lessons) {
      const double probability = logistic(weights.dot(lesson.x));
      slope += lesson.share * ((lesson.own ? 1.0 : 0.0) - probability) * lesson.x;
      curvature +=
          lesson.share * probability * (1.0 - probability) * lesson.x * lesson.x.transpose();
    }
    Vector<size> change = curvature.ldlt().solve(slope);
    change *= std::min(1.0, 3.0 / change.norm());
    weights += change;
    if (change.norm() < 1e-6) break;
  }
  return weights;
}

// Learns from features, whose evidence differs more between kinds of scenes than that of columns.
// The log odds are shrunk by the factor that corrects those learnt without a kind for it.
Vector<feature_term_count> learn_of_features(
    const std::vector<Lesson<feature_term_count>>& lessons) {
  std::vector<Lesson<2>> left_out;
  for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
    std::vector<Lesson<feature_term_count>> rest;
    std::ranges::copy_if(lessons, std::back_inserter(rest),
                         [&](const auto& lesson) { return lesson.kind != kind; });
    const auto without = learn(rest);
    for (const auto& lesson : lessons) {
      if (lesson.kind != kind) continue;
      left_out.push_back(
          {Vector<2>(1.0, without.dot(lesson.x)), lesson.own, lesson.share, lesson.kind});
    }
  }
  const Vector<2> shrinkage = learn(left_out);
  Vector<feature_term_count> weights = learn(lessons);
  std::printf("features, not shrunk:");
  for (const double weight : weights) std::printf(" %.2f", weight);
  std::printf("; shrinkage %.2f, %.2f\n", shrinkage[0], shrinkage[1]);
  weights *= shrinkage[1];
  weights[0] += shrinkage[0];
  return weights;
}

// Prints the weighted number of answers in each tenth, the share of own places, and the known
// share of each scene.
template <class Probability>
void report(const char* title, const std::vector<Sample>& samples, const Probability& probability) {
  const std::array<double, 3> counts = counts_of(samples);
  std::array<std::array<double, 3>, 10> tenths{};
  std::array<double, 3> known_rates{};
  std::array<std::array<std::array<int, 2>, 4>, kinds.size()> scenes{};  // all, known
  for (const Sample& sample : samples) {
    const double p = probability(sample.evidence);
    const auto w = static_cast<std::size_t>(sample.whose);
    known_rates[w] += (p >= 0.5 ? 1.0 : 0.0) / counts[w];
    tenths[std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * p))][w] +=
        1.0 / 3.0 / counts[w];
    const std::size_t column = sample.whose == Whose::own ? (sample.disturbed ? 1 : 0) : w + 1;
    ++scenes[sample.kind][column][0];
    scenes[sample.kind][column][1] += p >= 0.5 ? 1 : 0;
  }
  std::printf("  %s: known are %.3f of own, %.3f of variants, %.4f of others\n", title,
              known_rates[0], known_rates[1], known_rates[2]);
  for (std::size_t t = 0; t < tenths.size(); ++t) {
    const double all = tenths[t][0] + tenths[t][1] + tenths[t][2];
    std::printf("    %.1f .. %.1f: %.4f of answers, %.2f of them own\n",
                0.1 * static_cast<double>(t), 0.1 * static_cast<double>(t + 1), all,
                tenths[t][0] / all);
  }
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    std::printf("    %-14s own, hidden, variants, others:", kinds[k].scene);
    for (const auto& [total, known] : scenes[k]) {
      std::printf(" %.3f", static_cast<double>(known) / std::max(1, total));
    }
    std::printf("\n");
  }
}

}  // namespace

int main() {
  Executor executor;
  std::vector<BuiltPlace> places;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (std::size_t v = 0; v < kinds[k].spacings_m.size(); ++v) {
      simulation::PlaceRecording recording =
          simulation::record_place({.scene = kinds[k].scene,
                                    .seed = v + 1,
                                    .spacing_m = kinds[k].spacings_m[v],
                                    .queries = queries,
                                    .columns = 256},
                                   executor);
      std::vector<simulation::PlacedView> disturbed = simulation::recapture_queries(
          recording, lab::place_conditions()[1].sensor, 7919 * (v + 1), executor);
      places.push_back({k, std::move(recording), std::move(disturbed)});
      std::fprintf(stderr, "%s %zu\n", kinds[k].scene, v + 1);
    }
  }
  std::vector<std::vector<Sample>> samples(rememberings.size());
  std::vector<Sample> for_columns;
  std::vector<Sample> for_features;
  for (std::size_t h = 0; h < rememberings.size(); ++h) {
    for (const BuiltPlace& place : places) {
      const auto more = ask(places, place, rememberings[h], executor);
      samples[h].insert(samples[h].end(), more.begin(), more.end());
    }
    // Features do not depend on the components.
    if (rememberings[h].components == full_components) {
      for_features.insert(for_features.end(), samples[h].begin(), samples[h].end());
    }
    if (rememberings[h].components < min_learnt_components) continue;
    std::ranges::remove_copy_if(samples[h], std::back_inserter(for_columns), &Sample::for_features);
  }
  const auto columns = learn(lessons_of(for_columns, column_features_of));
  std::vector<double> others;
  for (const Sample& sample : samples.back()) {
    if (sample.whose == Whose::other) {
      others.push_back(columns.dot(*column_features_of(sample.evidence)));
    }
  }
  const double last = std::max(0.0, quantile(others, 1.0 - max_others_known)) /
                      std::log(double{full_components} / rememberings.back().components);
  const auto doubtful = learn_of_features(lessons_of(for_features, doubtful_features_of_query));
  for (const double weight : columns) std::printf("%.2f\n", weight);
  std::printf("%.2f\nwhere columns leave doubt:\n", last);
  for (const double weight : doubtful) std::printf("%.2f\n", weight);
  const auto by_columns = [&](const PlaceEvidence& evidence) {
    return logistic(columns.dot(*column_features_of(evidence)) +
                    last * column_terms(evidence).back());
  };
  for (std::size_t h = 0; h < rememberings.size(); ++h) {
    std::printf("one of %d references, %d components\n", static_cast<int>(rememberings[h].one_of),
                rememberings[h].components);
    report("columns", samples[h], by_columns);
    report("and features", samples[h], [&](const PlaceEvidence& evidence) {
      const auto numbers = doubtful_features_of_query(evidence);
      return numbers ? logistic(doubtful.dot(*numbers)) : by_columns(evidence);
    });
  }
  return 0;
}
