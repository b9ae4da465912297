#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panonav::simulation {

/// An element of an XML file. Text between children is put together; blanks around it are left out.
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;
  std::vector<XmlElement> children;

  /// The first child of this name; null when there is none.
  [[nodiscard]] const XmlElement* child(std::string_view child_name) const;
  /// Its value; empty when there is none.
  [[nodiscard]] std::string_view attribute(std::string_view attribute_name) const;
  /// Text of the first child of this name, else the attribute of this name, else empty.
  [[nodiscard]] std::string_view value(std::string_view value_name) const;
};

/// The root element of an XML text. As forgiving as files of people need it (pugixml): `--` in
/// comments, a lone `&`, a UTF-16 file, words after the root. Document types are skipped, entities
/// beyond the five of XML and the numbered ones stay as they are written. Throws Error, with the
/// line where it is known, on what is not XML, is nested more than 200 deep or has more than
/// 1,000,000 elements.
[[nodiscard]] XmlElement parse_xml(std::string_view text);

/// XML that parses to the same element.
[[nodiscard]] std::string to_xml(const XmlElement& element);

/// The finite numbers that a text consists of, separated by blanks; empty where anything else
/// stands in it.
[[nodiscard]] std::optional<std::vector<double>> numbers_of(std::string_view text);

}  // namespace panonav::simulation
