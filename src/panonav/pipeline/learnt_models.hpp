#pragma once

#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Learns the models for localisation and tracking from the file's views (whether a place is known,
/// positions between views, how views differ with distance). Stores them in the file with a
/// fingerprint of the views. Does nothing if the stored models are current. Call it after changing
/// views or poses. Cost: loading the views, and up to a few seconds of learning.
void learn_and_store_models(MemoryFile& file);

}  // namespace panonav
