#include "panonav/route/snapshot_chain.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

ChainLeg make_leg(Point2 from, Point2 to) {
  constexpr double direction_step_rad = 2.0 * std::numbers::pi / ChainLeg::directions;
  const double length_m = distance(from, to);
  require(std::isfinite(length_m) && length_m <= SnapshotChain::max_leg_m, "length of a leg",
          length_m, "0 .. " + to_text(SnapshotChain::max_leg_m));
  const double turns = std::atan2(to.y_m - from.y_m, to.x_m - from.x_m) / direction_step_rad;
  const auto direction = static_cast<std::int64_t>(std::llround(turns)) + ChainLeg::directions;
  return {
      std::min(static_cast<std::uint32_t>(std::llround(100.0 * length_m)), ChainLeg::max_distance),
      static_cast<std::uint32_t>(direction % ChainLeg::directions)};
}

std::uint32_t kind_bits(const ChainNode& node) {
  auto kind = ChainNodeKind::way_point;
  if (node.has_snapshot()) {
    kind = node.is_fine ? ChainNodeKind::fine_snapshot : ChainNodeKind::snapshot;
  }
  return static_cast<std::uint32_t>(kind);
}

void write_number(std::vector<std::uint8_t>& bytes, std::uint32_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i) & 0xFFU));
  }
}

// Returns the bits of the upper half of the nearest float that has no lower half.
std::uint32_t half_bits(double value) {
  return (std::bit_cast<std::uint32_t>(static_cast<float>(value)) + 0x8000U) >> 16U;
}

float round_to_half(double value) {
  return std::bit_cast<float>(half_bits(value) << 16U);
}

std::uint32_t elevation_bits(double elevation_rad) {
  return static_cast<std::uint32_t>(std::llround(elevation_rad / ChainHeader::elevation_step_rad)) &
         0xFFFFU;
}

void check_model(const ChainModel& model) {
  const auto check = [](const char* field, float value, float low, float high) {
    require(value >= low && value <= high, field, static_cast<double>(value),
            to_text(static_cast<double>(low)) + " .. " + to_text(static_cast<double>(high)));
  };
  check("typical distance of a chain", model.typical_distance_m, 1e-3F, 1e4F);
  check("reach of a chain", model.reach_m, 1e-3F, 1e4F);
  check("arrived difference of a chain", model.arrived_difference, 0.0F, 2.0F);
  check("homing confidence of a chain", model.homing_confidence, -1.0F, 1.0F);
}

// Returns the band that a header says.
std::optional<ElevationBand> make_band(float bottom_rad, float top_rad) {
  if (bottom_rad == 0.0F && top_rad == 0.0F) return std::nullopt;
  const ElevationBand band{static_cast<double>(bottom_rad), static_cast<double>(top_rad)};
  constexpr double right_angle = std::numbers::pi / 2.0 + 1e-6;  // as rounded to a float
  require(band.bottom_rad >= -right_angle && band.bottom_rad < band.top_rad &&
              band.top_rad <= right_angle,
          "highest elevation of a chain", band.top_rad, "above the lowest, up to pi / 2");
  return band;
}

// Returns the band as the packed form says it.
std::optional<ElevationBand> round_band(const std::optional<ElevationBand>& band) {
  if (!band) return std::nullopt;
  const auto round = [](double elevation_rad) {
    return ChainHeader::elevation_rad(static_cast<std::int16_t>(elevation_bits(elevation_rad)));
  };
  return make_band(round(band->bottom_rad), round(band->top_rad));
}

ChainOdometry round_odometry(const ChainOdometry& odometry) {
  validate(odometry);
  const auto round = [](double value) { return static_cast<double>(round_to_half(value)); };
  return {round(odometry.distance_error), round(odometry.heading_error_rad_per_m),
          round(odometry.drift)};
}

}  // namespace

void visit_options(ChainOdometry& odometry, OptionVisitor& visitor) {
  using T = ChainOdometry;
  constexpr OptionTable table{
      option<&T::distance_error>("largest relative error of distances by odometry", 0, 1),
      option<&T::heading_error_rad_per_m>("largest error of the heading by odometry in radians per "
                                          "metre",
                                          0, 10),
      option<&T::drift>("largest drift that odometry does not measure, as a part of the distance",
                        0, 1),
  };
  table.visit(odometry, visitor);
}

SnapshotChain::SnapshotChain(const SnapshotShape& shape,
                             const std::optional<ElevationBand>& elevations,
                             const ChainOdometry& odometry)
    : shape_(shape), elevations_(round_band(elevations)), odometry_(round_odometry(odometry)) {
  validate(shape_);
  set_model({});
}

void SnapshotChain::append(Point2 position, const std::optional<HomingView>& view) {
  ChainNode node{.is_fine = view && nodes_.empty()};
  if (view) node.snapshot = pack_snapshot(*view, choose_shape(shape_, node.is_fine));
  if (nodes_.empty()) {
    require(node.has_snapshot(), "snapshots of the first node of a chain", 0.0, "1");
  } else {
    const Point2 from = nodes_.back().position;
    const Point2 step = make_leg(from, position).step();
    node.position = {from.x_m + step.x_m, from.y_m + step.y_m};
  }
  nodes_.push_back(std::move(node));
}

void SnapshotChain::refine_last(const HomingView& view) {
  require(!nodes_.empty() && nodes_.back().has_snapshot(), "snapshots of the last node", 0.0, "1");
  nodes_.back().snapshot = pack_snapshot(view, make_fine(shape_));
  nodes_.back().is_fine = true;
}

void SnapshotChain::set_model(const ChainModel& model) {
  check_model(model);
  const auto round = [](float value) { return round_to_half(static_cast<double>(value)); };
  model_ = {round(model.typical_distance_m), round(model.reach_m), round(model.arrived_difference),
            round(model.homing_confidence)};
}

ChainHeader SnapshotChain::header() const noexcept {
  ChainHeader header{
      .magic_found = ChainHeader::magic, .shape = shape_, .model = model_, .odometry = odometry_};
  if (elevations_) {
    header.bottom_rad = static_cast<float>(elevations_->bottom_rad);
    header.top_rad = static_cast<float>(elevations_->top_rad);
  }
  return header;
}

HomingView SnapshotChain::view(std::size_t node) const {
  require(node < nodes_.size() && nodes_[node].has_snapshot(), "node with a snapshot",
          static_cast<double>(node), "a node of the chain with a snapshot");
  return unpack_snapshot(nodes_[node].snapshot, choose_shape(shape_, nodes_[node].is_fine),
                         elevations_);
}

std::size_t SnapshotChain::snapshots() const noexcept {
  return static_cast<std::size_t>(
      std::count_if(nodes_.begin(), nodes_.end(), [](const auto& n) { return n.has_snapshot(); }));
}

double SnapshotChain::length_m() const noexcept {
  double sum_m = 0.0;
  for (std::size_t i = 1; i < nodes_.size(); ++i) {
    sum_m += distance(nodes_[i - 1].position, nodes_[i].position);
  }
  return sum_m;
}

double SnapshotChain::bytes_per_100_m() const {
  const double length = length_m();
  return length > 0.0 ? 100.0 * static_cast<double>(pack().size()) / length : 0.0;
}

std::vector<std::uint8_t> SnapshotChain::pack() const {
  require(!nodes_.empty() && nodes_.back().has_snapshot(), "snapshots of the last node of a chain",
          0.0, "1");
  std::vector<std::uint8_t> bytes;
  write_number(bytes, ChainHeader::magic, 2);
  for (const int value : {shape_.rows, shape_.components, shape_.bits}) {
    write_number(bytes, static_cast<std::uint32_t>(value), 1);
  }
  write_number(bytes, elevation_bits(elevations_ ? elevations_->bottom_rad : 0.0), 2);
  write_number(bytes, elevation_bits(elevations_ ? elevations_->top_rad : 0.0), 2);
  for (const float value : {model_.typical_distance_m, model_.reach_m, model_.arrived_difference,
                            model_.homing_confidence}) {
    write_number(bytes, half_bits(static_cast<double>(value)), 2);
  }
  for (const double value :
       {odometry_.distance_error, odometry_.heading_error_rad_per_m, odometry_.drift}) {
    write_number(bytes, half_bits(value), 2);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (i > 0) {
      const ChainLeg leg = make_leg(nodes_[i - 1].position, nodes_[i].position);
      write_number(bytes, kind_bits(nodes_[i]) | leg.distance << 2U | leg.direction << 13U,
                   ChainLeg::bytes);
    }
    bytes.insert(bytes.end(), nodes_[i].snapshot.begin(), nodes_[i].snapshot.end());
  }
  return bytes;
}

SnapshotChain SnapshotChain::unpack(std::span<const std::uint8_t> bytes) {
  require(bytes.size() > ChainHeader::bytes, "bytes of a chain", static_cast<double>(bytes.size()),
          "> " + to_text(static_cast<double>(ChainHeader::bytes)));
  const ChainHeader header = decode_header(bytes);
  require(header.magic_found == ChainHeader::magic, "magic number of a chain", header.magic_found,
          to_text(ChainHeader::magic));
  SnapshotChain chain;
  try {
    chain =
        SnapshotChain(header.shape, make_band(header.bottom_rad, header.top_rad), header.odometry);
  } catch (const OptionError& error) {
    throw ContractError(std::string("header of a chain: ") + error.what());
  }
  chain.set_model(header.model);
  ChainCursor cursor(bytes, header.shape);
  while (cursor.rest() > 0) {
    const std::size_t rest = cursor.rest();
    const std::optional<ChainStop> stop = cursor.next();
    require(stop.has_value(), "bytes left in a chain", static_cast<double>(rest),
            "those of a leg of a known kind, and of a snapshot at its end");
    require(cursor.leg().distance > 0 || cursor.leg().direction == 0,
            "direction of a leg without length", cursor.leg().direction, "0");
    ChainNode node{.position = stop->position, .is_fine = stop->is_fine};
    if (stop->has_snapshot()) {
      const SnapshotShape shape = choose_shape(header.shape, stop->is_fine);
      const std::span snapshot(stop->snapshot, shape.bytes());
      (void)snapshot_steps(snapshot, shape);  // refuses bytes that are not written
      node.snapshot.assign(snapshot.begin(), snapshot.end());
    }
    chain.nodes_.push_back(std::move(node));
  }
  require(chain.nodes_.back().has_snapshot(), "snapshots of the last node of a chain", 0.0, "1");
  return chain;
}

}  // namespace panonav
