#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "panonav/core/options.hpp"
#include "panonav/relative_pose/homing_view.hpp"
#include "panonav/route/snapshot_code.hpp"

namespace panonav {

void visit_options(SnapshotShape& shape, OptionVisitor& visitor);

/// Returns a view of fewer rows and components: each row is the mean of the rows that it covers,
/// weighted by the parts that lie within it, as if the panorama had been resampled. Throws
/// ContractError unless 1 <= rows <= those of the view and 2 <= components <= those of the view.
[[nodiscard]] HomingView reduce_view(const HomingView& view, int rows, int components);

/// Packs the coefficients a_k, b_k of a view. All coefficients of a component have one step: their
/// standard deviation, which the snapshot stores, times the step of the uniform quantiser with the
/// least squared error for a normal distribution [Max 1960 table II]. Values beyond the outermost
/// step saturate. Bytes: one for the largest standard deviation, in eighths of an octave; four bits
/// per component for its ratio to it, in half octaves; the codes of `bits` bits, component by
/// component, the cosines of all rows and then the sines; the lowest bit of a byte first. A view
/// without structure gives zeros. Throws OptionError; ContractError if the view has another shape.
[[nodiscard]] std::vector<std::uint8_t> pack_snapshot(const HomingView& view,
                                                      const SnapshotShape& shape = {});

/// Returns the steps of the components of a packed snapshot: unpacked coefficients that did not
/// saturate are within half a step. Throws ContractError as `unpack_snapshot`.
[[nodiscard]] std::vector<float> snapshot_steps(std::span<const std::uint8_t> bytes,
                                                const SnapshotShape& shape = {});

/// Unpacks a snapshot. Throws OptionError; ContractError if the number of bytes is wrong, or for
/// bytes that `pack_snapshot` does not write: unused bits that are set, no component with the
/// largest deviation, or codes without a scale.
[[nodiscard]] HomingView unpack_snapshot(std::span<const std::uint8_t> bytes,
                                         const SnapshotShape& shape,
                                         const std::optional<ElevationBand>& elevations);

}  // namespace panonav
