#include <string>

#include "panonav/core/error.hpp"
#include "panonav/evaluation/m04_figures.hpp"

namespace panonav {

Reproduction reproduce_m04(const ReproductionOptions& options, Executor& executor,
                           const ReproductionProgress& progress) {
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error) throw FileError(options.out.string(), "cannot be made: " + error.message());
  const auto say = [&](std::string_view stage, double fraction) {
    if (progress) progress(stage, fraction);
  };

  const int scenes = options.quick ? 2 : 10;
  std::vector<PlaceRecording> recordings;
  for (int s = 0; s < scenes; ++s) {
    say("taking views in office " + std::to_string(s + 1) + " of " + std::to_string(scenes),
        0.6 * s / scenes);
    recordings.push_back(record_place({.scene = "office",
                                       .seed = options.seed + static_cast<std::uint64_t>(s),
                                       .spacing_m = 0.25,
                                       .queries = options.quick ? 15 : 60},
                                      executor));
  }

  Reproduction result;
  const auto& out = options.out;
  reproduce_memory_table(result);
  say("figure 4", 0.60);
  reproduce_rotational_invariance(recordings, options.seed, result);
  say("figure 5", 0.65);
  reproduce_power_spectrum(recordings, out, result);
  say("figure 6", 0.70);
  reproduce_discrimination(recordings, out, executor, result);
  say("figure 7", 0.78);
  reproduce_distance_curve(recordings, out, executor, result);
  say("figure 8", 0.80);
  reproduce_similarity_surface(recordings.front(), out, result);
  say("figures 9 and 10", 0.82);
  reproduce_hierarchical_areas(recordings, out, result);
  say("rivals", 0.85);
  compare_rivals(recordings, out, executor, result);
  say("done", 1.0);
  return result;
}

}  // namespace panonav
