#pragma once

#include <string>
#include <vector>

#include "panonav/evaluation/place_recording.hpp"
#include "panonav/evaluation/reproduction.hpp"

namespace panonav {

// The parts of `reproduce_m04`, one per figure or table of the paper. Each appends its rows and
// writes its pictures into `folder`.

/// Table 1 of [M03]: bits of the raw image, the cylinder and the signature, counted from the
/// objects.
void reproduce_memory_table(Reproduction& result);

/// Figure 4: what a turn on the spot changes, against what a step to the next reference changes.
void reproduce_rotational_invariance(const std::vector<PlaceRecording>& recordings,
                                     std::uint64_t seed, Reproduction& result);

/// Figure 5: the power spectrum of one view and the mean of all.
void reproduce_power_spectrum(const std::vector<PlaceRecording>& recordings,
                              const std::filesystem::path& folder, Reproduction& result);

/// Figure 6: discrimination with 2, 5, 15, 50 and 256 components.
void reproduce_discrimination(const std::vector<PlaceRecording>& recordings,
                              const std::filesystem::path& folder, Executor& executor,
                              Reproduction& result);

/// Figure 7: dissimilarity against distance, its linear range and its saturation.
void reproduce_distance_curve(const std::vector<PlaceRecording>& recordings,
                              const std::filesystem::path& folder, Executor& executor,
                              Reproduction& result);

/// Figure 8: similarity at every reference view.
void reproduce_similarity_surface(const PlaceRecording& recording,
                                  const std::filesystem::path& folder, Reproduction& result);

/// Figures 9 and 10: areas that shrink with the number of components, and how their shape follows
/// the objects around, which the authors left open.
void reproduce_hierarchical_areas(const std::vector<PlaceRecording>& recordings,
                                  const std::filesystem::path& folder, Reproduction& result);

/// The ways of recognising places that the paper argues against, on the same views.
void compare_rivals(const std::vector<PlaceRecording>& recordings,
                    const std::filesystem::path& folder, Executor& executor, Reproduction& result);

}  // namespace panonav
