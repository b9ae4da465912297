// Learns the coefficients of `place_probability` on built-in scenes and prints them: 32 places,
// each remembered with all and with few references, of all and of few components,
// asked for its own places, as memorised and with other light and a tenth hidden, for places of
// other variants of its scene and for places of other scenes. Logistic regression; own places,
// variants and other scenes count a third each. About five minutes.

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "experiments/runs/make_each.hpp"
#include "experiments/runs/place_experiment.hpp"
#include "experiments/runs/tracking_run.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"

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
// The logistic regression learns from memories of at least so many components. With fewer, it
// learns what built-in scenes differ in and others do not; the last coefficient is then chosen so
// that of the places of other scenes at most this share is known.
constexpr int min_learnt_components = 6;
constexpr double max_others_known = 0.005;
constexpr int queries = 40;
constexpr std::size_t asked_of_others = 6;

enum class Whose { own, variant, other };
struct Place {
  std::size_t kind;
  PlaceRecording recording;
  std::vector<PlacedView> disturbed;
};
struct Sample {
  PlaceEvidence evidence;
  Whose whose;
};
constexpr int learnt_features = place_features - 1;  // without that of the components
using Vector = Eigen::Matrix<double, learnt_features, 1>;

Vector learnt_features_of(const PlaceEvidence& evidence) {
  return Eigen::Map<const Vector>(features_of(evidence).data());
}

PackedSignature truncated(PackedSignature view, SignatureShape shape) {
  view.shape = shape;
  view.magnitudes.resize(shape.size());
  view.phases.resize(shape.size());
  return view;
}

std::vector<Sample> ask(const std::vector<Place>& places, const Place& place,
                        const Remembering& how, Executor& executor) {
  Random random(place.recording.seed, how.one_of);
  std::vector<Point2> kept;
  const VisualMemory all = memory_of_references(place.recording, executor, [&](Point2 position) {
    if (random.index(how.one_of) != 0) return false;
    kept.push_back(position);
    return true;
  });
  const SignatureShape shape{all.shape().rows, how.components};
  VisualMemory memory(shape, all.full_scale(), all.elevations());
  for (const ViewId view : all.views()) {
    memory.append(truncated(all.packed(view), shape), all.info(view));
  }
  const Localiser localiser(memory);
  struct Query {
    const Panorama* view;
    Whose whose;
  };
  std::vector<Query> asked;
  for (const Place& other : places) {
    for (const auto* const views : {&other.recording.queries, &other.disturbed}) {
      for (std::size_t i = 0; i < views->size(); ++i) {
        const PlacedView& view = (*views)[i];
        if (&other == &place) {
          const bool is_near = std::ranges::any_of(kept, [&](Point2 position) {
            return distance(position, view.pose.position()) <= place.recording.spacing_m;
          });
          if (is_near) asked.push_back({&view.panorama, Whose::own});
        } else if (i < asked_of_others) {
          asked.push_back(
              {&view.panorama, other.kind == place.kind ? Whose::variant : Whose::other});
        }
      }
    }
  }
  return make_each(executor, asked.size(), [&](std::size_t i) {
    const PackedSignature query = truncated(signature_for(*asked[i].view, all), shape);
    return Sample{localiser.localise(query).evidence, asked[i].whose};
  });
}

Vector learn(const std::vector<Sample>& samples) {
  std::array<double, 3> counts{};
  for (const Sample& sample : samples) counts[static_cast<std::size_t>(sample.whose)] += 1.0;
  Vector weights = Vector::Zero();
  for (int step = 0; step < 50; ++step) {
    Vector slope = -1e-3 * weights;
    Eigen::Matrix<double, learnt_features, learnt_features> curvature =
        1e-3 * decltype(curvature)::Identity();
    for (const auto& [evidence, whose] : samples) {
      const Vector x = learnt_features_of(evidence);
      const double probability = 1.0 / (1.0 + std::exp(-weights.dot(x)));
      const double share =
          static_cast<double>(samples.size()) / 3.0 / counts[static_cast<std::size_t>(whose)];
      slope += share * ((whose == Whose::own ? 1.0 : 0.0) - probability) * x;
      curvature += share * probability * (1.0 - probability) * x * x.transpose();
    }
    Vector change = curvature.ldlt().solve(slope);
    change *= std::min(1.0, 3.0 / change.norm());
    weights += change;
    if (change.norm() < 1e-6) break;
  }
  return weights;
}

// Of answers in each tenth: how many, weighted as in `learn`, and how many of them are own places.
void report(const Remembering& how, const std::vector<Sample>& samples, const Vector& weights,
            double last) {
  std::array<double, 3> counts{};
  for (const Sample& sample : samples) counts[static_cast<std::size_t>(sample.whose)] += 1.0;
  std::array<std::array<double, 3>, 10> tenths{};
  std::array<double, 3> taken{};
  for (const auto& [evidence, whose] : samples) {
    const double z =
        weights.dot(learnt_features_of(evidence)) + last * features_of(evidence).back();
    const double probability = 1.0 / (1.0 + std::exp(-z));
    const auto w = static_cast<std::size_t>(whose);
    taken[w] += (probability >= 0.5 ? 1.0 : 0.0) / counts[w];
    tenths[std::min<std::size_t>(9, static_cast<std::size_t>(10.0 * probability))][w] +=
        1.0 / 3.0 / counts[w];
  }
  std::printf(
      "one of %d references, %d components: known are %.3f of own, %.3f of variants, %.4f of "
      "others\n",
      static_cast<int>(how.one_of), how.components, taken[0], taken[1], taken[2]);
  for (std::size_t t = 0; t < tenths.size(); ++t) {
    const double all = tenths[t][0] + tenths[t][1] + tenths[t][2];
    std::printf("  %.1f .. %.1f: %.4f of answers, %.2f of them own\n", 0.1 * static_cast<double>(t),
                0.1 * static_cast<double>(t + 1), all, tenths[t][0] / all);
  }
}

}  // namespace

int main() {
  Executor executor;
  std::vector<Place> places;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    for (std::size_t v = 0; v < kinds[k].spacings_m.size(); ++v) {
      PlaceRecording recording = record_place({.scene = kinds[k].scene,
                                               .seed = v + 1,
                                               .spacing_m = kinds[k].spacings_m[v],
                                               .queries = queries,
                                               .columns = 256},
                                              executor);
      std::vector<PlacedView> disturbed =
          retake_queries(recording, place_conditions()[1].sensor, 7919 * (v + 1), executor);
      places.push_back({k, std::move(recording), std::move(disturbed)});
      std::fprintf(stderr, "%s %zu\n", kinds[k].scene, v + 1);
    }
  }
  std::vector<std::vector<Sample>> samples(rememberings.size());
  std::vector<Sample> learnt_from;
  for (std::size_t h = 0; h < rememberings.size(); ++h) {
    for (const Place& place : places) {
      const auto more = ask(places, place, rememberings[h], executor);
      samples[h].insert(samples[h].end(), more.begin(), more.end());
    }
    if (rememberings[h].components < min_learnt_components) continue;
    learnt_from.insert(learnt_from.end(), samples[h].begin(), samples[h].end());
  }
  const Vector weights = learn(learnt_from);
  std::vector<double> others;
  for (const auto& [evidence, whose] : samples.back()) {
    if (whose == Whose::other) others.push_back(weights.dot(learnt_features_of(evidence)));
  }
  const double last = std::max(0.0, quantile(others, 1.0 - max_others_known)) /
                      std::log(double{full_components} / rememberings.back().components);
  for (const double weight : weights) std::printf("%.2f\n", weight);
  std::printf("%.2f\n", last);
  for (std::size_t h = 0; h < rememberings.size(); ++h) {
    report(rememberings[h], samples[h], weights, last);
  }
  return 0;
}
