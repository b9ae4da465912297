#pragma once

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Learns from the file's views what localisation and tracking need (whether a place is known,
/// positions between views, how views differ with distance), and keeps it in the file with a
/// fingerprint of the views; does nothing where the file has it. To be called when views or poses
/// have changed. Cost: loading, and up to some seconds of learning.
void learn_and_store_models(MemoryFile& file);

}  // namespace panonav
