#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace panonav {

/// Runs loops on a fixed number of threads. There is no global executor: callers own one and pass
/// it down. The borders of chunks depend only on `count` and `chunk`, so results are bit-identical
/// for any number of threads if a body takes its random stream from the chunk number and reductions
/// run in the order of the chunks.
class Executor {
 public:
  /// Starts the threads: 1 runs everything in the calling thread, 0 uses one thread per core. If
  /// the system cannot start all of them, the executor uses fewer. `before_chunk` is called in the
  /// thread that calls `for_each_chunk`, before each chunk that this thread runs; an exception from
  /// it ends the loop, for example when the user interrupts. Throws ContractError outside 0 ..
  /// 1024.
  explicit Executor(int threads = 1, std::function<void()> before_chunk = {});
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Number of threads, including the calling one.
  [[nodiscard]] int threads() const noexcept;

  /// Calls body(begin, end, chunk_number) for each chunk of [0, count) and waits for all of them.
  /// Rethrows in the calling thread the exception of the body with the lowest chunk number. An
  /// exception of `before_chunk` has precedence and cancels the chunks that have not begun. Not
  /// re-entrant.
  void for_each_chunk(std::size_t count, std::size_t chunk,
                      const std::function<void(std::size_t, std::size_t, std::size_t)>& body);

 private:
  struct Pool;
  std::unique_ptr<Pool> pool_;
};

}  // namespace panonav
