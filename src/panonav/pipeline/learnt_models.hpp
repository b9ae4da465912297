#pragma once

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Learns from the file's views what localisation and tracking need (whether a place is known,
/// positions between views, how views differ with distance), and stores it in the file with a
/// fingerprint of the views. Does nothing if the file has current models. Call it after views or
/// poses have changed. Cost: loading, and up to some seconds of learning.
void learn_and_store_models(MemoryFile& file);

}  // namespace panonav
