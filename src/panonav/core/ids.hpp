#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace panonav {

/// A typed number that identifies an object. Ids of different types do not convert into each other.
/// Unlike an index, an id does not change when other objects are removed.
template <class Tag>
struct Id {
  std::uint32_t value = 0;  ///< shown in files and messages; defines the order of ids
  friend constexpr auto operator<=>(Id, Id) = default;
};

/// Identifies a reference view within one visual memory. Never reused, even after a removal.
using ViewId = Id<struct ViewTag>;

}  // namespace panonav

/// Makes ids keys of unordered containers.
template <class Tag>
struct std::hash<panonav::Id<Tag>> {
  /// The id's value.
  std::size_t operator()(panonav::Id<Tag> id) const noexcept { return id.value; }
};
