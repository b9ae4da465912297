// Localises an image: localise MEMORY IMAGE
#include <cstdio>
#include <exception>

#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

int main(int argc, char** argv) try {
  if (argc != 3) return std::puts("usage: localise MEMORY IMAGE"), 2;
  const panonav::PlaceRecogniser recogniser(argv[1]);
  const auto place = recogniser.localise(panonav::read_image(argv[2]));
  if (!place.known) return std::puts("unknown place"), 1;
  const auto& view = place.matches.front();
  // Empty if the views of this place have no positions.
  if (place.position) std::printf("%.17g %.17g ", place.position->x_m, place.position->y_m);
  std::printf("near %s", view.name.c_str());
  // Empty if the image or the view has no structure.
  if (view.heading_rad) std::printf(" turned by %.17g rad", *view.heading_rad);
  std::puts("");
} catch (const std::exception& error) {
  return std::puts(error.what()), 2;
}
