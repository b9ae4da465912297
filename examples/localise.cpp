// Localises an image:   localise office.panonav view.jpg
#include <cstdio>
#include <exception>

#include "panonav/io/image_file.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

int main(int argc, char** argv) try {
  if (argc != 3) return std::puts("usage: localise MEMORY PICTURE"), 2;
  const panonav::PlaceRecogniser recogniser(argv[1]);
  const auto place = recogniser.localise(panonav::read_image(argv[2]));
  if (!place.known || !place.position) return std::puts("unknown place"), 1;
  std::printf("%.17g %.17g\n", place.position->x_m, place.position->y_m);
} catch (const std::exception& error) {
  return std::puts(error.what()), 2;
}
