#include "panonav/storage/internal/route_lines.hpp"

#include <zlib.h>

#include <bit>
#include <cmath>
#include <new>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

// Head of a line: x_m, y_m, heading_rad (8 bytes each) and its rotation in columns (2 bytes). Byte
// k of all lines is stored together, so that values that hardly change along the route are
// adjacent.
constexpr std::size_t reals_of_pose = 3;
constexpr std::size_t head_bytes = 8 * reals_of_pose + 2;

double& to_real(Pose2& pose, std::size_t i) {
  return i == 0 ? pose.x_m : i == 1 ? pose.y_m : pose.heading_rad;
}

// Returns the columns by which the previous line is shifted to the heading of this one.
std::size_t rotation_in_columns(const Pose2& before, const Pose2& now, std::size_t columns) {
  const auto size = static_cast<long long>(columns);
  const auto rotation = std::llround((now.heading_rad - before.heading_rad) *
                                     static_cast<double>(columns) / (2.0 * std::numbers::pi));
  return static_cast<std::size_t>((rotation % size + size) % size);
}

// Predicts a column as the mean of its left neighbour and of the previous line at that place.
int predict_pixel(std::span<const std::uint8_t> before, std::size_t rotation,
                  std::span<const std::uint8_t> line, std::size_t column) {
  const int above = before.empty() ? 0 : before[(column + rotation) % before.size()];
  return (above + (column == 0 ? above : line[column - 1])) / 2;
}

std::vector<std::uint8_t> compress_bytes(std::span<const std::uint8_t> plain, int strategy) {
  z_stream stream{};
  constexpr int window_bits = 15;
  constexpr int memory_level = 8;
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, window_bits, memory_level,
                   strategy) != Z_OK) {
    throw std::bad_alloc();
  }
  std::vector<std::uint8_t> packed(deflateBound(&stream, static_cast<uLong>(plain.size())));
  stream.next_in = const_cast<Bytef*>(plain.data());
  stream.avail_in = static_cast<uInt>(plain.size());
  stream.next_out = packed.data();
  stream.avail_out = static_cast<uInt>(packed.size());
  const int code = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (code != Z_STREAM_END) throw std::bad_alloc();  // cannot happen: the buffer has the bound
  return packed;
}

}  // namespace

std::vector<std::uint8_t> pack_route_lines(const RoutePanorama& route, std::size_t first,
                                           std::size_t count) {
  const auto columns = static_cast<std::size_t>(route.columns());
  std::vector<std::uint8_t> plain(count * (head_bytes + columns));
  for (std::size_t n = 0; n < count; ++n) {
    Pose2 pose = route.poses()[first + n];
    for (std::size_t i = 0; i < reals_of_pose; ++i) {
      const auto word = std::bit_cast<std::uint64_t>(to_real(pose, i));
      for (std::size_t k = 0; k < 8; ++k) {
        plain[(8 * i + k) * count + n] = static_cast<std::uint8_t>((word >> (8 * k)) & 255U);
      }
    }
    std::span<const std::uint8_t> before;
    std::size_t rotation = 0;
    if (n > 0) {
      before = route.line(first + n - 1);
      rotation = rotation_in_columns(route.poses()[first + n - 1], pose, columns);
    }
    plain[8 * reals_of_pose * count + n] = static_cast<std::uint8_t>(rotation & 255U);
    plain[(8 * reals_of_pose + 1) * count + n] = static_cast<std::uint8_t>(rotation >> 8U);
    const auto line = route.line(first + n);
    std::uint8_t* const to = plain.data() + count * head_bytes + n * columns;
    for (std::size_t c = 0; c < columns; ++c) {
      to[c] = static_cast<std::uint8_t>((line[c] - predict_pixel(before, rotation, line, c)) & 255);
    }
  }
  std::vector<std::uint8_t> packed = compress_bytes(plain, Z_DEFAULT_STRATEGY);
  if (plain.size() > max_compression_ratio * packed.size()) {
    packed = compress_bytes(plain, Z_HUFFMAN_ONLY);  // at least one bit a byte
  }
  return packed;
}

bool unpack_route_lines(std::span<const std::uint8_t> bytes, std::size_t count,
                        RoutePanorama& route) {
  const auto columns = static_cast<std::size_t>(route.columns());
  if (count * (head_bytes + columns) > max_compression_ratio * bytes.size()) return false;
  std::vector<std::uint8_t> plain(count * (head_bytes + columns));
  auto size = static_cast<uLongf>(plain.size());
  auto read = static_cast<uLong>(bytes.size());
  if (uncompress2(plain.data(), &size, bytes.data(), &read) != Z_OK || size != plain.size() ||
      read != bytes.size()) {
    return false;
  }
  std::vector<std::uint8_t> before;
  std::vector<std::uint8_t> line(columns);
  for (std::size_t n = 0; n < count; ++n) {
    Pose2 pose;
    for (std::size_t i = 0; i < reals_of_pose; ++i) {
      std::uint64_t word = 0;
      for (std::size_t k = 0; k < 8; ++k) {
        word |= std::uint64_t{plain[(8 * i + k) * count + n]} << (8 * k);
      }
      to_real(pose, i) = std::bit_cast<double>(word);
    }
    const std::size_t rotation = plain[8 * reals_of_pose * count + n] +
                                 256U * std::size_t{plain[(8 * reals_of_pose + 1) * count + n]};
    const std::uint8_t* const from = plain.data() + count * head_bytes + n * columns;
    for (std::size_t c = 0; c < columns; ++c) {
      line[c] =
          static_cast<std::uint8_t>((predict_pixel(before, rotation, line, c) + from[c]) & 255);
    }
    try {
      if (!route.append(pose, std::span<const std::uint8_t>(line))) return false;
    } catch (const ContractError&) {
      return false;
    }
    before = line;
  }
  return true;
}

}  // namespace panonav
