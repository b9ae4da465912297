#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {

inline PackedSignature random_packed(Random& random, SignatureShape shape) {
  PackedSignature packed{shape, std::vector<std::uint8_t>(shape.size()),
                         std::vector<std::uint8_t>(shape.size())};
  for (auto* component : {&packed.magnitudes, &packed.phases}) {
    for (auto& value : *component) value = static_cast<std::uint8_t>(random.index(256));
  }
  return packed;
}

/// A view with and without each of the optional components, by its number.
inline NewView random_view(Random& random, SignatureShape shape, int number) {
  NewView view;
  view.info.name = "view_" + std::to_string(number) + ".png";
  if (number % 3 != 0) {
    view.info.pose = ReferencePose{random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), {}};
    if (number % 3 == 1) view.info.pose->heading_rad = random.uniform(-3.0, 3.0);
  }
  if (number % 2 == 0) view.info.stamp_s = 0.1 * number;
  view.signature = random_packed(random, shape);
  if (number % 4 == 0) view.thumbnail = {1, 2, 3, static_cast<std::uint8_t>(number % 256)};
  return view;
}

/// The view of that number, the same in every process.
inline NewView numbered_view(SignatureShape shape, int number) {
  Random random(99, static_cast<std::uint64_t>(number));
  return random_view(random, shape, number);
}

inline MemoryHeader small_header() {
  MemoryHeader header;
  header.shape = {7, 5};
  header.full_scale = 0.5F;
  header.panorama_columns = 90;
  header.preprocessing.normalise_gain = true;
  header.created_s = 1700000000.5;
  return header;
}

inline MemoryHeader mirror_header() {
  MemoryHeader header = small_header();
  header.elevations = ElevationBand{-0.5, 0.25};
  header.source.kind = PictureKind::mirror;
  header.source.layout.kept_elevations = ElevationBand{-0.5, 0.25};
  Camera camera;
  camera.model = PolynomialModel{{-120.0, 0.0, 0.002, 1e-7}};
  camera.image_size = {64, 48};
  camera.centre = {32.25, 24.5};
  camera.rim_radius_px = 22.0;
  camera.inner_radius_px = 5.0;
  camera.direction = ColumnDirection::clockwise;
  camera.forward_angle_rad = 0.3;
  header.source.camera = camera;
  Image mask(64, 48);
  for (int u = 0; u < 64; ++u) mask.at(u, 3 * u % 48) = 255;
  header.source.mask = mask;
  return header;
}

/// A folder and the path of a memory file in it for each test; where PANONAV_TEST_SERVER is the
/// address of a PostgreSQL server, a new memory on that.
class MemoryFileTest : public InTemporaryFolder {
 protected:
  [[nodiscard]] std::filesystem::path memory(const std::string& name) const {
    const char* server = std::getenv("PANONAV_TEST_SERVER");
    if (server == nullptr) return folder / name;
    return std::string(server) + "&memory=" + folder.path().filename().string() + name;
  }
  std::filesystem::path path = memory("m.panonav");
};

/// Changes a file behind the library's back.
inline void run_sql(const std::filesystem::path& path, const std::string& sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(database);
  sqlite3_close(database);
}

/// The bytes of a file after an accident: by `trial` one bit, four bytes, or a stretch of zeros.
inline std::string damaged_bytes(std::string bytes, Random& random, int trial) {
  const std::size_t at = random.index(bytes.size());
  if (trial % 3 == 0) {
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.index(8)));
  } else if (trial % 3 == 1) {
    for (int i = 0; i < 4; ++i) {
      bytes[random.index(bytes.size())] = static_cast<char>(random.index(256));
    }
  } else {
    const std::size_t count = std::min<std::size_t>(512, bytes.size() - at);
    std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, '\0');
  }
  return bytes;
}

/// True if two memories have the same content.
inline bool same_content(const VisualMemory& a, const VisualMemory& b) {
  if (a.shape() != b.shape() || a.full_scale() != b.full_scale() ||
      a.elevations() != b.elevations() || a.size() != b.size() ||
      a.links().size() != b.links().size()) {
    return false;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const ViewId view = a.views()[i];
    if (b.views()[i] != view || a.info(view) != b.info(view) || a.packed(view) != b.packed(view)) {
      return false;
    }
  }
  for (std::size_t i = 0; i < a.links().size(); ++i) {
    if (!(a.links()[i] == b.links()[i])) return false;
  }
  return true;
}

}  // namespace panonav::testing
