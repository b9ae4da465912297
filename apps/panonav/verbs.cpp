#include "verbs.hpp"

namespace panonav::command {

std::vector<Verb> all_verbs() {
  return {};
}

}  // namespace panonav::command
