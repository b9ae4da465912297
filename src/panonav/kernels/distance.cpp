#include "panonav/kernels/distance.hpp"

#include "panonav/kernels/internal/bodies.hpp"

namespace panonav::kernels {

const DistanceKernels& distance_kernels(Instructions instructions) {
  return with_body<DistanceBody>(instructions, []<class Body>(Body) -> const DistanceKernels& {
    static constexpr DistanceKernels kernels{
        Body::l1,          Body::masked_l1,    Body::sketch_bounds, Body::sketch_bounds_at,
        Body::cell_tables, Body::encode_query, Body::cell_bounds,   Body::collect_at_most};
    return kernels;
  });
}

}  // namespace panonav::kernels
