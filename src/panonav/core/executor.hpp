#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace panonav {

/// Runs loops on a fixed number of threads. The caller owns it and passes it down; there is no
/// global one. Work is cut into chunks whose borders depend on `count` and `chunk` alone, so a body
/// that takes its random stream from the chunk number, and a reduction in the order of the chunk
/// numbers, give the same bits on any number of threads.
class Executor {
 public:
  /// Starts the threads: 1 runs everything in the calling thread, 0 takes one thread per core.
  /// Where the system starts fewer, the executor uses those. `before_chunk` is called in the thread
  /// that runs a loop, before each chunk that this thread takes; what it throws ends the loop, as
  /// when the user interrupts. Throws ContractError outside 0 .. 1024.
  explicit Executor(int threads = 1, std::function<void()> before_chunk = {});
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Number of threads that run, the calling one included.
  [[nodiscard]] int threads() const noexcept;

  /// Calls body(begin, end, chunk_number) for each chunk of [0, count) and waits for all. The first
  /// exception (by chunk number) is rethrown in the calling thread; one of `before_chunk` comes
  /// before it, and no further chunk begins. Not re-entrant.
  void for_chunks(std::size_t count, std::size_t chunk,
                  const std::function<void(std::size_t, std::size_t, std::size_t)>& body);

 private:
  struct Pool;
  std::unique_ptr<Pool> pool_;
};

}  // namespace panonav
