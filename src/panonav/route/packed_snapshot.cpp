#include "panonav/route/packed_snapshot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr int min_snapshot_bits = 3;
// Steps of the uniform quantiser of least squared error for a normal distribution of deviation 1,
// for 3 .. 8 bits [Max 1960 table II; 7 and 8 bits by the same minimisation].
constexpr std::array<double, 6> normal_steps{0.5860, 0.3352, 0.1881, 0.1041, 0.0569, 0.0308};

// Deviation of code 1 of the first byte; code 255 is 2^31.75 times larger.
constexpr double min_deviation = 1e-6;
constexpr double codes_per_octave = 8.0;
// A ratio of 15 is an amplitude of 2^-7.5, less than a step of the largest component.
constexpr double ratios_per_octave = 2.0;
constexpr int ratio_bits = 4;

void write_bits(std::vector<std::uint8_t>& bytes, std::size_t& position, int bits, unsigned value) {
  for (int i = 0; i < bits; ++i, ++position) {
    const unsigned bit = value >> static_cast<unsigned>(i) & 1U;
    bytes[position / 8] = static_cast<std::uint8_t>(bytes[position / 8] | bit << (position % 8));
  }
}

unsigned read_bits(std::span<const std::uint8_t> bytes, std::size_t& position, int bits) {
  unsigned value = 0;
  for (int i = 0; i < bits; ++i, ++position) {
    const unsigned bit = static_cast<unsigned>(bytes[position / 8]) >> (position % 8) & 1U;
    value |= bit << static_cast<unsigned>(i);
  }
  return value;
}

std::size_t scale_bytes(int components) {
  return 1 + (static_cast<std::size_t>(components) * ratio_bits + 7) / 8;
}

double decode_deviation(int code, int ratio) {
  if (code == 0) return 0.0;
  return min_deviation * std::exp2((code - 1) / codes_per_octave - ratio / ratios_per_octave);
}

double coefficient_deviation(const HomingView& view, int k) {
  double sum = 0.0;
  for (int y = 0; y < view.rows(); ++y) {
    const auto a = static_cast<double>(view.a(y, k));
    const auto b = static_cast<double>(view.b(y, k));
    sum += a * a + b * b;
  }
  return std::sqrt(sum / ((k == 0 ? 1 : 2) * view.rows()));
}

unsigned quantise(float value, double step, int bits) {
  const double half = std::exp2(bits - 1);
  return static_cast<unsigned>(
      std::clamp(std::floor(static_cast<double>(value) / step), -half, half - 1.0) + half);
}

// Throws ContractError for bytes that `pack_snapshot` does not write; returns the steps.
std::vector<float> check_and_read_steps(std::span<const std::uint8_t> bytes,
                                        const SnapshotShape& shape) {
  validate(shape);
  require(bytes.size() == shape.bytes(), "bytes of a snapshot", static_cast<double>(bytes.size()),
          to_text(static_cast<double>(shape.bytes())));
  const int code = bytes[0];
  std::size_t position = 8;
  std::vector<float> steps;
  unsigned min_ratio = 15;
  for (int k = 0; k < shape.components; ++k) {
    const unsigned ratio = read_bits(bytes, position, ratio_bits);
    min_ratio = std::min(min_ratio, ratio);
    steps.push_back(
        static_cast<float>(normal_steps[static_cast<std::size_t>(shape.bits - min_snapshot_bits)] *
                           decode_deviation(code, static_cast<int>(ratio))));
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
  if (code == 0) {
    require(std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0; }),
            "a code of a snapshot without scale", 1.0, "0");
  }
  return steps;
}

}  // namespace

std::size_t SnapshotShape::bytes() const noexcept {
  return scale_bytes(components) + (coefficients() * static_cast<std::size_t>(bits) + 7) / 8;
}

void visit_options(SnapshotShape& shape, OptionVisitor& visitor) {
  using T = SnapshotShape;
  constexpr OptionTable table{
      option<&T::rows>("rows of a snapshot", 1, 255),
      option<&T::components>("Fourier components of each row of a snapshot, including the constant "
                             "component (k = 0)",
                             2, 64),
      option<&T::bits>("bits of each coefficient of a snapshot", min_snapshot_bits, 8),
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
  std::vector<double> deviations;
  for (int k = 0; k < shape.components; ++k) deviations.push_back(coefficient_deviation(view, k));
  const double largest = *std::max_element(deviations.begin(), deviations.end());
  // Rounding errors of a view without structure have no scale.
  const double code =
      std::round(1.0 + codes_per_octave * std::log2(std::max(largest, 1e-30) / min_deviation));
  if (code < 1.0) return bytes;
  bytes[0] = static_cast<std::uint8_t>(std::min(code, 255.0));
  std::size_t position = 8;
  std::vector<double> steps;
  for (const double deviation : deviations) {
    const double ratio =
        std::round(ratios_per_octave * std::log2(largest / std::max(deviation, 1e-30)));
    const int ratio_code = static_cast<int>(std::min(ratio, 15.0));
    write_bits(bytes, position, ratio_bits, static_cast<unsigned>(ratio_code));
    steps.push_back(normal_steps[static_cast<std::size_t>(shape.bits - min_snapshot_bits)] *
                    decode_deviation(bytes[0], ratio_code));
  }
  position = 8 * scale_bytes(shape.components);
  for (int k = 0; k < shape.components; ++k) {
    const double step = steps[static_cast<std::size_t>(k)];
    for (const float a : view.cosines(k)) {
      write_bits(bytes, position, shape.bits, quantise(a, step, shape.bits));
    }
    if (k == 0) continue;
    for (const float b : view.sines(k)) {
      write_bits(bytes, position, shape.bits, quantise(b, step, shape.bits));
    }
  }
  return bytes;
}

std::vector<float> snapshot_steps(std::span<const std::uint8_t> bytes, const SnapshotShape& shape) {
  return check_and_read_steps(bytes, shape);
}

HomingView unpack_snapshot(std::span<const std::uint8_t> bytes, const SnapshotShape& shape,
                           const std::optional<ElevationBand>& elevations) {
  const std::vector<float> steps = check_and_read_steps(bytes, shape);
  std::size_t position = 8 * scale_bytes(shape.components);
  const auto rows = static_cast<std::size_t>(shape.rows);
  const auto half = static_cast<float>(std::exp2(shape.bits - 1));
  std::vector<float> cosines;
  std::vector<float> sines(rows);
  for (int k = 0; k < shape.components; ++k) {
    const auto read = [&](std::vector<float>& values) {
      for (std::size_t y = 0; y < rows; ++y) {
        const auto code = static_cast<float>(read_bits(bytes, position, shape.bits));
        values.push_back((code - half + 0.5F) * steps[static_cast<std::size_t>(k)]);
      }
    };
    read(cosines);
    if (k > 0) read(sines);
  }
  return {shape.rows, shape.components, std::move(cosines), std::move(sines), elevations};
}

}  // namespace panonav
