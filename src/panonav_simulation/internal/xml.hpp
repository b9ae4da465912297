#pragma once

#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace panonav::simulation {

/// Parses an XML text with pugixml, tolerating the faults of files written by hand: `--` in
/// comments, a lone `&`, UTF-16, text after the root. Document types are skipped, and entities
/// other than the five of XML and numbered ones are kept as text. Throws Error, with the line if it
/// is known, if the text is not XML, is nested more than 200 deep or has more than 1,000,000
/// elements.
[[nodiscard]] pugi::xml_document parse_xml(std::string_view text);

/// Returns the text of an element without the text of its children, trimmed of surrounding blanks.
[[nodiscard]] std::string element_text(pugi::xml_node element);

/// Returns the text of the first child `name`; without such a child the attribute `name`; else "".
[[nodiscard]] std::string child_text(pugi::xml_node element, const char* name);

/// Parses finite numbers separated by blanks; `nullopt` if the text contains anything else.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view text);

}  // namespace panonav::simulation
