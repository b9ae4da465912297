#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace panonav {

/// Allocates on 64-byte borders: whole cache lines, and the widest vector registers.
template <class T>
struct CacheLineAllocator {
  using value_type = T;
  CacheLineAllocator() = default;
  template <class U>
  explicit CacheLineAllocator(const CacheLineAllocator<U>&) noexcept {}
  [[nodiscard]] T* allocate(std::size_t count) {
    return static_cast<T*>(::operator new (count * sizeof(T), std::align_val_t{64}));
  }
  void deallocate(T* pointer, std::size_t /*count*/) noexcept {
    ::operator delete (pointer, std::align_val_t{64});
  }
  friend bool operator==(CacheLineAllocator, CacheLineAllocator) { return true; }
};

/// Allocates on borders of large pages, which the system is asked for: bytes that are read here and
/// there then cost no look-up of small pages.
template <class T>
struct LargePageAllocator {
  static constexpr std::size_t page = std::size_t{2} << 20U;
  using value_type = T;
  LargePageAllocator() = default;
  template <class U>
  explicit LargePageAllocator(const LargePageAllocator<U>&) noexcept {}
  [[nodiscard]] T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (bytes < page / 2) {
      return static_cast<T*>(::operator new (bytes, std::align_val_t{64}));
    }
    void* const at = ::operator new (bytes, std::align_val_t{page});
#ifdef MADV_HUGEPAGE
    static_cast<void>(madvise(at, (bytes + page - 1) / page * page, MADV_HUGEPAGE));
#endif
    return static_cast<T*>(at);
  }
  void deallocate(T* pointer, std::size_t count) noexcept {
    ::operator delete (pointer, std::align_val_t{count * sizeof(T) < page / 2 ? 64 : page});
  }
  friend bool operator==(LargePageAllocator, LargePageAllocator) {
    return true;
  }
};

template <class T>
using LargePageVector = std::vector<T, LargePageAllocator<T>>;

template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

}  // namespace panonav
