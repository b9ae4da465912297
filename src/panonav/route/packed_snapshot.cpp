#include "panonav/route/packed_snapshot.hpp"

#include <algorithm>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/relative_pose/fourier_homing.hpp"
#include "panonav/route/internal/snapshot_bits.hpp"

namespace panonav {

namespace {

// Throws ContractError for bytes that `pack_snapshot` does not write.
void check_snapshot(std::span<const std::uint8_t> bytes, const SnapshotShape& shape) {
  validate(shape);
  require(bytes.size() == shape.bytes(), "bytes of a snapshot", static_cast<double>(bytes.size()),
          to_text(static_cast<double>(shape.bytes())));
  std::size_t position = 8;
  unsigned min_ratio = 15;
  for (int k = 0; k < shape.components; ++k) {
    min_ratio = std::min(min_ratio, read_bits(bytes, position, ratio_bits));
  }
  require(min_ratio == 0, "smallest ratio of a snapshot", min_ratio, "0");
  const auto require_unused = [&](std::size_t end) {
    while (position < end) {
      require(read_bits(bytes, position, 1) == 0, "an unused bit of a snapshot", 1.0, "0");
    }
  };
  require_unused(8 * scale_bytes(shape.components));
  position += shape.coefficients() * static_cast<std::size_t>(shape.bits);
  require_unused(8 * bytes.size());
  if (bytes[0] == 0) {
    require(std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0; }),
            "a code of a snapshot without scale", 1.0, "0");
  }
}

}  // namespace

void visit_options(SnapshotShape& shape, OptionVisitor& visitor) {
  using T = SnapshotShape;
  constexpr OptionTable table{
      option<&T::rows>("rows of a snapshot", 1, 255),
      option<&T::components>("Fourier components of each row of a snapshot, including the constant "
                             "component (k = 0)",
                             2, 64),
      option<&T::bits>("bits of each coefficient of a snapshot", 3, 8),
  };
  table.visit(shape, visitor);
}

HomingView reduce_view(const HomingView& view, int rows, int components) {
  require(rows >= 1 && rows <= view.rows(), "rows", rows, "1 .. " + to_text(view.rows()));
  require(components >= 2 && components <= view.components(), "components", components,
          "2 .. " + to_text(view.components()));
  const double rows_per_row = static_cast<double>(view.rows()) / rows;
  std::vector<float> cosines;
  std::vector<float> sines;
  for (int k = 0; k < components; ++k) {
    for (int row = 0; row < rows; ++row) {
      const double top = row * rows_per_row;
      const double bottom = (row + 1) * rows_per_row;
      double a = 0.0;
      double b = 0.0;
      for (int y = static_cast<int>(top); y < view.rows() && y < bottom; ++y) {
        const double part = std::min(bottom, y + 1.0) - std::max(top, static_cast<double>(y));
        a += part * static_cast<double>(view.a(y, k));
        b += part * static_cast<double>(view.b(y, k));
      }
      cosines.push_back(static_cast<float>(a / rows_per_row));
      sines.push_back(static_cast<float>(b / rows_per_row));
    }
  }
  return {rows, components, std::move(cosines), std::move(sines), view.elevations()};
}

std::vector<std::uint8_t> pack_snapshot(const HomingView& view, const SnapshotShape& shape) {
  validate(shape);
  require(view.rows() == shape.rows, "rows of a view", view.rows(), to_text(shape.rows));
  require(view.components() == shape.components, "components of a view", view.components(),
          to_text(shape.components));
  std::vector<std::uint8_t> bytes(shape.bytes());
  encode_snapshot(view_coefficients(view), shape, bytes);
  return bytes;
}

std::vector<float> snapshot_steps(std::span<const std::uint8_t> bytes, const SnapshotShape& shape) {
  check_snapshot(bytes, shape);
  std::vector<float> steps;
  for (int k = 0; k < shape.components; ++k) steps.push_back(decode_step(bytes, shape, k));
  return steps;
}

HomingView unpack_snapshot(std::span<const std::uint8_t> bytes, const SnapshotShape& shape,
                           const std::optional<ElevationBand>& elevations) {
  check_snapshot(bytes, shape);
  const std::size_t size =
      static_cast<std::size_t>(shape.rows) * static_cast<std::size_t>(shape.components);
  std::vector<float> cosines(size);
  std::vector<float> sines(size);
  decode_snapshot(bytes, shape, cosines, sines);
  return {shape.rows, shape.components, std::move(cosines), std::move(sines), elevations};
}

}  // namespace panonav
