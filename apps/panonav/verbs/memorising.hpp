#pragma once

#include <cstddef>

#include "cli/session.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "verbs/recording.hpp"

namespace panonav::command {

/// What a new memory says of its views. The first views of the recording decide the scale of the
/// whole memory, so nothing about light or scene need be known beforehand. Throws FileError on
/// pictures that cannot be read or show nothing, ContractError on a shape that they do not allow.
[[nodiscard]] MemoryHeader header_from_first_views(const Dataset& recording,
                                                   const SignatureOptions& wanted,
                                                   const PreprocessingOptions& preprocessing,
                                                   Executor& executor);

/// A memory keeps the options that it was made with: throws ContractError on other values of
/// [signature] and, where the verb has them, of [preprocessing] that the user gave.
void require_kept_options(const Arguments& arguments, const SignatureOptions& signature,
                          const PreprocessingOptions& preprocessing, const MemoryFile& memory);

}  // namespace panonav::command
