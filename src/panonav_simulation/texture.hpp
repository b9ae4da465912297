#pragma once

#include <array>

#include "panonav/core/image.hpp"
#include "panonav/core/random.hpp"

namespace panonav::simulation {

/// Pictures for surfaces, made from a random engine. All tile: the left edge continues the right
/// one and the top the bottom, except posters and the like, which are made for one copy on a
/// surface. Sizes are powers of two. Colours are 0 .. 1.
using Colour = std::array<float, 3>;

/// Draws a colour of brightness `low` .. `high` whose channels differ from grey by a factor of up
/// to 1 -+ `spread`.
[[nodiscard]] Colour tint(Random& random, double low, double high, double spread);

/// Returns the colour times a random factor of 1 -+ `spread`: two things of the same make.
[[nodiscard]] Colour vary_colour(Random& random, Colour colour, double spread = 0.1);

/// Makes a mixture of noise over many scales whose power falls as 1 / f^exponent, as in natural
/// pictures. Brightness varies around `base` with the standard deviation `contrast`.
[[nodiscard]] Image noise_texture(Random& random, int size, Colour base, double contrast,
                                  double exponent = 2.0);

/// Makes boards with grain along v.
[[nodiscard]] Image wood_texture(Random& random, int size, Colour base);

/// Makes courses of bricks or tiles, `columns` by `rows` in one copy, with joints.
[[nodiscard]] Image brick_texture(Random& random, int size, int columns, int rows, Colour brick,
                                  Colour joint);

/// Makes a shelf seen from the front: boards with rows of books, binders and gaps between.
[[nodiscard]] Image bookshelf_texture(Random& random, int size, int boards);

/// Makes a picture with large shapes in strong colours, framed: a poster or painting.
[[nodiscard]] Image poster_texture(Random& random, int size);

/// Makes a window with crossbars, a bright sky and something dark at its lower edge.
[[nodiscard]] Image window_texture(Random& random, int size);

/// Makes a door with panels and a handle; the same for the same engine state.
[[nodiscard]] Image door_texture(Random& random, int size, Colour base);

/// Makes leaves and branches: dark and light patches at many scales.
[[nodiscard]] Image foliage_texture(Random& random, int size, Colour base);

/// Makes a sky with soft clouds; v = 0 is the horizon.
[[nodiscard]] Image sky_texture(Random& random, int width, int height);

}  // namespace panonav::simulation
