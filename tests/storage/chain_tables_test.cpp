// Chains of snapshots in a memory file.
#include <gtest/gtest.h>

#include <limits>

#include "panonav/core/error.hpp"
#include "panonav/storage/memory_file.hpp"
#include "support/memory_samples.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

SnapshotChain random_chain(std::uint64_t seed, int snapshots, int rows = 3, int components = 6,
                           std::optional<ElevationBand> band = std::nullopt) {
  Random random(seed);
  SnapshotChain chain;
  double travelled_m = 0.0;
  for (int i = 0; i < snapshots; ++i) {
    const auto size = static_cast<std::size_t>(rows) * static_cast<std::size_t>(components);
    std::vector<float> a(size);
    std::vector<float> b(size);
    for (auto& value : a) value = static_cast<float>(random.normal());
    for (auto& value : b) value = static_cast<float>(random.normal());
    std::fill_n(b.begin(), rows, 0.0F);
    chain.snapshots.push_back(
        {HomingView(rows, components, a, b, band), travelled_m,
         i == 0 ? Pose2{} : Pose2{random.normal(), random.normal(), random.uniform(-3.0, 3.0)}});
    travelled_m += random.uniform(0.1, 2.0);
  }
  return chain;
}

using ChainTables = MemoryFileTest;

TEST_F(ChainTables, WhatIsSavedIsReadBackBitForBit) {
  const auto out = random_chain(1, 12);
  const auto back = random_chain(2, 1, 20, 16, ElevationBand{-0.5, 0.25});
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    EXPECT_TRUE(file.chain_names().empty());
    EXPECT_FALSE(file.chain("way out").has_value());
    file.save_chain("way out", out);
    file.save_chain("back", back);
  }
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  EXPECT_EQ(file.chain_names(), (std::vector<std::string>{"back", "way out"}));
  EXPECT_EQ(file.chain("way out"), out);
  EXPECT_EQ(file.chain("back"), back);
  EXPECT_FALSE(file.chain("elsewhere").has_value());
  EXPECT_TRUE(file.verify().empty());
  EXPECT_EQ(file.info().chains, 2U);
}

TEST_F(ChainTables, SavingAgainReplacesAndRemovingRemoves) {
  MemoryFile file = MemoryFile::create(path, small_header());
  EXPECT_THROW(file.remove_chain("way"), ContractError);
  file.save_chain("way", random_chain(1, 9));
  file.save_chain("way", random_chain(2, 4));
  EXPECT_EQ(file.chain("way"), random_chain(2, 4));
  EXPECT_EQ(file.info().chains, 1U);
  EXPECT_THROW(file.remove_chain("other"), ContractError);
  file.remove_chain("way");
  EXPECT_FALSE(file.chain("way").has_value());
  EXPECT_TRUE(file.chain_names().empty());
  EXPECT_TRUE(file.verify().empty());
}

// Who has no chains keeps a file that versions without chains read.
TEST_F(ChainTables, TheFirstChainMakesTheFormatNewer) {
  MemoryFile file = MemoryFile::create(path, small_header());
  Random random(3);
  const ViewId view = file.append(random_view(random, small_header().shape, 1));
  EXPECT_EQ(file.info().format_version, 1);
  file.save_chain("way", random_chain(1, 3));
  EXPECT_EQ(file.info().format_version, 2);
  // The same connection goes on, and the views are as before.
  const ViewId next = file.append(random_view(random, small_header().shape, 2));
  EXPECT_EQ(file.load().size(), 2U);
  EXPECT_LT(view, next);
  const MemoryFile again = MemoryFile::open(path, Access::read_only);
  EXPECT_EQ(again.info().format_version, 2);
  EXPECT_EQ(again.load().size(), 2U);
  EXPECT_EQ(again.chain("way"), random_chain(1, 3));
}

TEST_F(ChainTables, WrongChainsAreRefusedAndChangeNothing) {
  MemoryFile file = MemoryFile::create(path, small_header());
  EXPECT_THROW(file.save_chain("", random_chain(1, 2)), ContractError);
  EXPECT_THROW(file.save_chain("way", {}), ContractError);
  SnapshotChain backwards = random_chain(1, 3);
  backwards.snapshots[2].travelled_m = -1.0;
  EXPECT_THROW(file.save_chain("way", backwards), ContractError);
  SnapshotChain nowhere = random_chain(1, 3);
  nowhere.snapshots[1].previous_from_this.x_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(file.save_chain("way", nowhere), ContractError);
  EXPECT_EQ(file.info().format_version, 1);
  file.save_chain("way", random_chain(5, 3));
  EXPECT_THROW(file.save_chain("way", backwards), ContractError);
  EXPECT_EQ(file.chain("way"), random_chain(5, 3)) << "the chain before is kept";
}

TEST_F(ChainTables, RowsThatWereTamperedWith) {
  for (const std::string sql :
       {"UPDATE chains SET snapshots = 3", "UPDATE chains SET name = 'other'",
        "UPDATE chains SET components = 5", "UPDATE chains SET elevation_top_rad = 0.5",
        "UPDATE chains SET rows = 0", "DELETE FROM chains",
        "DELETE FROM chain_snapshots WHERE number = 3",
        "DELETE FROM chain_snapshots WHERE number = 1",
        "UPDATE chain_snapshots SET travelled_m = 0 WHERE number = 2",
        "UPDATE chain_snapshots SET heading_rad = 1.5 WHERE number = 2",
        "UPDATE chain_snapshots SET coefficients = x'00' WHERE number = 2",
        "UPDATE chain_snapshots SET number = 9 WHERE number = 3"}) {
    std::filesystem::remove(path);
    {
      MemoryFile file = MemoryFile::create(path, small_header());
      file.save_chain("way", random_chain(1, 4));
    }
    run_sql(path, sql);
    const MemoryFile file = MemoryFile::open(path, Access::read_only);
    EXPECT_FALSE(file.verify().empty()) << sql;
    bool refused = false;
    for (const auto* name : {"way", "other"}) {
      try {
        (void)file.chain(name);
      } catch (const FileError& error) {
        refused = true;
        EXPECT_TRUE(contains(error.what(), "chain "));
      }
    }
    EXPECT_TRUE(refused) << sql;
    EXPECT_NO_THROW((void)file.load()) << "views do not suffer";
  }
}

TEST_F(ChainTables, AFileThatClaimsChainsWithoutTheirTablesIsRefused) {
  { (void)MemoryFile::create(path, small_header()); }
  run_sql(path, "PRAGMA journal_mode=DELETE; PRAGMA user_version=2");
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { (void)MemoryFile::open(path, Access::read_only); }),
               "table chain_snapshots is missing"));
}

TEST_F(ChainTables, NothingIsReadThatWasNotWritten) {
  const auto expected = random_chain(7, 300, 4, 12);  // most of the file is chain
  {
    MemoryFile file = MemoryFile::create(path, small_header());
    file.save_chain("way", expected);
  }
  const std::string good = bytes_of(path);
  Random random(8);
  int refused = 0;
  constexpr int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    SCOPED_TRACE(trial);
    const auto copy = folder.write("damaged.panonav", damaged_bytes(good, random, trial));
    try {
      const MemoryFile file = MemoryFile::open(copy, Access::read_only);
      const bool intact = file.verify().empty();
      const auto read = file.chain("way");
      if (read.has_value()) {
        EXPECT_EQ(*read, expected);
      } else {
        EXPECT_FALSE(intact) << "lost without a fault";
      }
      refused += intact ? 0 : 1;
    } catch (const FileError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
    if (HasFailure()) return;
  }
  EXPECT_GT(refused, trials / 4);
}

}  // namespace
}  // namespace panonav::testing
