// Route panoramas in a memory file.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <thread>

#include "panonav/core/error.hpp"
#include "panonav/route/route_panorama.hpp"
#include "panonav/route/snapshot_chain.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"
#include "support/toy_world.hpp"

namespace panonav::testing {
namespace {

// Noise, which nothing can be gained from, at random places.
RoutePanorama random_route(std::size_t lines, std::uint64_t seed, int columns = 360) {
  Random random(seed);
  RoutePanorama route(columns);
  std::vector<std::uint8_t> line(static_cast<std::size_t>(columns));
  while (route.size() < lines) {
    for (auto& value : line) value = static_cast<std::uint8_t>(random.index(256));
    route.append({random.normal(), random.normal(), random.uniform(-3.0, 3.0)},
                 std::span<const std::uint8_t>(line));
  }
  return route;
}

RoutePanorama part(const RoutePanorama& route, std::size_t first, std::size_t end) {
  RoutePanorama result(route.columns());
  for (std::size_t i = first; i < end; ++i) result.append(route.poses()[i], route.line(i));
  return result;
}

using RouteTables = MemoryFileTest;

TEST_F(RouteTables, WhatIsAppendedIsReadBackBitForBit) {
  // Less than a block, one exactly, and several.
  const std::vector<std::size_t> sizes{1, 7, 255, 256, 257, 1300};
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    EXPECT_TRUE(file.route_names().empty());
    EXPECT_FALSE(file.route("route").has_value());
    for (const std::size_t size : sizes) {
      EXPECT_EQ(file.append_route("r" + std::to_string(size), random_route(size, size, 24)), size);
    }
    EXPECT_EQ(file.info().routes, sizes.size());
  }
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_EQ(file.route_names().size(), sizes.size());
  for (const std::size_t size : sizes) {
    EXPECT_EQ(file.route("r" + std::to_string(size)), random_route(size, size, 24)) << size;
  }
  EXPECT_TRUE(file.verify().empty());
  file.remove_route("r257");
  EXPECT_FALSE(file.route("r257").has_value());
  EXPECT_THROW(file.remove_route("r257"), ContractError);
  EXPECT_THROW((void)file.route_bytes("r257"), ContractError);
  EXPECT_EQ(file.route("r256"), random_route(256, 256, 24));
  EXPECT_TRUE(file.verify().empty());
}

// In whatever batches a route is appended, it is the same route, byte by byte of its blocks.
TEST_F(RouteTables, BatchesMakeTheSameRoute) {
  MemoryFile file = MemoryFile::create(path, small_header());
  const RoutePanorama route = random_route(1200, 3, 16);
  file.append_route("whole", route);
  Random random(4);
  int batches = 0;
  for (std::size_t first = 0; first < route.size(); ++batches) {
    const std::size_t end = std::min(route.size(), first + 1 + random.index(150));
    ASSERT_EQ(file.append_route("batches", part(route, first, end)), end - first);
    if (batches % 5 == 0) {
      ASSERT_EQ(file.route("batches"), part(route, 0, end));
    }
    first = end;
  }
  EXPECT_GT(batches, 10);
  EXPECT_EQ(file.route("batches"), route);
  EXPECT_EQ(file.route_bytes("batches"), file.route_bytes("whole"));
}

TEST_F(RouteTables, WhereTheRobotStoodStillNothingIsAdded) {
  MemoryFile file = MemoryFile::create(path, small_header());
  const RoutePanorama route = random_route(5, 5);
  file.append_route("route", route);
  EXPECT_EQ(file.append_route("route", part(route, 4, 5)), 0U);
  EXPECT_EQ(file.route("route"), route);
}

TEST_F(RouteTables, WrongLinesAreRefusedAndChangeNothing) {
  MemoryFile file = MemoryFile::create(path, small_header());
  EXPECT_THROW(file.append_route("route", RoutePanorama(360)), ContractError);
  const RoutePanorama route = random_route(5, 5);
  file.append_route("route", route);
  EXPECT_THROW(file.append_route("", route), ContractError);
  EXPECT_THROW(file.append_route("route", random_route(5, 6, 180)), ContractError);
  EXPECT_EQ(file.route("route"), route);
}

// [Y03 section 2.2]: 3.6 MB a kilometre at a line every 10 cm, measured on the file.
TEST_F(RouteTables, TakesLessThan360BytesALineOfTheFile) {
  { (void)MemoryFile::create(path, small_header()); }
  const auto before = std::filesystem::file_size(path);
  // Round and round in the room; every line is observed again, with the noise of a camera.
  const ToyWorld room = pillared_room(1);
  constexpr int places = 120;
  constexpr int laps = 25;
  constexpr int lines = places * laps;
  std::vector<Pose2> poses;
  std::vector<std::vector<float>> seen;
  for (int i = 0; i < places; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / places;
    poses.push_back({2.0 * std::cos(angle), 1.8 * std::sin(angle), wrap_angle(angle + 1.5)});
    seen.push_back(room.line(poses.back()));
  }
  Random noise(2);
  RoutePanorama route(360);
  for (int i = 0; i < lines; ++i) {
    const auto at = static_cast<std::size_t>(i % places);
    auto line = seen[at];
    for (float& value : line) value += 0.01F * static_cast<float>(noise.normal());
    ASSERT_TRUE(route.append({poses[at].x_m + 0.003 * noise.normal(),
                              poses[at].y_m + 0.003 * noise.normal(), poses[at].heading_rad},
                             std::span<const float>(line)));
  }
  EXPECT_NEAR(route.length_m() / lines, 0.1, 0.02);
  {
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    for (std::size_t first = 0; first < route.size(); first += 100) {
      file.append_route("route", part(route, first, first + 100));
    }
    EXPECT_EQ(file.route("route"), route);
  }
  const auto bytes = std::filesystem::file_size(path) - before;
  EXPECT_LE(bytes, 360U * lines) << static_cast<double>(bytes) / lines << " bytes a line";
  RecordProperty("bytes_of_file_a_line", static_cast<int>(bytes / lines));
}

// After a kill every batch is there whole or not at all, and all those that append returned for.
TEST_F(RouteTables, KilledWriterLeavesWholeBatches) {
  { (void)MemoryFile::create(path, small_header()); }
  constexpr std::size_t batch = 37;
  const RoutePanorama route = random_route(batch * 200, 7, 32);
  std::size_t known = 0;
  int kills_while_appending = 0;
  for (int round = 0; round < 12; ++round) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        MemoryFile file = MemoryFile::open(path, Access::read_write);
        for (std::size_t first = known; first < route.size(); first += batch) {
          file.append_route("route", part(route, first, first + batch));
          const std::size_t done = first + batch;
          if (::write(ends[1], &done, sizeof(done)) != sizeof(done)) std::_Exit(1);
        }
        ::pause();
      } catch (...) {
      }
      std::_Exit(99);
    }
    ASSERT_GT(child, 0);
    ::close(ends[1]);
    std::this_thread::sleep_for(std::chrono::milliseconds(5 + 7 * round));
    ASSERT_EQ(::kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself";
    std::size_t acknowledged = known;
    std::size_t done = 0;
    while (::read(ends[0], &done, sizeof(done)) == sizeof(done)) acknowledged = done;
    ::close(ends[0]);
    kills_while_appending += acknowledged > known && acknowledged < route.size();

    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    ASSERT_TRUE(file.verify().empty());
    const auto stored = file.route("route");
    known = stored ? stored->size() : 0;
    ASSERT_TRUE(known == acknowledged || known == acknowledged + batch);
    if (stored) {
      ASSERT_EQ(*stored, part(route, 0, known));
    }
    if (known == route.size()) break;
  }
  EXPECT_GE(kills_while_appending, 2) << "most kills came before the first append";
}

TEST_F(RouteTables, RowsThatWereTamperedWith) {
  for (const std::string sql :
       {"UPDATE routes SET columns = 32", "UPDATE routes SET columns = 1 << 40",
        "UPDATE routes SET lines = lines - 1", "UPDATE routes SET lines = 1 << 60",
        "UPDATE routes SET checksum = checksum + 1", "UPDATE routes SET name = 'other'",
        "DELETE FROM routes", "DELETE FROM route_blocks WHERE number = 0",
        "DELETE FROM route_blocks WHERE number = 1",
        "UPDATE route_blocks SET number = 5 WHERE number = 1",
        "UPDATE route_blocks SET lines = x'00' WHERE number = 1",
        "UPDATE route_blocks SET lines = substr(lines, 1, 1000)",
        "UPDATE route_blocks SET lines = zeroblob(100)",
        "UPDATE route_blocks SET checksum = 0 WHERE number = 1",
        "UPDATE route_blocks SET route = 'other' WHERE number = 1"}) {
    std::filesystem::remove(path);
    {
      MemoryFile file = MemoryFile::create(path, small_header());
      file.append_route("route", random_route(600, 1, 16));
    }
    run_sql(path, sql);
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    EXPECT_FALSE(file.verify().empty()) << sql;
    const std::string name = sql.find("name = 'other'") == std::string::npos ? "route" : "other";
    EXPECT_THROW((void)file.route(name), FileError) << sql;
    EXPECT_EQ(file.load().size(), 0U);  // the views are not harmed
  }
}

// Bytes of the file damaged at random: one clear error or the very same route.
TEST_F(RouteTables, DamagedBytes) {
  const RoutePanorama route = random_route(1200, 1, 64);
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    file.append_route("route", route);
  }
  const std::string good = bytes_of(path);
  Random random(8);
  int refused = 0;
  for (int round = 0; round < 100; ++round) {
    const auto copy = folder.write("copy.panonav", damaged_bytes(good, random, round));
    try {
      const MemoryFile file = MemoryFile::open(copy, Access::read_only);
      const auto read = file.route("route");
      ASSERT_TRUE(read.has_value()) << round;
      EXPECT_EQ(*read, route);
    } catch (const FileError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      ++refused;
    }
  }
  EXPECT_GT(refused, 30);
}

SnapshotChain random_chain(int nodes, std::uint64_t seed) {
  Random random(seed);
  SnapshotChain chain({.rows = 2, .components = 5, .bits = 5}, ElevationBand{-0.4, 0.5});
  for (int i = 0; i < nodes; ++i) {
    std::vector<float> cosines(10);
    std::vector<float> sines(10);
    for (float& value : cosines) value = static_cast<float>(random.normal());
    for (std::size_t k = 2; k < sines.size(); ++k) sines[k] = static_cast<float>(random.normal());
    const bool is_way_point = i % 3 == 1 && i + 1 < nodes;
    const Point2 place{0.9 * i, random.normal()};
    chain.append(place,
                 is_way_point ? std::nullopt : std::optional(HomingView(2, 5, cosines, sines)));
  }
  chain.set_model({.typical_distance_m = 2.5F, .reach_m = 0.75F});
  return chain;
}

TEST_F(RouteTables, AChainIsReadBackBitForBit) {
  const SnapshotChain chain = random_chain(40, 1);
  const RoutePanorama route = random_route(3, 1);
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    EXPECT_FALSE(file.chain("home").has_value());
    EXPECT_FALSE(file.route_method("home").has_value());
    file.save_chain("home", chain);
    file.append_route("lines", route);
  }
  MemoryFile file = MemoryFile::open(path, Access::read_write);
  EXPECT_EQ(file.chain("home"), chain);
  EXPECT_EQ(file.route_bytes("home"), chain.pack().size());
  EXPECT_EQ(file.route_method("home"), RouteMethod::chain);
  EXPECT_EQ(file.route_method("lines"), RouteMethod::panorama);
  EXPECT_EQ(file.route_names(), (std::vector<std::string>{"home", "lines"}));
  EXPECT_TRUE(file.verify().empty());
  // Neither method takes the route of the other.
  EXPECT_THROW((void)file.route("home"), FileError);
  EXPECT_THROW((void)file.chain("lines"), FileError);
  EXPECT_THROW(file.append_route("home", route), FileError);
  EXPECT_THROW(file.save_chain("lines", chain), ContractError);
  EXPECT_THROW(file.save_chain("home", chain), ContractError);
  EXPECT_THROW(file.save_chain("", chain), ContractError);
  EXPECT_THROW(file.save_chain("empty", SnapshotChain{}), ContractError);
  // A copy, a new name, and undo.
  file.copy_to(folder / "copy.panonav");
  EXPECT_EQ(MemoryFile::open(folder / "copy.panonav", Access::read_only).chain("home"), chain);
  file.rename_route("home", "way");
  EXPECT_EQ(file.chain("way"), chain);
  EXPECT_FALSE(file.chain("home").has_value());
  file.change([&] { file.remove_route("way"); }, "remove a chain");
  EXPECT_FALSE(file.chain("way").has_value());
  file.undo();
  EXPECT_EQ(file.chain("way"), chain);
  EXPECT_TRUE(file.verify().empty());
}

// Packed bytes that `SnapshotChain::pack` does not write, with and without a right checksum.
TEST_F(RouteTables, ChainsThatWereTamperedWith) {
  for (const std::string sql :
       {"UPDATE routes SET columns = 16", "UPDATE routes SET columns = -1",
        "UPDATE routes SET lines = lines - 1", "UPDATE routes SET lines = 1 << 60",
        "UPDATE routes SET lines = 0", "UPDATE routes SET checksum = checksum + 1",
        "UPDATE routes SET name = 'other'", "DELETE FROM routes", "DELETE FROM route_blocks",
        "UPDATE route_blocks SET number = 1", "UPDATE route_blocks SET lines = x'00'",
        "UPDATE route_blocks SET lines = substr(lines, 1, 100)",
        "UPDATE route_blocks SET checksum = 0",
        "INSERT INTO route_blocks SELECT route, 1, lines, checksum FROM route_blocks"}) {
    std::filesystem::remove(path);
    {
      MemoryFile file = MemoryFile::create(path, small_header());
      file.save_chain("route", random_chain(30, 2));
    }
    run_sql(path, sql);
    MemoryFile file = MemoryFile::open(path, Access::read_write);
    EXPECT_FALSE(file.verify().empty()) << sql;
    const std::string name = sql.find("name = 'other'") == std::string::npos ? "route" : "other";
    EXPECT_THROW((void)file.chain(name), FileError) << sql;
    EXPECT_THROW(file.copy_to(folder / "copy.panonav"), FileError) << sql;
    EXPECT_FALSE(std::filesystem::exists(folder / "copy.panonav")) << sql;
  }
}

TEST_F(RouteTables, DamagedBytesOfAChain) {
  const SnapshotChain chain = random_chain(3000, 3);
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    file.save_chain("route", chain);
  }
  const std::string good = bytes_of(path);
  Random random(8);
  int refused = 0;
  for (int round = 0; round < 100; ++round) {
    const auto copy = folder.write("copy.panonav", damaged_bytes(good, random, round));
    try {
      EXPECT_EQ(MemoryFile::open(copy, Access::read_only).chain("route"), chain) << round;
    } catch (const FileError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      ++refused;
    }
  }
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace panonav::testing
