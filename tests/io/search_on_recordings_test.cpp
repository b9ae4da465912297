// The exact search of a visual memory against brute force, on signatures of real recordings.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "panonav/io/dataset.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/signature/dissimilarity.hpp"
#include "support/skips.hpp"

namespace panonav::testing {
namespace {

class SearchOnRecordings : public ::testing::TestWithParam<const char*> {};

TEST_P(SearchOnRecordings, FindsWhatAFullScanFinds) {
  const auto folder = real_data(GetParam());
  PANONAV_REQUIRE_DATA(folder, GetParam());

  const Dataset dataset = read_dataset(*folder);
  const PanoramaReader reader(dataset.source, {0, 0});
  std::vector<FourierSignature> signatures;
  float full_scale = 0.0F;
  for (const DatasetEntry& entry : dataset.entries) {
    signatures.push_back(compute_signature(reader.read(entry.path), 15));
    full_scale = std::max(full_scale, std::ranges::max(signatures.back().magnitudes()));
  }
  ASSERT_GE(signatures.size(), 100U);
  VisualMemory memory(signatures.front().shape(), full_scale, signatures.front().elevations());
  for (std::size_t i = 0; i < signatures.size(); ++i) {
    memory.append(signatures[i], {dataset.entries[i].file, dataset.entries[i].pose, {}});
  }

  std::uint64_t read = 0;
  std::uint64_t in_full = 0;
  for (const ViewId view : memory.views()) {
    const PackedSignature query = memory.packed(view);
    const std::vector<ViewId> excluded{view};
    const int components = view.value % 3 == 0 ? 0 : 1 + static_cast<int>(view.value % 15);
    const int top = 1 + static_cast<int>(view.value % 7);
    std::vector<Match> expected;
    for (const ViewId other : memory.views()) {
      if (other == view) continue;
      expected.push_back({other, dissimilarity_packed(query, memory.packed(other), components)});
    }
    std::ranges::sort(expected, [](const Match& a, const Match& b) {
      return std::pair(a.dissimilarity, a.view) < std::pair(b.dissimilarity, b.view);
    });
    expected.resize(static_cast<std::size_t>(top));
    const SearchResult found = memory.search(query, {top, components}, {excluded, {}});
    ASSERT_EQ(found.matches, expected) << memory.info(view).name;
    read += found.bytes_read;
    in_full += found.bytes_in_full;
  }
  EXPECT_LT(read, in_full);
}

INSTANTIATE_TEST_SUITE_P(Recordings, SearchOnRecordings,
                         ::testing::Values("gantry_plants", "sussex_route"),
                         [](const auto& instance) { return std::string(instance.param); });

}  // namespace
}  // namespace panonav::testing
