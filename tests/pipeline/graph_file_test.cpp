#include "panonav/pipeline/graph_file.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "panonav/core/error.hpp"
#include "panonav/io/atomic_file.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {
namespace {

using GraphFile = InTemporaryFolder;

TEST_F(GraphFile, NodesAndEdgesAreThere) {
  TopologicalMap map;
  map.nodes = {{ViewId{3}, {1.5, -2.0, 0.25}, 0}, {ViewId{7}, {0.0, 0.0, 0.0}, 0}};
  map.edges = {{ViewId{3}, ViewId{7}, {0.5, 0.0, 0.125}, Link::Kind::closure, 0.75}};
  const auto path = folder / "map.graphml";
  write_graph(path, map, [](ViewId view) { return view.value == 3 ? "a<b&\"c\".png" : "d.png"; });
  const auto bytes = read_file(path, 1U << 20U);
  const std::string text(bytes.begin(), bytes.end());
  for (const char* component :
       {"<graphml", "<node id=\"3\"><data key=\"name\">a&lt;b&amp;&quot;c&quot;.png</data>",
        "<data key=\"x_m\">1.5</data><data key=\"y_m\">-2</data>",
        "<edge source=\"3\" target=\"7\"><data key=\"kind\">closure</data>",
        "<data key=\"weight\">0.75</data>", "</graphml>"}) {
    EXPECT_TRUE(contains(text, component)) << component << "\n" << text;
  }
}

TEST_F(GraphFile, BrokenMapsAreRefused) {
  TopologicalMap map;
  map.nodes = {{ViewId{3}, {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}, 0}};
  EXPECT_THROW(write_graph(folder / "m.graphml", map, [](ViewId) { return std::string(); }),
               ContractError);
  EXPECT_FALSE(std::filesystem::exists(folder / "m.graphml"));
  EXPECT_THROW(write_graph(folder / "none" / "m.graphml", {}, [](ViewId) { return std::string(); }),
               FileError);
}

}  // namespace
}  // namespace panonav::testing
