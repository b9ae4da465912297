#include "panonav/memory/internal/name_index.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "panonav/core/random.hpp"

namespace panonav {
namespace {

TEST(NameIndex, FindsWhatAMapFindsAfterRandomChanges) {
  Random random(1);
  std::vector<std::string> names;  // by row
  const auto name_of = [&](NameIndex::Row row) -> const std::string& { return names[row]; };
  NameIndex index;
  std::map<std::string, NameIndex::Row> expected;
  EXPECT_FALSE(index.find("view_0", name_of));
  std::size_t found_rows = 0;
  std::size_t erased = 0;
  for (int step = 0; step < 20'000; ++step) {
    const std::string name = "view_" + std::to_string(random.index(300));
    const auto at = expected.find(name);
    const auto found = index.find(name, name_of);
    ASSERT_EQ(found.has_value(), at != expected.end()) << name;
    if (found) {
      ASSERT_EQ(*found, at->second);
      ++found_rows;
    }
    if (found && random.index(2) == 0) {
      index.erase(name, name_of);
      expected.erase(at);
      ++erased;
    } else if (!found) {
      const auto row = static_cast<NameIndex::Row>(names.size());
      names.push_back(name);
      index.insert(name, row);
      expected.emplace(name, row);
    }
  }
  EXPECT_GE(found_rows, 1000);
  EXPECT_GE(erased, 1000);
  for (const auto& [name, row] : expected) EXPECT_EQ(index.find(name, name_of), row);
}

}  // namespace
}  // namespace panonav
