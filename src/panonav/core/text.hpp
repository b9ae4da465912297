#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace panonav {

/// Formats a number with this many digits after the point, for people.
[[nodiscard]] std::string format_fixed(double value, int digits);

/// Formats a number as people write it, with up to `significant` digits and no exponent below 1e15:
/// 30, not 29.999999999999996. A value that rounds to zero at the resolution of its unit (a
/// hundredth of a millimetre for "m", a thousandth of a degree for "deg", nine places for numbers
/// without unit) is 0, without sign. "none" where it is not finite.
[[nodiscard]] std::string format_number(double value, std::string_view unit = {},
                                        int significant = 6);

/// Makes one line of valid UTF-8 of any bytes, such as a file's name. Control
/// characters, also those that turn the direction of writing, become spaces, bytes that are not
/// UTF-8 the replacement character U+FFFD.
[[nodiscard]] std::string to_readable_line(std::string_view text);

/// True if the text is valid UTF-8.
[[nodiscard]] bool is_utf8(std::string_view text);

/// Decodes the escapes of a URL: "%41" is "A". nullopt: a "%" without two hexadecimal digits, or
/// "%00", which no name holds.
[[nodiscard]] std::optional<std::string> decode_percent(std::string_view text);

/// Replaces the capital letters of ASCII by small ones; other bytes stay.
[[nodiscard]] std::string to_lower_case(std::string_view text);

/// Quotes a field for a CSV file where it holds a comma, a quote, a `#` or a line
/// break, is empty or has a blank at an end.
[[nodiscard]] std::string to_csv_field(std::string_view text);

/// Escapes a field for a table that people open in a spreadsheet: a text that it would compute as a
/// formula (beginning with =, +, -, @ or a tab) gets an apostrophe in front. Readers of panonav do
/// not remove it.
[[nodiscard]] std::string to_sheet_field(std::string_view text);

/// Leaves out the middle ("...") of valid UTF-8 where it has more than `max_characters` (>= 8).
[[nodiscard]] std::string shorten_middle(std::string_view text, std::size_t max_characters);

/// Returns " (did you mean 'NAME'?)" with the name that is nearest to the typed one; empty where
/// none is near: more than a third of the characters would have to be inserted, deleted, changed or
/// swapped.
[[nodiscard]] std::string suggest_name(std::string_view typed,
                                       std::span<const std::string_view> names);

/// Makes one word for a POSIX shell of the text, in quotation marks where it needs them.
[[nodiscard]] std::string quote_for_shell(std::string_view text);

}  // namespace panonav
