#include "panonav/io/internal/yaml_fields.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/internal/csv_table.hpp"

namespace panonav {
namespace {

constexpr std::size_t max_depth = 16;

std::string_view unquote(std::string_view text) {
  const bool is_quoted = text.size() >= 2 && (text.front() == '"' || text.front() == '\'') &&
                         text.back() == text.front();
  return is_quoted ? text.substr(1, text.size() - 2) : text;
}

/// Removes a comment, which begins with # at the start or after a blank, outside of quotes.
std::string_view remove_comment(std::string_view line) {
  char quote = '\0';
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote != '\0') {
      if (line[i] == quote) quote = '\0';
    } else if (line[i] == '"' || line[i] == '\'') {
      quote = line[i];
    } else if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) {
      return line.substr(0, i);
    }
  }
  return line;
}

/// Removes tags such as !!opencv-matrix.
std::string_view remove_tag(std::string_view value) {
  while (value.starts_with('!') || value.starts_with('&')) {
    value = trim_blanks(value.substr(std::min(value.find(' '), value.size())));
  }
  return value;
}

/// Appends the items of a list; brackets of lists within are ignored.
void append_items(std::string_view text, std::vector<std::string>& items) {
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const bool is_end = i == text.size() || text[i] == ',' || text[i] == '[' || text[i] == ']';
    if (!is_end) continue;
    const std::string_view item = unquote(trim_blanks(text.substr(begin, i - begin)));
    if (!item.empty()) items.emplace_back(item);
    begin = i + 1;
  }
}

std::ptrdiff_t count_open_brackets(std::string_view text) {
  return std::ranges::count(text, '[') - std::ranges::count(text, ']');
}

/// Parses the lines of a file into values by path.
class LineParser {
 public:
  LineParser(const std::filesystem::path& path,
             std::map<std::string, std::vector<std::string>>& values)
      : path_(path), values_(values) {}

  void add(std::string_view line) {
    ++number_;
    const std::string_view text = remove_comment(line);
    const std::string_view content = trim_blanks(text);
    if (content.empty() || content.starts_with('%') || content == "---" || content == "...") return;
    if (list_ != nullptr) return append_to_list(content);
    const std::size_t indent = text.find_first_not_of(' ');
    if (content == "-" || content.starts_with("- ")) return add_item(indent, content);
    add_field(indent, content);
  }

  void finish() const {
    if (list_ != nullptr) {
      throw FileError(path_.string(), "a list is not closed at the end; allowed: [ ... ]");
    }
  }

 private:
  struct Level {
    std::size_t indent = 0;
    std::string name;
  };

  void append_to_list(std::string_view content) {
    append_items(content, *list_);
    open_ += count_open_brackets(content);
    if (open_ <= 0) list_ = nullptr;
  }

  void begin_list(const std::string& name, std::string_view content) {
    open_ = 0;
    list_ = &values_[name];
    append_to_list(content);
  }

  void add_item(std::size_t indent, std::string_view content) {
    while (!levels_.empty() && levels_.back().indent > indent) levels_.pop_back();
    while (content.starts_with('-') && (content.size() == 1 || content[1] == ' ')) {
      content = trim_blanks(content.substr(1));
    }
    if (content.starts_with('[')) return begin_list(join_path(), content);
    if (!content.empty()) values_[join_path()].emplace_back(unquote(content));
  }

  void add_field(std::size_t indent, std::string_view content) {
    while (!levels_.empty() && levels_.back().indent >= indent) levels_.pop_back();
    std::size_t colon = content.find(':');
    while (colon != content.npos && colon + 1 < content.size() && content[colon + 1] != ' ') {
      colon = content.find(':', colon + 1);
    }
    if (colon == content.npos || colon == 0 || levels_.size() >= max_depth) {
      throw FileError(path_.string(), "line " + std::to_string(number_) +
                                          " is not YAML of a camera calibration; allowed: "
                                          "'name: value', '- value', at most 16 levels");
    }
    levels_.push_back({indent, std::string(unquote(trim_blanks(content.substr(0, colon))))});
    const std::string_view value = remove_tag(trim_blanks(content.substr(colon + 1)));
    if (value.empty()) return;
    values_[join_path()].clear();
    if (value.starts_with('[')) return begin_list(join_path(), value);
    values_[join_path()] = {std::string(unquote(value))};
  }

  [[nodiscard]] std::string join_path() const {
    std::string path;
    for (const Level& level : levels_) path += (path.empty() ? "" : ".") + level.name;
    return path;
  }

  const std::filesystem::path& path_;
  std::map<std::string, std::vector<std::string>>& values_;
  std::size_t number_ = 0;
  std::vector<Level> levels_;
  std::vector<std::string>* list_ = nullptr;  ///< a list whose bracket is open
  std::ptrdiff_t open_ = 0;
};

}  // namespace

YamlFields::YamlFields(std::filesystem::path path, std::string_view text) : path_(std::move(path)) {
  LineParser parser(path_, values_);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    parser.add(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  parser.finish();
}

std::vector<std::string> YamlFields::top_names() const {
  std::vector<std::string> names;
  for (const auto& [path, values] : values_) {
    std::string name = path.substr(0, path.find('.'));
    if (names.empty() || names.back() != name) names.push_back(std::move(name));
  }
  return names;
}

std::optional<std::string> YamlFields::text(const std::string& name) const {
  const auto found = values_.find(name);
  if (found == values_.end() || found->second.size() != 1) return std::nullopt;
  return found->second.front();
}

std::string YamlFields::find_name(const std::vector<std::string>& names) const {
  const auto found = std::ranges::find_if(names, [&](const auto& name) { return has(name); });
  return found == names.end() ? names.front() : *found;
}

std::vector<double> YamlFields::numbers(const std::string& name) const {
  std::vector<double> result;
  const auto found = values_.find(name);
  if (found == values_.end()) return result;
  for (std::string text : found->second) {
    if (text.ends_with('.')) text += '0';  // OpenCV writes 0.
    double value = 0.0;
    const std::string_view digits = std::string_view(text).substr(text.starts_with('+') ? 1 : 0);
    if (!read_number(digits, value) || !std::isfinite(value)) {
      fail(name, shorten_middle(to_readable_line(text), 40), "finite numbers");
    }
    result.push_back(value);
  }
  return result;
}

std::vector<double> YamlFields::numbers(const std::string& name, std::size_t count) const {
  auto result = numbers(name);
  if (result.size() != count) {
    fail(name, result.empty() ? "missing" : format_count(result.size(), "number"),
         format_count(count, "number"));
  }
  return result;
}

void YamlFields::fail(const std::string& name, std::string_view found,
                      std::string_view allowed) const {
  throw FileError(path_.string(), to_readable_line(name) + " is " + to_readable_line(found) +
                                      "; allowed: " + std::string(allowed));
}

}  // namespace panonav
