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
  std::condition_variable work_there;
  std::condition_variable work_done;
  std::vector<std::thread> workers;
  std::function<void()> between;
  bool stopping = false;

  // The loop under way; guarded by `mutex`.
  const std::function<void(std::size_t, std::size_t, std::size_t)>* body = nullptr;
  std::size_t count = 0;
  std::size_t chunk = 1;
  std::size_t next_chunk = 0;
  std::size_t open_chunks = 0;
  std::size_t failed_chunk = 0;
  std::exception_ptr failure;
  std::exception_ptr ended;  // what `between` threw

  // Takes chunks until none is left. `lock` is held on entry and on return.
  void run(std::unique_lock<std::mutex>& lock, bool calling) {
    while (body != nullptr && next_chunk * chunk < count) {
      if (calling && between && !go_on(lock)) return;
      if (next_chunk * chunk >= count) return;  // others took the rest meanwhile
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
      if (thrown && (!failure || number < failed_chunk)) {
        failure = thrown;
        failed_chunk = number;
      }
      if (--open_chunks == 0) work_done.notify_all();
    }
  }

  // Asks `between`; where that throws, the chunks that nobody took count as done.
  bool go_on(std::unique_lock<std::mutex>& lock) {
    lock.unlock();
    std::exception_ptr thrown;
    try {
      between();
    } catch (...) {
      thrown = std::current_exception();
    }
    lock.lock();
    if (!thrown) return true;
    ended = thrown;
    const std::size_t chunks = (count + chunk - 1) / chunk;
    open_chunks -= chunks - std::min(chunks, next_chunk);
    next_chunk = chunks;
    return false;
  }
};

Executor::Executor(int wanted, std::function<void()> between) : pool_(std::make_unique<Pool>()) {
  require(wanted >= 0 && wanted <= 1024, "number of threads", wanted, "0 .. 1024");
  if (wanted == 0) wanted = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  pool_->between = std::move(between);
  pool_->workers.reserve(static_cast<std::size_t>(wanted - 1));
  const auto work = [pool = pool_.get()] {
    std::unique_lock lock(pool->mutex);
    while (!pool->stopping) {
      pool->run(lock, false);
      pool->work_there.wait(lock, [pool] {
        return pool->stopping ||
               (pool->body != nullptr && pool->next_chunk * pool->chunk < pool->count);
      });
    }
  };
  try {
    while (threads() < wanted) pool_->workers.emplace_back(work);
  } catch (const std::system_error&) {
    // The system has no thread left. Those that run do the same work, only more slowly.
  }
}

Executor::~Executor() {
  {
    const std::lock_guard lock(pool_->mutex);
    pool_->stopping = true;
  }
  pool_->work_there.notify_all();
  for (auto& worker : pool_->workers) worker.join();
}

int Executor::threads() const noexcept {
  return static_cast<int>(pool_->workers.size()) + 1;
}

void Executor::for_chunks(std::size_t count, std::size_t chunk,
                          const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  require(chunk >= 1, "chunk", static_cast<double>(chunk), ">= 1");
  if (count == 0) return;
  std::unique_lock lock(pool_->mutex);
  pool_->body = &body;
  pool_->count = count;
  pool_->chunk = chunk;
  pool_->next_chunk = 0;
  pool_->open_chunks = (count + chunk - 1) / chunk;
  pool_->failure = nullptr;
  pool_->ended = nullptr;
  pool_->work_there.notify_all();
  pool_->run(lock, true);
  pool_->work_done.wait(lock, [this] { return pool_->open_chunks == 0; });
  pool_->body = nullptr;
  if (pool_->ended) std::rethrow_exception(std::exchange(pool_->ended, nullptr));
  if (pool_->failure) std::rethrow_exception(std::exchange(pool_->failure, nullptr));
}

}  // namespace panonav
