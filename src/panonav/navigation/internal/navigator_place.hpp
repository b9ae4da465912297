#pragma once

// What the parts of `Navigator` hand on to each other within a look; not for others.

#include <cstddef>
#include <optional>
#include <vector>

#include "panonav/navigation/area_views.hpp"
#include "panonav/navigation/navigator.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

struct Navigator::Seen {
  const FourierSignature& signature;
  SeenView view;
};

// The references most like a view: around the last place, and in all of the area.
struct Navigator::Located {
  std::vector<std::size_t> around;
  std::optional<FoundView> here;
  std::optional<FoundView> anywhere;
  bool elsewhere = false;  // the latter is another place, and looks right
};

}  // namespace panonav
