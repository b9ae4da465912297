#pragma once

#include <optional>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace panonav::simulation {

/// Parses an XML text, as forgiving as files of people need it (pugixml): `--` in comments, a lone
/// `&`, a UTF-16 file, words after the root. Document types are skipped, entities beyond the five
/// of XML and the numbered ones stay as they are written. Throws Error, with the line where it is
/// known, on what is not XML, is nested more than 200 deep or has more than 1,000,000 elements.
[[nodiscard]] pugi::xml_document parse_xml(std::string_view text);

/// Returns the text of an element without that of its children; blanks around it are left out.
[[nodiscard]] std::string element_text(pugi::xml_node element);

/// Returns the text of the first child of this name, else the attribute of this name, else "".
[[nodiscard]] std::string child_text(pugi::xml_node element, const char* name);

/// Returns the finite numbers that a text consists of, separated by blanks; `nullopt` where
/// anything else stands in it.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view text);

}  // namespace panonav::simulation
