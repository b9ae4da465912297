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

float read_float(std::span<const std::uint8_t> bytes, std::size_t offset) noexcept {
  return std::bit_cast<float>(read_number(bytes.subspan(offset, 4)));
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
  header.magic_found = read_number(bytes.first(4));
  header.shape = {bytes[4], bytes[5], static_cast<int>(read_number(bytes.subspan(6, 2)))};
  header.bottom_rad = read_float(bytes, 8);
  header.top_rad = read_float(bytes, 12);
  header.model = {read_float(bytes, 16), read_float(bytes, 20), read_float(bytes, 24),
                  read_float(bytes, 28)};
  return header;
}

std::optional<ChainStop> ChainCursor::next() noexcept {
  bool has_snapshot = true;
  if (!is_first_) {
    if (rest_.size() < ChainLeg::bytes) return std::nullopt;
    const std::uint32_t packed = read_number(rest_.first(ChainLeg::bytes));
    has_snapshot = (packed & 1U) != 0;
    leg_ = {packed >> 1U & ChainLeg::max_distance, packed >> 12U};
    const Point2 step = leg_.step();
    position_ = {position_.x_m + step.x_m, position_.y_m + step.y_m};
    rest_ = rest_.subspan(ChainLeg::bytes);
  }
  is_first_ = false;
  ChainStop stop{position_};
  if (!has_snapshot) return stop;
  if (rest_.size() < snapshot_bytes_) return std::nullopt;
  stop.snapshot = rest_.data();
  rest_ = rest_.subspan(snapshot_bytes_);
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
