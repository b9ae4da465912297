// Memorises one view and finds it again after a turn, with nothing but the installed package.
#include <cmath>
#include <cstdio>

#include "panonav/localisation/localiser.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/panorama.hpp"
#include "panonav/signature/compass.hpp"

int main() {
  panonav::Panorama view(8, 64, std::nullopt);
  for (int y = 0; y < view.rows(); ++y) {
    for (int c = 0; c < view.columns(); ++c) {
      const double phi = view.azimuth_rad(c);
      view.at(y, c) = static_cast<float>(0.5 + 0.2 * std::cos(phi + y) + 0.1 * std::cos(3.0 * phi));
    }
  }
  const auto here = panonav::compute_signature(view, 8);
  panonav::VisualMemory memory(here.shape(), 1.0F, view.elevations());
  const auto id =
      memory.append(here, {.name = "here", .pose = std::nullopt, .stamp_s = std::nullopt});
  const auto turned = panonav::compute_signature(panonav::rotate_columns(view, 16), 8);
  const auto result = memory.search(panonav::pack(turned, memory.full_scale()));
  const auto place =
      panonav::Localiser(memory).localise(panonav::pack(turned, memory.full_scale()));
  if (place.matches.size() != 1 || place.matches.front().view != id) return 1;
  const auto heading = panonav::compass(turned, here);
  if (result.matches.size() != 1 || result.matches.front().view != id || !heading) return 1;
  std::printf("found again, turned by %.1f degrees\n", panonav::degrees(heading->heading_rad));
  return std::abs(heading->heading_rad - 1.5707963) < 0.01 ? 0 : 1;
}
