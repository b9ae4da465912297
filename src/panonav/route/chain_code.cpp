#include "panonav/route/chain_code.hpp"

#include <bit>
#include <numbers>

#include "panonav/core/portable_math.hpp"

namespace panonav {

namespace {

std::uint32_t read_number(std::span<const std::uint8_t> bytes) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8U | bytes[i];
  return value;
}

// Reads the upper half of a float.
float read_half(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept {
  return std::bit_cast<float>(read_number(bytes.subspan(offset, 2)) << 16U);
}

float read_elevation(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept {
  return ChainHeader::elevation_rad(
      static_cast<std::int16_t>(read_number(bytes.subspan(offset, 2))));
}

}  // namespace

double ChainOdometry::position_error_m(double travelled_m) const noexcept {
  const double sideways_m = 0.5 * heading_error_rad_per_m * travelled_m * travelled_m;
  const double along_m = travelled_m * portable::hypot(distance_error, drift);
  return std::numbers::sqrt2 * portable::hypot(along_m, sideways_m);
}

double ChainOdometry::heading_error_rad(double travelled_m) const noexcept {
  return std::numbers::sqrt2 * heading_error_rad_per_m * travelled_m;
}

Point2 ChainLeg::step() const noexcept {
  constexpr double distance_step_m = 0.01;
  constexpr double direction_step_rad = 2.0 * std::numbers::pi / directions;
  const double length_m = distance * distance_step_m;
  const auto [cosine, sine] = portable::cosine_sine(direction * direction_step_rad);
  return {length_m * cosine, length_m * sine};
}

ChainHeader decode_header(std::span<const std::uint8_t> bytes) noexcept {
  ChainHeader header;
  header.magic_found = read_number(bytes.first(2));
  header.shape = {bytes[2], bytes[3], bytes[4]};
  header.bottom_rad = read_elevation(bytes, 5);
  header.top_rad = read_elevation(bytes, 7);
  header.model = {read_half(bytes, 9), read_half(bytes, 11), read_half(bytes, 13),
                  read_half(bytes, 15)};
  header.odometry = {static_cast<double>(read_half(bytes, 17)),
                     static_cast<double>(read_half(bytes, 19)),
                     static_cast<double>(read_half(bytes, 21))};
  return header;
}

std::optional<ChainStop> ChainCursor::next() noexcept {
  auto kind = ChainNodeKind::fine_snapshot;  // that of the first node
  if (!is_first_) {
    if (rest_.size() < ChainLeg::bytes) return std::nullopt;
    const std::uint32_t packed = read_number(rest_.first(ChainLeg::bytes));
    if ((packed & 3U) > static_cast<std::uint32_t>(ChainNodeKind::fine_snapshot)) {
      return std::nullopt;
    }
    kind = static_cast<ChainNodeKind>(packed & 3U);
    leg_ = {packed >> 2U & ChainLeg::max_distance, packed >> 13U};
    const Point2 step = leg_.step();
    position_ = {position_.x_m + step.x_m, position_.y_m + step.y_m};
    rest_ = rest_.subspan(ChainLeg::bytes);
  }
  is_first_ = false;
  ChainStop stop{position_};
  if (kind == ChainNodeKind::way_point) return stop;
  stop.is_fine = kind == ChainNodeKind::fine_snapshot;
  const std::size_t snapshot_bytes = choose_shape(shape_, stop.is_fine).bytes();
  if (rest_.size() < snapshot_bytes) return std::nullopt;
  stop.snapshot = rest_.data();
  rest_ = rest_.subspan(snapshot_bytes);
  return stop;
}

std::optional<ChainRoute> read_chain(std::span<const std::uint8_t> bytes,
                                     std::span<ChainStop> stops) noexcept {
  if (bytes.size() <= ChainHeader::bytes) return std::nullopt;
  const ChainHeader header = decode_header(bytes);
  if (header.magic_found != ChainHeader::magic || !header.shape.is_valid()) return std::nullopt;
  ChainCursor cursor(bytes, header.shape);
  std::size_t count = 0;
  while (cursor.rest() > 0) {
    const std::optional<ChainStop> stop = cursor.next();
    if (!stop || count == stops.size()) return std::nullopt;
    stops[count++] = *stop;
  }
  if (count == 0 || !stops[count - 1].has_snapshot()) return std::nullopt;
  return ChainRoute{header, stops.first(count)};
}

}  // namespace panonav
