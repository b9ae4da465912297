#pragma once

#include "cli/session.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "runs/recording.hpp"

namespace panonav::command {

/// A memory keeps the options that it was made with: throws ContractError on other values of
/// [signature] and, where the verb has them, of [preprocessing] that the user gave.
void require_stored_options(const Arguments& arguments, const SignatureOptions& signature,
                            const PreprocessingOptions& preprocessing, const MemoryFile& memory);

}  // namespace panonav::command
