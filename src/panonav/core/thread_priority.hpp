#pragma once

#include <sched.h>
#include <unistd.h>

namespace panonav {

/// Lowers the priority of this thread below that of a robot's answers, also where these are made by
/// a real-time thread. On Linux both calls are about the calling thread.
inline void lower_thread_priority() {
  const sched_param lowest{};
  (void)sched_setscheduler(0, SCHED_BATCH, &lowest);
  (void)!nice(10);
}

}  // namespace panonav
