#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace panonav {

/// A number with this many digits after the point, for people.
[[nodiscard]] std::string format_fixed(double value, int digits);

/// A number as people write it, with up to `significant` digits and no exponent below 1e15:
/// 30, not 29.999999999999996. What rounds to nothing at the resolution of its unit (a hundredth
/// of a millimetre for "m", a thousandth of a degree for "deg", nine places for
/// numbers without unit) is 0, without sign. "none" where it is not finite.
[[nodiscard]] std::string format_number(double value, std::string_view unit = {},
                                        int significant = 6);

/// Text of any origin, such as a file's name, for people: one line of valid UTF-8. Control
/// characters become spaces, bytes that are not UTF-8 the replacement character U+FFFD.
[[nodiscard]] std::string to_readable_line(std::string_view text);

/// The text with small letters of ASCII in place of capital ones; other bytes stay.
[[nodiscard]] std::string to_lower_case(std::string_view text);

/// The field as a CSV file needs it: in quotes where it holds a comma, a quote, a `#` or a line
/// break, is empty or has a blank at an end.
[[nodiscard]] std::string to_csv_field(std::string_view text);

/// Valid UTF-8 with its middle left out ("...") where it has more than `max_characters` (>= 8).
[[nodiscard]] std::string shorten_middle(std::string_view text, std::size_t max_characters);

/// " (did you mean 'NAME'?)" with the name that is nearest to what was typed; empty where none is
/// near: more than a third of the characters would have to be inserted, deleted, changed or
/// swapped.
[[nodiscard]] std::string suggest_name(std::string_view typed,
                                       std::span<const std::string_view> names);

/// The text as one word for a POSIX shell, in quotation marks where it needs them.
[[nodiscard]] std::string quote_for_shell(std::string_view text);

}  // namespace panonav
