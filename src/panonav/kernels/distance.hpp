#pragma once

#include "panonav/kernels/dispatch.hpp"

namespace panonav::kernels {

/// Returns the kernels for one of `available_instructions()`; for any other set the scalar ones.
[[nodiscard]] const DistanceKernels& distance_kernels(Instructions instructions);

}  // namespace panonav::kernels
