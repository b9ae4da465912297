#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>

#include "panonav/storage/memory_file.hpp"
#include "panonav_fleet/memory_synchronisation.hpp"
#include "support/memory_samples.hpp"

namespace panonav::fleet {
using namespace testing;

/// The content of a view, whatever its id.
struct Seen {
  ReferenceInfo info;
  PackedSignature signature;
  std::optional<std::vector<std::uint8_t>> thumbnail, features;
  std::set<std::pair<std::string, int>> links;  // name of the other end, kind
  friend bool operator==(const Seen&, const Seen&) = default;
};

inline std::map<std::string, Seen> content(const std::filesystem::path& path) {
  const MemoryFile file = MemoryFile::open(path, Access::read_only);
  EXPECT_TRUE(file.verify().empty());
  const VisualMemory memory = file.load();
  std::map<std::string, Seen> content;
  for (const ViewId view : memory.views()) {
    content[memory.info(view).name] = {
        memory.info(view), memory.packed(view), file.thumbnail(view), file.features(view), {}};
  }
  for (const Link& link : memory.links()) {
    const std::string& a = memory.info(link.a).name;
    const std::string& b = memory.info(link.b).name;
    content.at(a).links.emplace(b, static_cast<int>(link.kind));
    content.at(b).links.emplace(a, static_cast<int>(link.kind));
  }
  return content;
}

/// Which views differ.
inline ::testing::AssertionResult is_same(const std::map<std::string, Seen>& a,
                                          const std::map<std::string, Seen>& b) {
  std::string different;
  for (const auto& [name, seen] : a) {
    const auto other = b.find(name);
    if (other == b.end() || !(other->second == seen)) different += " " + name;
  }
  for (const auto& [name, seen] : b) {
    if (!a.contains(name)) different += " " + name + " (only here)";
  }
  if (different.empty()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "different:" << different;
}

inline std::set<std::string> names(const std::filesystem::path& path) {
  std::set<std::string> names;
  for (const auto& [name, seen] : content(path)) names.insert(name);
  return names;
}

class SynchronisedMemory : public InTemporaryFolder {
 protected:
  void SetUp() override {
    if (std::getenv("PANONAV_TEST_SERVER") == nullptr) GTEST_SKIP() << "no PANONAV_TEST_SERVER";
  }
  [[nodiscard]] std::string server(const std::string& robot) const {
    return std::string(std::getenv("PANONAV_TEST_SERVER")) +
           "&memory=" + folder.path().filename().string() + "&robot=" + robot;
  }
  SynchronisationReport sync(const std::string& robot,
                             const SynchronisationOptions& options = {}) const {
    return synchronise_memory(folder / robot, server(robot), options);
  }
  [[nodiscard]] MemoryFile open(const std::string& robot) const {
    return MemoryFile::open(folder / robot, Access::read_write);
  }
  [[nodiscard]] MemoryFile on_server() const {
    return MemoryFile::open(server("x"), Access::read_write);
  }
  /// A file with views of these numbers, uploaded, and the same in the files of these robots.
  void share(std::initializer_list<const char*> robots, int views) const {
    for (const char* robot : robots) {
      if (robot == *robots.begin()) {
        MemoryFile file = MemoryFile::create(folder / robot, small_header());
        file.append(numbered(0, views));
      }
      (void)sync(robot);
    }
  }
  static NewView numbered(int number) {
    Random random(41, static_cast<std::uint64_t>(number));
    NewView view = random_view(random, small_header().shape, number);
    if (number % 5 == 0) view.features = {4, 5, static_cast<std::uint8_t>(number % 256)};
    return view;
  }
  static std::vector<NewView> numbered(int first, int count) {
    std::vector<NewView> views;
    for (int i = first; i < first + count; ++i) views.push_back(numbered(i));
    return views;
  }
  static NewView named(const std::string& name, int number) {
    NewView view = numbered(number);
    view.info.name = name;
    return view;
  }
};

}  // namespace panonav::fleet
