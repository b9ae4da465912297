#include "panonav/pipeline/named_view.hpp"

#include <algorithm>
#include <charconv>

#include "panonav/core/error.hpp"

namespace panonav {

ViewId named_view(const MemoryFile& file, const std::string& wanted) {
  if (const auto named = file.find(wanted)) return *named;
  std::uint32_t id = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), id);
  const bool number = error == std::errc() && end == wanted.data() + wanted.size();
  if (number && std::ranges::binary_search(file.views(), ViewId{id})) return ViewId{id};
  throw FileError(file.path().string(), "has no view of the name or id '" + wanted + "'");
}

}  // namespace panonav
