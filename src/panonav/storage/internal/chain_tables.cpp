#include "panonav/storage/internal/chain_tables.hpp"

#include <bit>
#include <set>
#include <span>

#include "panonav/core/error.hpp"
#include "panonav/storage/checksum.hpp"

namespace panonav {

namespace {

void add_band(RecordBytes& record, const std::optional<ElevationBand>& band) {
  if (band) {
    record.add(band->bottom_rad);
    record.add(band->top_rad);
  } else {
    record.add_null();
    record.add_null();
  }
}

// What all views of a chain have in common.
struct ChainRow {
  int rows = 0;
  int components = 0;
  std::optional<ElevationBand> elevations;
  std::int64_t snapshots = 0;

  [[nodiscard]] std::int64_t checksum_of(std::string_view name) const {
    RecordBytes record;
    record.add(name);
    record.add(std::int64_t{rows});
    record.add(std::int64_t{components});
    add_band(record, elevations);
    record.add(snapshots);
    return static_cast<std::int64_t>(checksum(record.bytes()));
  }
};

std::int64_t snapshot_checksum(std::string_view name, std::int64_t number, double travelled_m,
                               const Pose2& step, std::span<const std::uint8_t> coefficients) {
  RecordBytes record;
  record.add(name);
  record.add(number);
  record.add(travelled_m);
  record.add(step.x_m);
  record.add(step.y_m);
  record.add(step.heading_rad);
  return static_cast<std::int64_t>(checksum(coefficients, checksum(record.bytes())));
}

// IEEE 754 singles, little-endian: a_k of all k, then b_k of k >= 1, component-major.
void append_float(std::vector<std::uint8_t>& bytes, float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (int shift = 0; shift < 32; shift += 8) {
    bytes.push_back(static_cast<std::uint8_t>((bits >> shift) & 255U));
  }
}

std::vector<std::uint8_t> coefficient_bytes(const HomingView& view) {
  std::vector<std::uint8_t> bytes;
  for (int k = 0; k < view.components(); ++k) {
    for (const float value : view.cosines(k)) append_float(bytes, value);
  }
  for (int k = 1; k < view.components(); ++k) {
    for (const float value : view.sines(k)) append_float(bytes, value);
  }
  return bytes;
}

HomingView view_from(const ChainRow& chain, std::span<const std::uint8_t> bytes) {
  const auto rows = static_cast<std::size_t>(chain.rows);
  const std::size_t size = rows * static_cast<std::size_t>(chain.components);
  std::vector<float> values(2 * size, 0.0F);
  for (std::size_t i = 0; i < 2 * size - rows; ++i) {
    std::uint32_t bits = 0;
    for (std::size_t byte = 0; byte < 4; ++byte) {
      bits |= std::uint32_t{bytes[4 * i + byte]} << (8 * byte);
    }
    // b_0 is 0 and not stored.
    values[i < size ? i : i + rows] = std::bit_cast<float>(bits);
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(size);
  return {chain.rows, chain.components, std::vector<float>(values.begin(), middle),
          std::vector<float>(middle, values.end()), chain.elevations};
}

[[noreturn]] void fail_chain(const Database& database, std::string_view name,
                             const std::string& what) {
  database.fail_damaged("chain " + std::string(name) + ": " + what);
}

std::optional<ChainRow> read_row(Database& database, std::string_view name) {
  Statement row(database,
                "SELECT rows, components, elevation_bottom_rad, elevation_top_rad, snapshots, "
                "checksum FROM chains WHERE name = ?");
  if (!row.bind(1, name).step()) return std::nullopt;
  constexpr std::int64_t most = 1 << 20;
  const std::int64_t rows = row.integer(0);
  const std::int64_t components = row.integer(1);
  if (rows < 1 || rows > most || components < 2 || components > most) {
    fail_chain(database, name, "rows or components are out of range");
  }
  ChainRow chain{static_cast<int>(rows), static_cast<int>(components), std::nullopt,
                 row.integer(4)};
  if (!row.is_null(2)) chain.elevations = ElevationBand{row.real(2), row.real(3)};
  if (row.is_null(2) != row.is_null(3) || row.integer(5) != chain.checksum_of(name)) {
    fail_chain(database, name, "does not match its checksum");
  }
  return chain;
}

}  // namespace

void write_chain(Database& database, std::string_view name, const SnapshotChain& chain) {
  if (name.empty()) throw ContractError("name of a chain", "empty", "at least one character");
  validate(chain);
  static_cast<void>(erase_chain(database, name));
  const HomingView& first = chain.snapshots.front().view;
  const ChainRow common{first.rows(), first.components(), first.elevations(),
                        static_cast<std::int64_t>(chain.snapshots.size())};
  Statement head(database,
                 "INSERT INTO chains(name, rows, components, elevation_bottom_rad, "
                 "elevation_top_rad, snapshots, checksum) VALUES(?, ?, ?, ?, ?, ?, ?)");
  head.bind(1, name).bind(2, std::int64_t{common.rows}).bind(3, std::int64_t{common.components});
  if (common.elevations) {
    head.bind(4, common.elevations->bottom_rad).bind(5, common.elevations->top_rad);
  } else {
    head.bind_null(4).bind_null(5);
  }
  head.bind(6, common.snapshots).bind(7, common.checksum_of(name));
  if (head.run() != 0) fail_chain(database, name, "cannot be replaced");

  Statement insert(database,
                   "INSERT INTO chain_snapshots(chain, number, travelled_m, x_m, y_m, "
                   "heading_rad, coefficients, checksum) VALUES(?, ?, ?, ?, ?, ?, ?, ?)");
  for (std::size_t i = 0; i < chain.snapshots.size(); ++i) {
    const Snapshot& snapshot = chain.snapshots[i];
    const auto number = static_cast<std::int64_t>(i);
    const Pose2& step = snapshot.previous_from_this;
    const auto bytes = coefficient_bytes(snapshot.view);
    insert.bind(1, name)
        .bind(2, number)
        .bind(3, snapshot.travelled_m)
        .bind(4, step.x_m)
        .bind(5, step.y_m)
        .bind(6, step.heading_rad)
        .bind(7, std::span<const std::uint8_t>(bytes))
        .bind(8, snapshot_checksum(name, number, snapshot.travelled_m, step, bytes));
    if (insert.run() != 0) fail_chain(database, name, "a snapshot of it is there without it");
  }
}

std::optional<SnapshotChain> read_chain(Database& database, std::string_view name) {
  const auto common = read_row(database, name);
  if (!common) {
    Statement left(database, "SELECT 1 FROM chain_snapshots WHERE chain = ?");
    if (left.bind(1, name).step()) fail_chain(database, name, "snapshots without the chain");
    return std::nullopt;
  }
  const std::size_t bytes_wanted = 4 * static_cast<std::size_t>(common->rows) *
                                   (2 * static_cast<std::size_t>(common->components) - 1);
  SnapshotChain chain;
  Statement rows(database,
                 "SELECT number, travelled_m, x_m, y_m, heading_rad, coefficients, checksum FROM "
                 "chain_snapshots WHERE chain = ? ORDER BY number");
  rows.bind(1, name);
  try {
    while (rows.step()) {
      const auto number = static_cast<std::int64_t>(chain.snapshots.size());
      const double travelled_m = rows.real(1);
      const Pose2 step{rows.real(2), rows.real(3), rows.real(4)};
      const auto bytes = rows.blob(5);
      if (rows.integer(0) != number || bytes.size() != bytes_wanted ||
          rows.integer(6) != snapshot_checksum(name, number, travelled_m, step, bytes)) {
        fail_chain(database, name,
                   "snapshot " + std::to_string(number) + " does not match its checksum");
      }
      chain.snapshots.push_back({view_from(*common, bytes), travelled_m, step});
    }
    if (static_cast<std::int64_t>(chain.snapshots.size()) != common->snapshots) {
      fail_chain(database, name,
                 "it holds " + std::to_string(chain.snapshots.size()) + " of " +
                     std::to_string(common->snapshots) + " snapshots");
    }
    validate(chain);
  } catch (const ContractError& error) {
    fail_chain(database, name, error.what());
  }
  return chain;
}

bool erase_chain(Database& database, std::string_view name) {
  const bool there = read_row(database, name).has_value();
  for (const char* sql :
       {"DELETE FROM chain_snapshots WHERE chain = ?", "DELETE FROM chains WHERE name = ?"}) {
    Statement erase(database, sql);
    static_cast<void>(erase.bind(1, name).run());
  }
  return there;
}

std::vector<std::string> chain_names(Database& database) {
  std::vector<std::string> names;
  Statement rows(database, "SELECT name FROM chains ORDER BY name");
  while (rows.step()) names.emplace_back(rows.text(0));
  return names;
}

void verify_chains(Database& database,
                   const std::function<void(const std::function<void()>&)>& check) {
  std::set<std::string> names;
  check([&] {
    for (auto& name : chain_names(database)) names.insert(std::move(name));
  });
  for (const auto& name : names) {
    check([&] { static_cast<void>(read_chain(database, name)); });
  }
  check([&] {
    Statement rows(database, "SELECT DISTINCT chain FROM chain_snapshots ORDER BY chain");
    while (rows.step()) {
      const std::string name(rows.text(0));
      if (names.contains(name)) continue;
      check([&] { fail_chain(database, name, "snapshots without the chain"); });
    }
  });
}

}  // namespace panonav
