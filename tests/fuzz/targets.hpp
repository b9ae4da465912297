#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace panonav::testing {

/// Gives the bytes to one of the readers as the file, or the text, that a stranger may have made.
/// The reader must return a value or throw one FileError (of messages: Error) of one line: what
/// else it throws passes through, and a message of several lines throws std::logic_error.
struct FuzzTarget {
  std::string_view name;
  void (*read)(std::span<const std::uint8_t> bytes);
};

[[nodiscard]] std::span<const FuzzTarget> fuzz_targets();

}  // namespace panonav::testing
