#pragma once

#include <cstddef>
#include <ctime>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "panonav/core/executor.hpp"

namespace panonav::simulation {

/// Returns make(0) to make(count - 1), computed on the executor's threads. Each result must depend
/// only on its index.
template <typename Make>
auto make_each(Executor& executor, std::size_t count, Make make) {
  using Made = std::invoke_result_t<Make, std::size_t>;
  std::vector<std::optional<Made>> slots(count);
  executor.for_each_chunk(count, 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) slots[i].emplace(make(i));
  });
  std::vector<Made> made;
  made.reserve(count);
  for (auto& slot : slots) made.push_back(std::move(*slot));
  return made;
}

/// Returns the processor time that the calling thread has used so far.
[[nodiscard]] inline double get_thread_cpu_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace panonav::simulation
