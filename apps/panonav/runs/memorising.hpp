#pragma once

#include "cli/session.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

/// Throws ContractError if the user set an option of [signature] or [preprocessing] to another
/// value than that with which the memory was made, as these cannot change.
void require_stored_options(const Arguments& arguments, const SignatureOptions& signature,
                            const PreprocessingOptions& preprocessing, const MemoryFile& memory);

/// Prints how many views have no position in a memory with positions of a data set, and what that
/// means; prints nothing for other memories.
void print_views_without_position(const MemoryFile& memory, Session& session);

/// Returns the memory of decoded images to the system, before models are learnt with other memory.
void return_freed_memory();

}  // namespace panonav::command
