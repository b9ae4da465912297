#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace panonav {

/// Formats a number for display with this many digits after the point; a zero has no sign.
[[nodiscard]] std::string format_fixed(double value, int digits);

/// Formats a number for display, with up to `significant` digits and without exponent below 1e15:
/// 30, not 29.999999999999996. Decimal places are limited by the unit (a hundredth of a millimetre
/// for "m", a thousandth of a degree for "deg", nine places without unit). Returns "none" if the
/// number is not finite.
[[nodiscard]] std::string format_number(double value, std::string_view unit = {},
                                        int significant = 6);

/// Converts any bytes, such as an error message, to one line of valid UTF-8. Control characters,
/// including those that change the writing direction, become spaces; bytes that are not UTF-8
/// become escapes as in `escape_name`.
[[nodiscard]] std::string to_readable_line(std::string_view text);

/// Converts a file name to valid UTF-8, from which `unescape_name` restores it: each byte that is
/// not UTF-8 becomes "%" and two hexadecimal digits (0xFC: "%FC"). A "%" before "25" or before the
/// digits of such an escape becomes "%25"; all other text is unchanged. Different names stay
/// different.
[[nodiscard]] std::string escape_name(std::string_view name);
/// Restores the bytes of a name that `escape_name` has converted.
[[nodiscard]] std::string unescape_name(std::string_view escaped);

/// True if the text is valid UTF-8.
[[nodiscard]] bool is_utf8(std::string_view text);

/// Decodes the percent escapes of a URL: "%41" becomes "A". nullopt if a "%" is not followed by two
/// hexadecimal digits, or on "%00", which no name contains.
[[nodiscard]] std::optional<std::string> decode_percent(std::string_view text);

/// Converts ASCII letters to lower case; all other bytes are unchanged.
[[nodiscard]] std::string to_lower_case(std::string_view text);

/// Compares file names as people order them: digits as numbers ("view_9" before "view_10"), all
/// other text byte by byte.
[[nodiscard]] bool is_naturally_less(std::string_view a, std::string_view b);

/// Quotes a field for a CSV file if it contains a comma, a quote, a `#` or a line break, is empty,
/// or begins or ends with a blank.
[[nodiscard]] std::string to_csv_field(std::string_view text);

/// Escapes a CSV field for spreadsheets: a text that a spreadsheet would evaluate as a formula
/// (beginning with =, +, -, @ or a tab) gets a leading apostrophe, which panonav's readers do not
/// remove.
[[nodiscard]] std::string to_sheet_field(std::string_view text);

/// Replaces the middle of a valid UTF-8 text by "..." if it has more than `max_characters` (>= 8)
/// characters.
[[nodiscard]] std::string shorten_middle(std::string_view text, std::size_t max_characters);

/// Returns " (did you mean 'NAME'?)" with the name nearest to `typed` in edit distance; empty if
/// all names differ by more than a third of the typed characters (by more than 1 if these are few).
[[nodiscard]] std::string suggest_name(std::string_view typed,
                                       std::span<const std::string_view> names);

/// Quotes a text as one word for a POSIX shell, if it needs quotes.
[[nodiscard]] std::string quote_for_shell(std::string_view text);

}  // namespace panonav
