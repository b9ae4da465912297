#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/evaluation/experiment.hpp"

namespace panonav {

ReproductionOptions quick_run(ReproductionOptions options) {
  options.scenes = 2;
  options.queries = 15;
  return options;
}

Reproduction reproduce_m04(const ReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  require(options.scenes >= 2, "scenes", options.scenes, ">= 2");
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error) throw FileError(options.out.string(), "cannot be made: " + error.message());

  std::vector<std::unique_ptr<Experiment>> experiments;
  experiments.push_back(rotational_invariance_experiment());
  experiments.push_back(power_spectrum_experiment());
  experiments.push_back(discrimination_experiment());
  experiments.push_back(distance_curve_experiment());
  experiments.push_back(similarity_surface_experiment());
  experiments.push_back(hierarchical_areas_experiment());
  experiments.push_back(area_shape_experiment());
  experiments.push_back(component_weights_experiment());
  experiments.push_back(rivals_experiment());

  // Each scene is one step for taking its views, one for every experiment and one for the lattice.
  const double steps = options.scenes * (2.0 + static_cast<double>(experiments.size()));
  double done = 0.0;
  const auto step = [&](const std::string& stage) {
    if (progress) progress(stage, done / steps);
    done += 1.0;
  };
  for (int s = 0; s < options.scenes; ++s) {
    const std::string name =
        "office " + std::to_string(s + 1) + " of " + std::to_string(options.scenes);
    step(name);
    const PlaceRecording place = record_place({.scene = "office",
                                               .seed = options.seed + static_cast<std::uint64_t>(s),
                                               .spacing_m = 0.25,
                                               .queries = options.queries,
                                               .rows = options.rows},
                                              executor);
    for (const auto& experiment : experiments) {
      step(name);
      experiment->add(place, executor);
    }
  }
  Reproduction result;
  reproduce_memory_table(result);
  for (const auto& experiment : experiments) experiment->report(options.out, result);
  reproduce_lattice(options, executor, step, result);
  if (progress) progress("done", 1.0);
  return result;
}

}  // namespace panonav
