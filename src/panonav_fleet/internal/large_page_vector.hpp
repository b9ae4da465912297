#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

#include "panonav/memory/internal/aligned_vector.hpp"

namespace panonav::fleet {

/// Allocates memory on large pages (2 MiB), so that scattered reads cause fewer TLB misses. It
/// requests pages from the system itself, because a heap would leave gaps between aligned blocks.
template <class T>
struct LargePageAllocator {
  static constexpr std::size_t page_bytes = std::size_t{2} << 20U;
  using value_type = T;
  LargePageAllocator() = default;
  template <class U>
  explicit LargePageAllocator(const LargePageAllocator<U>&) noexcept {}
  [[nodiscard]] T* allocate(std::size_t count) {
    if (is_small(count)) return CacheLineAllocator<T>().allocate(count);
    const std::size_t bytes = round_up_to_page(count);
    void* const got = mmap(nullptr, bytes + page_bytes, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (got == MAP_FAILED) throw std::bad_alloc();
    auto* const begin = static_cast<char*>(got);
    const std::size_t before =
        (page_bytes - reinterpret_cast<std::uintptr_t>(begin) % page_bytes) % page_bytes;
    if (before > 0) munmap(begin, before);
    if (before < page_bytes) munmap(begin + before + bytes, page_bytes - before);
#ifdef MADV_HUGEPAGE
    static_cast<void>(madvise(begin + before, bytes, MADV_HUGEPAGE));
#endif
    return reinterpret_cast<T*>(begin + before);
  }
  void deallocate(T* pointer, std::size_t count) noexcept {
    if (is_small(count)) return CacheLineAllocator<T>().deallocate(pointer, count);
    munmap(pointer, round_up_to_page(count));
  }
  friend bool operator==(LargePageAllocator, LargePageAllocator) {
    return true;
  }

 private:
  static bool is_small(std::size_t count) {
    return count * sizeof(T) < page_bytes / 2;
  }
  static std::size_t round_up_to_page(std::size_t count) {
    return (count * sizeof(T) + page_bytes - 1) / page_bytes * page_bytes;
  }
};

template <class T>
using LargePageVector = std::vector<T, LargePageAllocator<T>>;

}  // namespace panonav::fleet
