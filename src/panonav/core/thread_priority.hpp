#pragma once

#include <sched.h>
#include <unistd.h>

namespace panonav {

/// Lowers the priority of the calling thread (batch scheduling, nice + 10), so that background work
/// does not delay a robot's answers. On Linux both calls affect only the calling thread.
inline void lower_thread_priority() {
  const sched_param lowest{};
  (void)sched_setscheduler(0, SCHED_BATCH, &lowest);
  (void)!nice(10);
}

}  // namespace panonav
