#pragma once

#include <array>

#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"

namespace panonav::simulation {

/// Textures made by a random engine. All can be tiled: opposite edges match, except for posters and
/// the like, which are shown once per surface. Sizes are powers of two. Colours are 0 .. 1.
using Colour = std::array<float, 3>;

/// Draws a colour of brightness `low` .. `high`; each channel is multiplied by a random factor of 1
/// -+ `spread`.
[[nodiscard]] Colour sample_colour(Random& random, double low, double high, double spread);

/// Returns the colour times a random factor of 1 -+ `spread`, as of two products of the same make.
[[nodiscard]] Colour vary_colour(Random& random, Colour colour, double spread = 0.1);

/// Makes noise over many scales whose power falls as 1 / f^exponent, as in natural images.
/// Brightness varies around `base` with the relative standard deviation `contrast`.
[[nodiscard]] Image noise_texture(Random& random, int size, Colour base, double contrast,
                                  double exponent = 2.0);

/// Makes boards with grain along v.
[[nodiscard]] Image wood_texture(Random& random, int size, Colour base);

/// Makes courses of bricks or tiles with joints, `columns` by `rows` in one texture.
[[nodiscard]] Image brick_texture(Random& random, int size, int columns, int rows, Colour brick,
                                  Colour joint);

/// Makes the front of a shelf: boards with rows of books and gaps.
[[nodiscard]] Image bookshelf_texture(Random& random, int size, int boards);

/// Makes a framed poster or painting with large shapes in strong colours.
[[nodiscard]] Image poster_texture(Random& random, int size);

/// Makes a window with crossbars, a bright sky and a dark lower edge.
[[nodiscard]] Image window_texture(Random& random, int size);

/// Makes a door with panels and a handle; the same random engine state gives the same door.
[[nodiscard]] Image door_texture(Random& random, int size, Colour base);

/// Makes foliage: dark and light patches at many scales.
[[nodiscard]] Image foliage_texture(Random& random, int size, Colour base);

/// Makes a sky with soft clouds; v = 0 is the horizon.
[[nodiscard]] Image sky_texture(Random& random, int width, int height);

}  // namespace panonav::simulation
