#include "panonav/route/snapshot_chain.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr double leg_step_m = 0.01;
constexpr std::uint32_t max_distance_code = 2047;  // 11 bits
constexpr std::uint32_t direction_codes = 4096;    // 12 bits
constexpr double direction_step_rad = 2.0 * std::numbers::pi / direction_codes;
constexpr std::size_t leg_bytes = 3;
// Magic and version, shape, elevations, model.
constexpr std::uint32_t chain_magic = 0x31434E50;  // "PNC1"
constexpr std::size_t chain_header_bytes = 32;

/// A straight step between two nodes, as its 23 bits say.
struct Leg {
  std::uint32_t distance = 0;
  std::uint32_t direction = 0;

  [[nodiscard]] Point2 step() const {
    const double length_m = distance * leg_step_m;
    const double direction_rad = direction * direction_step_rad;
    return {length_m * std::cos(direction_rad), length_m * std::sin(direction_rad)};
  }
};

Leg make_leg(Point2 from, Point2 to) {
  const double length_m = distance(from, to);
  require(std::isfinite(length_m) && length_m <= SnapshotChain::max_leg_m, "length of a leg",
          length_m, "0 .. " + to_text(SnapshotChain::max_leg_m));
  const double turns = std::atan2(to.y_m - from.y_m, to.x_m - from.x_m) / direction_step_rad;
  const auto direction = static_cast<std::int64_t>(std::llround(turns)) + direction_codes;
  return {
      std::min(static_cast<std::uint32_t>(std::llround(length_m / leg_step_m)), max_distance_code),
      static_cast<std::uint32_t>(direction % direction_codes)};
}

void write_number(std::vector<std::uint8_t>& bytes, std::uint32_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i) & 0xFFU));
  }
}

void write_float(std::vector<std::uint8_t>& bytes, double value) {
  write_number(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(value)), 4);
}

/// Reads numbers from the front of bytes.
class ChainBytes {
 public:
  explicit ChainBytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool empty() const noexcept { return bytes_.empty(); }
  std::span<const std::uint8_t> take(std::size_t count) {
    require(count <= bytes_.size(), "bytes left in a chain", static_cast<double>(bytes_.size()),
            ">= " + to_text(static_cast<double>(count)));
    const auto consumed = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return consumed;
  }
  std::uint32_t number(std::size_t count) {
    const auto consumed = take(count);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      value |= static_cast<std::uint32_t>(consumed[i]) << (8 * i);
    }
    return value;
  }
  float real() { return std::bit_cast<float>(number(4)); }

 private:
  std::span<const std::uint8_t> bytes_;
};

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

std::optional<ElevationBand> read_elevations(ChainBytes& bytes) {
  const float bottom = bytes.real();
  const float top = bytes.real();
  if (bottom == 0.0F && top == 0.0F) return std::nullopt;
  const ElevationBand band{static_cast<double>(bottom), static_cast<double>(top)};
  constexpr double right_angle = std::numbers::pi / 2.0 + 1e-6;  // as rounded to a float
  require(band.bottom_rad >= -right_angle && band.bottom_rad < band.top_rad &&
              band.top_rad <= right_angle,
          "highest elevation of a chain", band.top_rad, "above the lowest, up to pi / 2");
  return band;
}

// Returns the band as the packed form says it, in floats.
std::optional<ElevationBand> round_band(const std::optional<ElevationBand>& band) {
  if (!band) return std::nullopt;
  std::vector<std::uint8_t> packed;
  write_float(packed, band->bottom_rad);
  write_float(packed, band->top_rad);
  ChainBytes bytes(packed);
  return read_elevations(bytes);
}

}  // namespace

double ChainOdometry::position_error_m(double travelled_m) const noexcept {
  const double sideways_m = 0.5 * heading_error_rad_per_m * travelled_m * travelled_m;
  const double along_m = travelled_m * std::hypot(distance_error, drift);
  return std::numbers::sqrt2 * std::hypot(along_m, sideways_m);
}

double ChainOdometry::heading_error_rad(double travelled_m) const noexcept {
  return std::numbers::sqrt2 * heading_error_rad_per_m * travelled_m;
}

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
                             const std::optional<ElevationBand>& elevations)
    : shape_(shape), elevations_(round_band(elevations)) {
  validate(shape_);
}

void SnapshotChain::append(Point2 position, const std::optional<HomingView>& view) {
  ChainNode node;
  if (view) node.snapshot = pack_snapshot(*view, shape_);
  if (nodes_.empty()) {
    require(node.has_snapshot(), "snapshots of the first node of a chain", 0.0, "1");
  } else {
    const Point2 from = nodes_.back().position;
    const Point2 step = make_leg(from, position).step();
    node.position = {from.x_m + step.x_m, from.y_m + step.y_m};
  }
  nodes_.push_back(std::move(node));
}

void SnapshotChain::set_model(const ChainModel& model) {
  check_model(model);
  model_ = model;
}

HomingView SnapshotChain::view(std::size_t node) const {
  require(node < nodes_.size() && nodes_[node].has_snapshot(), "node with a snapshot",
          static_cast<double>(node), "a node of the chain with a snapshot");
  return unpack_snapshot(nodes_[node].snapshot, shape_, elevations_);
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
  write_number(bytes, chain_magic, 4);
  write_number(bytes, static_cast<std::uint32_t>(shape_.rows), 1);
  write_number(bytes, static_cast<std::uint32_t>(shape_.components), 1);
  write_number(bytes, static_cast<std::uint32_t>(shape_.bits), 2);
  write_float(bytes, elevations_ ? elevations_->bottom_rad : 0.0);
  write_float(bytes, elevations_ ? elevations_->top_rad : 0.0);
  for (const float value : {model_.typical_distance_m, model_.reach_m, model_.arrived_difference,
                            model_.homing_confidence}) {
    write_float(bytes, static_cast<double>(value));
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (i > 0) {
      const Leg leg = make_leg(nodes_[i - 1].position, nodes_[i].position);
      const std::uint32_t is_snapshot = nodes_[i].has_snapshot() ? 1U : 0U;
      write_number(bytes, is_snapshot | leg.distance << 1U | leg.direction << 12U, leg_bytes);
    }
    bytes.insert(bytes.end(), nodes_[i].snapshot.begin(), nodes_[i].snapshot.end());
  }
  return bytes;
}

SnapshotChain SnapshotChain::unpack(std::span<const std::uint8_t> bytes) {
  require(bytes.size() > chain_header_bytes, "bytes of a chain", static_cast<double>(bytes.size()),
          "> " + to_text(static_cast<double>(chain_header_bytes)));
  ChainBytes rest(bytes);
  const std::uint32_t magic = rest.number(4);
  require(magic == chain_magic, "magic number of a chain", magic, to_text(chain_magic));
  SnapshotShape shape;
  shape.rows = static_cast<int>(rest.number(1));
  shape.components = static_cast<int>(rest.number(1));
  shape.bits = static_cast<int>(rest.number(2));
  SnapshotChain chain;
  try {
    chain = SnapshotChain(shape, read_elevations(rest));
  } catch (const OptionError& error) {
    throw ContractError(std::string("snapshots of a chain: ") + error.what());
  }
  ChainModel model;
  model.typical_distance_m = rest.real();
  model.reach_m = rest.real();
  model.arrived_difference = rest.real();
  model.homing_confidence = rest.real();
  chain.set_model(model);
  while (!rest.empty()) {
    ChainNode node;
    bool has_snapshot = true;
    if (!chain.nodes_.empty()) {
      const std::uint32_t packed = rest.number(leg_bytes);
      has_snapshot = (packed & 1U) != 0;
      require((packed >> 1U & max_distance_code) > 0 || packed >> 12U == 0,
              "direction of a leg without length", packed >> 12U, "0");
      const Point2 from = chain.nodes_.back().position;
      const Point2 step = Leg{packed >> 1U & max_distance_code, packed >> 12U}.step();
      node.position = {from.x_m + step.x_m, from.y_m + step.y_m};
    }
    if (has_snapshot) {
      const auto snapshot = rest.take(shape.bytes());
      (void)snapshot_steps(snapshot, shape);  // refuses bytes that are not written
      node.snapshot.assign(snapshot.begin(), snapshot.end());
    }
    chain.nodes_.push_back(std::move(node));
  }
  require(chain.nodes_.back().has_snapshot(), "snapshots of the last node of a chain", 0.0, "1");
  return chain;
}

}  // namespace panonav
