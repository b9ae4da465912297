#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace panonav {

/// A number that names one thing of one kind. Ids of different kinds do not convert into each
/// other, and an id is not an index: it stays the same when other things are removed.
template <class Tag>
struct Id {
  std::uint32_t value = 0;  ///< what files and messages show; ids are ordered by it
  friend constexpr auto operator<=>(Id, Id) = default;
};

/// Names a reference view within one visual memory. Never used twice, even after a removal.
using ViewId = Id<struct ViewTag>;

}  // namespace panonav

/// Makes ids keys of unordered containers.
template <class Tag>
struct std::hash<panonav::Id<Tag>> {
  /// The id's value.
  std::size_t operator()(panonav::Id<Tag> id) const noexcept { return id.value; }
};
