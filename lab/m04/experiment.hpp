#pragma once

#include <memory>
#include <string>

#include "lab/experiments.hpp"
#include "panonav_simulation/place_recording.hpp"

namespace panonav::lab {

/// One figure of a paper, measured over any number of places. Places are added one at a time,
/// because the views of all places together would need gigabytes of memory.
class Experiment {
 public:
  virtual ~Experiment() = default;
  /// Measures one place. Results depend only on the places and their order.
  virtual void add(const simulation::PlaceRecording& place, Executor& executor) = 0;
  /// Appends rows and writes images. Called once, after the last place; throws ContractError if no
  /// place was added.
  virtual void report(Reproduction& result) const = 0;
};

/// [M04] figure 4: change of the signature by a rotation on the spot, compared with a step to the
/// next reference.
[[nodiscard]] std::unique_ptr<Experiment> make_rotational_invariance_experiment();
/// [M04] figure 5: power spectrum of one view, and the mean over all views.
[[nodiscard]] std::unique_ptr<Experiment> make_power_spectrum_experiment();
/// [M04] figure 6: discrimination with 2, 5, 15, 50 and 256 components.
[[nodiscard]] std::unique_ptr<Experiment> make_discrimination_experiment();
/// [M04] figure 7: dissimilarity against distance, its linear range and its saturation.
[[nodiscard]] std::unique_ptr<Experiment> make_distance_curve_experiment();
/// [M04] figure 8: similarity at every reference view.
[[nodiscard]] std::unique_ptr<Experiment> make_similarity_surface_experiment();
/// [M04] figure 9: localisation areas that shrink as more components are compared.
[[nodiscard]] std::unique_ptr<Experiment> make_hierarchical_areas_experiment();
/// [M04] figure 10: how the shape of localisation areas depends on the surrounding objects, left
/// open by the authors.
[[nodiscard]] std::unique_ptr<Experiment> make_area_shape_experiment();
/// [M04] eq. 6: component weights learnt in one place and applied in the next.
[[nodiscard]] std::unique_ptr<Experiment> make_component_weights_experiment();
/// Compares the place recognition methods that [M04] argues against on the same views.
[[nodiscard]] std::unique_ptr<Experiment> make_rivals_experiment();

/// [M04] section 3: views arranged by their similarity (figures 12, 15, 16 and 17), in the hall, a
/// small room and the periodic hall.
void reproduce_lattice(const Experiments& context);
/// [M04] section 3.2 in `lab`, `hall` and `office`: springs between all pairs, springs to few
/// neighbours, magnitudes alone by `arrange_by_magnitudes`, and phases, on the same views.
void reproduce_magnitudes_alone(const Experiments& context);

/// Adds [M03] table 1: bits of the raw image, the panorama and the signature, computed from the
/// sizes of these objects.
void reproduce_memory_table(Reproduction& result);

}  // namespace panonav::lab
