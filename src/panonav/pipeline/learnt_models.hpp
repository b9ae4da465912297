#pragma once

#include "panonav/core/executor.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Learns the models for localisation and tracking from the file's views (whether a place is known,
/// positions between views, how views differ with distance). Stores them in the file with a
/// fingerprint of the views. Learns from the first views, as many as their number rounded down to
/// three significant digits, so that one more view seldom changes the models; of more than 20,000,
/// from whole areas with as many. Does nothing if the stored models are current. Call it after
/// changing views or poses. Cost: a pass over the poses (40 ms for 100,000 views); if models are
/// not current, loading at most 20,000 views and about a second of learning. Uses up to three
/// threads.
void learn_and_store_models(MemoryFile& file, Executor& executor);
/// Learns in the calling thread.
void learn_and_store_models(MemoryFile& file);

}  // namespace panonav
