#include "panonav/simulation/internal/xml.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

constexpr std::string_view blanks = " \t\r\n";

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) + 1 - first);
}

bool is_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == ':' || c == '-' || c == '.' || static_cast<unsigned char>(c) >= 0x80U;
}

void append_utf8(std::string& text, std::uint32_t code) {
  if (code < 0x80U) {
    text += static_cast<char>(code);
    return;
  }
  const int tail = code < 0x800U ? 1 : code < 0x10000U ? 2 : 3;
  constexpr std::array<std::uint32_t, 4> lead{0U, 0xC0U, 0xE0U, 0xF0U};
  text += static_cast<char>(lead[static_cast<std::size_t>(tail)] | (code >> (6 * tail)));
  for (int i = tail - 1; i >= 0; --i)
    text += static_cast<char>(0x80U | ((code >> (6 * i)) & 0x3FU));
}

// One entity without its `&` and `;`; false when it is none that XML knows.
bool append_entity(std::string& text, std::string_view entity) {
  for (const auto& [name, character] : {std::pair<std::string_view, char>{"lt", '<'},
                                        {"gt", '>'},
                                        {"amp", '&'},
                                        {"quot", '"'},
                                        {"apos", '\''}}) {
    if (entity != name) continue;
    text += character;
    return true;
  }
  if (entity.size() < 2 || entity.front() != '#') return false;
  const bool hexadecimal = entity[1] == 'x';
  const std::string_view digits = entity.substr(hexadecimal ? 2 : 1);
  std::uint32_t code = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), code, hexadecimal ? 16 : 10);
  if (error != std::errc() || end != digits.data() + digits.size()) return false;
  if (code == 0 || code > 0x10FFFFU) return false;
  append_utf8(text, code);
  return true;
}

std::string unescaped(std::string_view text) {
  std::string result;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '&') {
      const auto end = text.substr(at, 12).find(';');
      if (end != std::string_view::npos && append_entity(result, text.substr(at + 1, end - 1))) {
        at += end;
        continue;
      }
    }
    result += text[at];
  }
  return result;
}

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  XmlElement parse() {
    while (true) {
      const auto tag = std::min(text_.find('<', at_), text_.size());
      add_text(unescaped(text_.substr(at_, tag - at_)));
      at_ = tag;
      if (at_ == text_.size())
        fail(open_.empty() ? "has no element" : "<" + open_.back().name + "> is not closed");
      if (skip("<!--", "-->") || skip("<?", "?>") || character_data()) continue;
      if (starts_with("<!")) {
        document_type();
      } else if (starts_with("</")) {
        if (auto root = close()) return std::move(*root);
      } else if (auto root = open()) {
        return std::move(*root);
      }
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const auto seen = text_.substr(0, at_);
    throw Error("line " + std::to_string(1 + std::count(seen.begin(), seen.end(), '\n')) + ": " +
                what);
  }
  [[nodiscard]] bool starts_with(std::string_view what) const {
    return text_.substr(at_, what.size()) == what;
  }

  void add_text(std::string_view part) {
    if (!open_.empty()) open_.back().text += part;
  }

  void go_behind(std::string_view what) {
    const auto end = text_.find(what, at_);
    if (end == std::string_view::npos) fail("\"" + std::string(what) + "\" is missing");
    at_ = end + what.size();
  }

  bool skip(std::string_view begin, std::string_view end) {
    if (!starts_with(begin)) return false;
    at_ += begin.size();
    go_behind(end);
    return true;
  }

  bool character_data() {
    constexpr std::string_view begin = "<![CDATA[";
    if (!starts_with(begin)) return false;
    at_ += begin.size();
    const std::size_t first = at_;
    go_behind("]]>");
    add_text(text_.substr(first, at_ - 3 - first));
    return true;
  }

  void document_type() {
    const auto end = text_.find_first_of("[>", at_);
    if (end != std::string_view::npos && text_[end] == '[') go_behind("]");
    go_behind(">");
  }

  std::string name() {
    const std::size_t first = at_;
    while (at_ < text_.size() && is_name(text_[at_])) ++at_;
    if (at_ == first) fail("a name is missing after \"<\" or between attributes");
    return std::string(text_.substr(first, at_ - first));
  }

  void skip_blanks() { at_ = std::min(text_.find_first_not_of(blanks, at_), text_.size()); }

  std::string attribute_value() {
    skip_blanks();
    if (!starts_with("=")) fail("an attribute has no value");
    ++at_;
    skip_blanks();
    const char quote = at_ < text_.size() ? text_[at_] : ' ';
    if (quote != '"' && quote != '\'') fail("an attribute's value is not in quotation marks");
    const std::size_t first = ++at_;
    go_behind(std::string_view(&quote, 1));
    return unescaped(text_.substr(first, at_ - 1 - first));
  }

  // The element at a "<"; the root where it is complete with this.
  std::optional<XmlElement> open() {
    constexpr std::size_t max_depth = 200;
    constexpr int max_elements = 1000000;
    if (open_.size() == max_depth) fail("elements are nested more than 200 deep");
    if (++elements_ > max_elements) fail("has more than 1000000 elements");
    ++at_;
    XmlElement element;
    element.name = name();
    while (true) {
      skip_blanks();
      const bool empty = starts_with("/>");
      if (empty || starts_with(">")) {
        at_ += empty ? 2 : 1;
        open_.push_back(std::move(element));
        return empty ? finish() : std::nullopt;
      }
      std::string attribute = name();
      std::string value = attribute_value();
      element.attributes.emplace_back(std::move(attribute), std::move(value));
    }
  }

  std::optional<XmlElement> close() {
    at_ += 2;
    const std::string closed = name();
    skip_blanks();
    if (open_.empty() || open_.back().name != closed) fail("</" + closed + "> closes nothing");
    if (!starts_with(">")) fail("</" + closed + " has no \">\"");
    ++at_;
    return finish();
  }

  std::optional<XmlElement> finish() {
    XmlElement element = std::move(open_.back());
    open_.pop_back();
    element.text = std::string(trimmed(element.text));
    if (open_.empty()) return element;
    open_.back().children.push_back(std::move(element));
    return std::nullopt;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int elements_ = 0;
  std::vector<XmlElement> open_;
};

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
  return Parser(text).parse();
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

}  // namespace panonav
