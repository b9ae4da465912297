#pragma once

#include <vector>

#include "verb.hpp"

namespace panonav::command {

/// Every verb, in the order in which a newcomer meets them.
[[nodiscard]] std::vector<Verb> all_verbs();

}  // namespace panonav::command
