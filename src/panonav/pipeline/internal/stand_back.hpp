#pragma once

#include <sched.h>
#include <unistd.h>

namespace panonav {

/// Lets a robot's answers go before what this thread does, also where they are made by a real-time
/// thread. On Linux both calls are about the calling thread.
inline void stand_back() {
  const sched_param lowest{};
  (void)sched_setscheduler(0, SCHED_BATCH, &lowest);
  (void)!nice(10);
}

}  // namespace panonav
