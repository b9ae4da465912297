#include "panonav/core/temporary_file.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "panonav/core/error.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

using TemporaryFileNames = InTemporaryFolder;

TEST_F(TemporaryFileNames, WhatADeadProcessLeftIsRemoved) {
  folder.write(".a.txt.tmp", "left by a process that was killed");
  const TemporaryFile file(folder / "a.txt");
  EXPECT_EQ(file.path(), folder / ".a.txt.tmp");
  EXPECT_EQ(std::filesystem::file_size(file.path()), 0U);
}

TEST_F(TemporaryFileNames, ADatabaseIsNoTarget) {
  folder.write("m.panonav", std::string("SQLite format 3") + '\0');
  folder.write("text", "SQLite format 3");
  std::filesystem::create_symlink("m.panonav", folder / "link");
  EXPECT_THROW(TemporaryFile(folder / "m.panonav"), FileError);
  EXPECT_THROW(TemporaryFile(folder / "link"), FileError);
  EXPECT_FALSE(std::filesystem::exists(folder / ".m.panonav.tmp"));
  EXPECT_NO_THROW(TemporaryFile(folder / "text"));
}

TEST_F(TemporaryFileNames, WhatIsInUseIsLeftAlone) {
  std::optional<TemporaryFile> first(folder / "a.txt");
  const TemporaryFile second(folder / "a.txt");
  const TemporaryFile third(folder / "a.txt");
  EXPECT_NE(second.path(), first->path());
  EXPECT_NE(second.path(), third.path());
  EXPECT_TRUE(std::filesystem::exists(first->path()));
  const auto path = first->path();
  first.reset();
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_TRUE(std::filesystem::exists(second.path()));
}

TEST_F(TemporaryFileNames, LinksAreNotFollowed) {
  folder.write("precious", "text");
  std::filesystem::create_symlink(folder / "precious", folder / ".a.txt.tmp");
  const TemporaryFile file(folder / "a.txt");
  EXPECT_NE(file.path(), folder / ".a.txt.tmp");
  EXPECT_EQ(bytes_of(folder / "precious"), "text");
}

TEST_F(TemporaryFileNames, ANameOfFullLengthHasOne) {
  const TemporaryFile file(folder / std::string(255, 'n'));
  EXPECT_TRUE(std::filesystem::exists(file.path()));
}

}  // namespace
}  // namespace panonav::testing
