#include "rivals.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#ifdef PANONAV_BENCH_FAISS
#include <faiss/IndexFlat.h>
#include <omp.h>
#endif
#ifdef PANONAV_BENCH_HNSW
#include <hnswlib/hnswlib.h>
#endif

namespace panonav::bench {

namespace {

template <class Value, class Sum>
class Scan final : public Rival {
 public:
  Scan(std::span<const std::uint8_t> views, std::size_t dimensions)
      : dimensions_(dimensions), views_(views.begin(), views.end()) {}

  std::vector<std::uint32_t> nearest(std::span<const std::uint8_t> query,
                                     std::size_t top) override {
    const std::vector<Value> values(query.begin(), query.end());
    const std::size_t count = views_.size() / dimensions_;
    std::vector<std::pair<Sum, std::uint32_t>> heap;
    for (std::size_t i = 0; i < count; ++i) {
      const Value* const view = views_.data() + i * dimensions_;
      const Value* const other = values.data();
      Sum sum = 0;
      for (std::size_t j = 0; j < dimensions_; ++j) {
        sum += static_cast<Sum>(std::abs(view[j] - other[j]));
      }
      if (heap.size() == top && sum >= heap.front().first) continue;
      if (heap.size() == top) {
        std::pop_heap(heap.begin(), heap.end());
        heap.pop_back();
      }
      heap.emplace_back(sum, static_cast<std::uint32_t>(i));
      std::push_heap(heap.begin(), heap.end());
    }
    std::vector<std::uint32_t> found;
    for (const auto& entry : heap) found.push_back(entry.second);
    return found;
  }

 private:
  std::size_t dimensions_;
  std::vector<Value> views_;
};

}  // namespace

std::unique_ptr<Rival> make_float_scan(std::span<const std::uint8_t> views,
                                       std::size_t dimensions) {
  return std::make_unique<Scan<float, float>>(views, dimensions);
}

std::unique_ptr<Rival> make_byte_scan(std::span<const std::uint8_t> views, std::size_t dimensions) {
  return std::make_unique<Scan<std::uint8_t, int>>(views, dimensions);
}

#ifdef PANONAV_BENCH_FAISS
namespace {

class Faiss final : public Rival {
 public:
  Faiss(std::span<const std::uint8_t> views, std::size_t dimensions)
      : index_(static_cast<faiss::Index::idx_t>(dimensions), faiss::METRIC_L1) {
    omp_set_num_threads(1);
    const std::vector<float> floats(views.begin(), views.end());
    index_.add(static_cast<faiss::Index::idx_t>(views.size() / dimensions), floats.data());
  }
  std::vector<std::uint32_t> nearest(std::span<const std::uint8_t> query,
                                     std::size_t top) override {
    const std::vector<float> values(query.begin(), query.end());
    std::vector<float> distances(top);
    std::vector<faiss::Index::idx_t> labels(top);
    index_.search(1, values.data(), static_cast<faiss::Index::idx_t>(top), distances.data(),
                  labels.data());
    return {labels.begin(), labels.end()};
  }

 private:
  faiss::IndexFlat index_;
};

}  // namespace

std::unique_ptr<Rival> make_faiss(std::span<const std::uint8_t> views, std::size_t dimensions) {
  return std::make_unique<Faiss>(views, dimensions);
}
#else
std::unique_ptr<Rival> make_faiss(std::span<const std::uint8_t> /*views*/,
                                  std::size_t /*dimensions*/) {
  return nullptr;
}
#endif

#ifdef PANONAV_BENCH_HNSW
namespace {

int byte_l1(const void* a, const void* b, const void* dimensions) {
  const auto* const x = static_cast<const std::uint8_t*>(a);
  const auto* const y = static_cast<const std::uint8_t*>(b);
  const std::size_t count = *static_cast<const std::size_t*>(dimensions);
  int sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += std::abs(x[i] - y[i]);
  return sum;
}

class ByteL1Space final : public hnswlib::SpaceInterface<int> {
 public:
  explicit ByteL1Space(std::size_t dimensions) : dimensions_(dimensions) {}
  std::size_t get_data_size() override { return dimensions_; }
  hnswlib::DISTFUNC<int> get_dist_func() override { return byte_l1; }
  void* get_dist_func_param() override { return &dimensions_; }

 private:
  std::size_t dimensions_;
};

class Hnsw final : public GraphRival {
 public:
  Hnsw(std::span<const std::uint8_t> views, std::size_t dimensions, const char* cache)
      : space_(dimensions) {
    const std::size_t count = views.size() / dimensions;
    if (std::filesystem::exists(cache)) {
      graph_ = std::make_unique<hnswlib::HierarchicalNSW<int>>(&space_, cache);
      return;
    }
    graph_ = std::make_unique<hnswlib::HierarchicalNSW<int>>(&space_, count, 16, 200);
    for (std::size_t i = 0; i < count; ++i) graph_->addPoint(views.data() + i * dimensions, i);
    graph_->saveIndex(cache);
  }
  void set_ef(std::size_t ef) override { graph_->setEf(ef); }
  std::vector<std::uint32_t> nearest(std::span<const std::uint8_t> query,
                                     std::size_t top) override {
    auto queue = graph_->searchKnn(query.data(), top);
    std::vector<std::uint32_t> found;
    for (; !queue.empty(); queue.pop()) {
      found.push_back(static_cast<std::uint32_t>(queue.top().second));
    }
    return found;
  }

 private:
  ByteL1Space space_;
  std::unique_ptr<hnswlib::HierarchicalNSW<int>> graph_;
};

}  // namespace

std::unique_ptr<GraphRival> make_hnsw(std::span<const std::uint8_t> views, std::size_t dimensions,
                                      const char* cache) {
  return std::make_unique<Hnsw>(views, dimensions, cache);
}
#else
std::unique_ptr<GraphRival> make_hnsw(std::span<const std::uint8_t> /*views*/,
                                      std::size_t /*dimensions*/, const char* /*cache*/) {
  return nullptr;
}
#endif

}  // namespace panonav::bench
