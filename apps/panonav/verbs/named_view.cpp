#include "verbs/named_view.hpp"

#include <charconv>

#include "panonav/core/error.hpp"

namespace panonav::command {

ViewId named_view(const VisualMemory& memory, const std::string& wanted, const std::string& file) {
  if (const auto named = memory.find(wanted)) return *named;
  std::uint32_t id = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), id);
  const bool number = error == std::errc() && end == wanted.data() + wanted.size();
  if (number && memory.contains(ViewId{id})) return ViewId{id};
  throw FileError(file, "has no view of the name or id '" + wanted + "'");
}

}  // namespace panonav::command
