#include "verbs.hpp"

namespace panonav::command {

std::vector<Verb> all_verbs() {
  return {
      unwrap_verb(),
  };
}

}  // namespace panonav::command
