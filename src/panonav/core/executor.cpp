#include "panonav/core/executor.hpp"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"

namespace panonav {

struct Executor::Pool {
  std::mutex mutex;
  std::condition_variable work_available;
  std::condition_variable work_done;
  std::vector<std::thread> workers;
  std::function<void()> before_chunk;
  bool stopping = false;

  // State of the running loop; guarded by `mutex`.
  const std::function<void(std::size_t, std::size_t, std::size_t)>* body = nullptr;
  std::size_t count = 0;
  std::size_t chunk = 1;
  std::size_t next_chunk = 0;
  std::size_t unfinished_chunks = 0;
  std::size_t failed_chunk = 0;
  std::exception_ptr first_failure;
  std::exception_ptr interruption;  // thrown by `before_chunk`

  // Runs chunks until all are taken. `lock` is held on entry and on return.
  void run_chunks(std::unique_lock<std::mutex>& lock, bool is_caller) {
    while (body != nullptr && next_chunk * chunk < count) {
      if (is_caller && before_chunk && !call_before_chunk_or_cancel(lock)) return;
      if (next_chunk * chunk >= count) return;  // other threads took the remaining chunks meanwhile
      const std::size_t number = next_chunk++;
      const auto* const work = body;
      const std::size_t begin = number * chunk;
      const std::size_t end = std::min(count, begin + chunk);
      lock.unlock();
      std::exception_ptr thrown;
      try {
        (*work)(begin, end, number);
      } catch (...) {
        thrown = std::current_exception();
      }
      lock.lock();
      if (thrown && (!first_failure || number < failed_chunk)) {
        first_failure = thrown;
        failed_chunk = number;
      }
      if (--unfinished_chunks == 0) work_done.notify_all();
    }
  }

  // Calls `before_chunk`. If it throws, stores the exception, cancels the chunks that no thread has
  // taken, and returns false.
  bool call_before_chunk_or_cancel(std::unique_lock<std::mutex>& lock) {
    lock.unlock();
    std::exception_ptr thrown;
    try {
      before_chunk();
    } catch (...) {
      thrown = std::current_exception();
    }
    lock.lock();
    if (!thrown) return true;
    interruption = thrown;
    const std::size_t chunks = (count + chunk - 1) / chunk;
    unfinished_chunks -= chunks - std::min(chunks, next_chunk);
    next_chunk = chunks;
    return false;
  }
};

Executor::Executor(int count, std::function<void()> before_chunk)
    : pool_(std::make_unique<Pool>()) {
  require(count >= 0 && count <= 1024, "number of threads", count, "0 .. 1024");
  if (count == 0) count = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  pool_->before_chunk = std::move(before_chunk);
  pool_->workers.reserve(static_cast<std::size_t>(count - 1));
  const auto work = [pool = pool_.get()] {
    std::unique_lock lock(pool->mutex);
    while (!pool->stopping) {
      pool->run_chunks(lock, false);
      pool->work_available.wait(lock, [pool] {
        return pool->stopping ||
               (pool->body != nullptr && pool->next_chunk * pool->chunk < pool->count);
      });
    }
  };
  try {
    while (threads() < count) pool_->workers.emplace_back(work);
  } catch (const std::system_error&) {
    // The system cannot start more threads; those started do the work more slowly.
  }
}

Executor::~Executor() {
  {
    const std::lock_guard lock(pool_->mutex);
    pool_->stopping = true;
  }
  pool_->work_available.notify_all();
  for (auto& worker : pool_->workers) worker.join();
}

int Executor::threads() const noexcept {
  return static_cast<int>(pool_->workers.size()) + 1;
}

void Executor::for_each_chunk(
    std::size_t count, std::size_t chunk,
    const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  require(chunk >= 1, "chunk", static_cast<double>(chunk), ">= 1");
  if (count == 0) return;
  std::unique_lock lock(pool_->mutex);
  pool_->body = &body;
  pool_->count = count;
  pool_->chunk = chunk;
  pool_->next_chunk = 0;
  pool_->unfinished_chunks = (count + chunk - 1) / chunk;
  pool_->first_failure = nullptr;
  pool_->interruption = nullptr;
  pool_->work_available.notify_all();
  pool_->run_chunks(lock, true);
  pool_->work_done.wait(lock, [this] { return pool_->unfinished_chunks == 0; });
  pool_->body = nullptr;
  if (pool_->interruption) std::rethrow_exception(std::exchange(pool_->interruption, nullptr));
  if (pool_->first_failure) std::rethrow_exception(std::exchange(pool_->first_failure, nullptr));
}

}  // namespace panonav
