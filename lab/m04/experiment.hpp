#pragma once

#include <memory>
#include <string>

#include "lab/experiments.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// One figure of a paper, measured over any number of places. Places come one at a time, because
/// the views of all of them together would need gigabytes.
class Experiment {
 public:
  virtual ~Experiment() = default;
  /// Measures in one place. Results depend on the places and their order alone.
  virtual void add(const simulation::PlaceRecording& place, Executor& executor) = 0;
  /// Appends rows and writes images. Called once, after the last place; throws
  /// ContractError when there was none.
  virtual void report(Reproduction& result) const = 0;
};

/// [M04] figure 4: what a turn on the spot changes, against what a step to the next reference
/// changes.
[[nodiscard]] std::unique_ptr<Experiment> rotational_invariance_experiment();
/// [M04] figure 5: the power spectrum of one view and the mean of all.
[[nodiscard]] std::unique_ptr<Experiment> power_spectrum_experiment();
/// [M04] figure 6: discrimination with 2, 5, 15, 50 and 256 components.
[[nodiscard]] std::unique_ptr<Experiment> discrimination_experiment();
/// [M04] figure 7: dissimilarity against distance, its linear range and its saturation.
[[nodiscard]] std::unique_ptr<Experiment> distance_curve_experiment();
/// [M04] figure 8: similarity at every reference view.
[[nodiscard]] std::unique_ptr<Experiment> similarity_surface_experiment();
/// [M04] figure 9: areas that shrink with the number of components.
[[nodiscard]] std::unique_ptr<Experiment> hierarchical_areas_experiment();
/// [M04] figure 10: how the shape of the areas follows the objects around, which the authors left
/// open.
[[nodiscard]] std::unique_ptr<Experiment> area_shape_experiment();
/// [M04] eq. 6: weights learnt in one place and used in the next.
[[nodiscard]] std::unique_ptr<Experiment> component_weights_experiment();
/// Compares the ways of recognising places that [M04] argues against, on the same views.
[[nodiscard]] std::unique_ptr<Experiment> rivals_experiment();

/// [M04] section 3: views that arrange themselves (figures 12, 15, 16 and 17), in the hall, a small
/// room and the periodic hall.
void reproduce_lattice(const Experiments& context);

/// Adds [M03] table 1: bits of the raw image, the cylinder and the signature, counted from the
/// objects.
void reproduce_memory_table(Reproduction& result);

}  // namespace panonav::lab
