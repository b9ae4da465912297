#include "panonav_simulation/internal/xml.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <pugixml.hpp>

#include "panonav/core/error.hpp"

namespace panonav::simulation {

namespace {

constexpr std::string_view blanks = " \t\r\n";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

constexpr int max_depth = 200;
constexpr int max_elements = 1000000;

XmlElement element_of(const pugi::xml_node& node, int depth, int& elements) {
  if (depth > max_depth) throw Error("elements are nested more than 200 deep");
  if (++elements > max_elements) throw Error("has more than 1000000 elements");
  XmlElement element;
  element.name = node.name();
  for (const pugi::xml_attribute& attribute : node.attributes()) {
    element.attributes.emplace_back(attribute.name(), attribute.value());
  }
  for (const pugi::xml_node& child : node) {
    if (child.type() == pugi::node_element) {
      element.children.push_back(element_of(child, depth + 1, elements));
    } else {
      element.text += child.value();
    }
  }
  element.text = std::string(trimmed(element.text));
  return element;
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '&':
        result += "&amp;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

void append_xml(std::string& result, const XmlElement& element) {
  result += "<" + element.name;
  for (const auto& [name, value] : element.attributes)
    result += " " + name + "=\"" + escaped(value) + "\"";
  result += ">" + escaped(element.text);
  for (const XmlElement& child : element.children) append_xml(result, child);
  result += "</" + element.name + ">";
}

}  // namespace

const XmlElement* XmlElement::child(std::string_view child_name) const {
  const auto found = std::find_if(children.begin(), children.end(),
                                  [&](const XmlElement& e) { return e.name == child_name; });
  return found == children.end() ? nullptr : &*found;
}

std::string_view XmlElement::attribute(std::string_view attribute_name) const {
  const auto found = std::find_if(attributes.begin(), attributes.end(),
                                  [&](const auto& a) { return a.first == attribute_name; });
  return found == attributes.end() ? std::string_view{} : std::string_view(found->second);
}

std::string_view XmlElement::value(std::string_view value_name) const {
  const XmlElement* found = child(value_name);
  return found != nullptr ? std::string_view(found->text) : attribute(value_name);
}

XmlElement parse_xml(std::string_view text) {
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) {
    const auto seen = text.substr(0, static_cast<std::size_t>(parsed.offset));
    throw Error("line " + std::to_string(1 + std::count(seen.begin(), seen.end(), '\n')) + ": " +
                parsed.description());
  }
  int elements = 0;
  return element_of(document.document_element(), 1, elements);
}

std::string to_xml(const XmlElement& element) {
  std::string result;
  append_xml(result, element);
  return result;
}

std::optional<std::vector<double>> numbers_of(std::string_view text) {
  std::vector<double> numbers;
  for (std::size_t at = 0; (at = text.find_first_not_of(blanks, at)) != std::string_view::npos;) {
    const auto end = std::min(text.find_first_of(blanks, at), text.size());
    if (text[at] == '+') ++at;
    double value = 0.0;
    const auto [stop, error] = std::from_chars(text.data() + at, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end || !std::isfinite(value))
      return std::nullopt;
    numbers.push_back(value);
    at = end;
  }
  return numbers;
}

}  // namespace panonav::simulation
