#include "panonav_simulation/internal/xml.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "panonav/core/error.hpp"

namespace panonav::simulation {

namespace {

constexpr std::string_view blanks = " \t\r\n";

// Throws if a document is larger than any real world or mesh file.
class SizeCheck final : public pugi::xml_tree_walker {
 public:
  bool for_each(pugi::xml_node& node) override {
    constexpr int max_depth = 200;         // readers of worlds recurse as deeply
    constexpr int max_elements = 1000000;  // about 100 MB of nodes
    if (node.type() != pugi::node_element) return true;
    if (depth() >= max_depth) throw Error("elements are nested more than 200 deep");
    if (++elements_ > max_elements) throw Error("has more than 1000000 elements");
    return true;
  }

 private:
  int elements_ = 0;
};

}  // namespace

pugi::xml_document parse_xml(std::string_view text) {
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) {
    const auto before = text.substr(0, static_cast<std::size_t>(parsed.offset));
    throw Error("line " + std::to_string(1 + std::count(before.begin(), before.end(), '\n')) +
                ": " + parsed.description());
  }
  SizeCheck check;
  document.traverse(check);
  return document;
}

std::string element_text(pugi::xml_node element) {
  std::string text;
  for (const pugi::xml_node& child : element) {
    if (child.type() != pugi::node_element) text += child.value();
  }
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

std::string child_text(pugi::xml_node element, const char* name) {
  const pugi::xml_node child = element.child(name);
  return child ? element_text(child) : element.attribute(name).value();
}

std::optional<std::vector<double>> parse_numbers(std::string_view text) {
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
