#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace panonav::bench {

/// Another way to find the nearest views, over data of its own.
class Rival {
 public:
  virtual ~Rival() = default;
  /// Numbers of the `top` nearest views in any order.
  virtual std::vector<std::uint32_t> nearest(std::span<const std::uint8_t> query,
                                             std::size_t top) = 0;
};

/// A plain loop over floats, compiled for this machine's widest vectors.
std::unique_ptr<Rival> make_float_scan(std::span<const std::uint8_t> views, std::size_t dimensions);
/// The same over bytes.
std::unique_ptr<Rival> make_byte_scan(std::span<const std::uint8_t> views, std::size_t dimensions);
/// FAISS IndexFlat with L1 on one thread; null where FAISS is not installed.
std::unique_ptr<Rival> make_faiss(std::span<const std::uint8_t> views, std::size_t dimensions);

/// hnswlib with L1 over bytes; approximate.
class GraphRival : public Rival {
 public:
  virtual void set_ef(std::size_t ef) = 0;
};
/// M = 16, ef_construction = 200. The graph is kept in `cache`. Null where hnswlib is not
/// installed.
std::unique_ptr<GraphRival> make_hnsw(std::span<const std::uint8_t> views, std::size_t dimensions,
                                      const char* cache);

}  // namespace panonav::bench
