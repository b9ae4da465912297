#include "panonav/io/option_file.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/internal/toml_fields.hpp"

namespace panonav {

namespace {

template <class Table>  // const or not const
auto find_section(Table& table, std::string_view section) {
  const auto found = std::ranges::find(table, section, &TomlField::name);
  return found == table.end() ? nullptr : std::get_if<TomlTable>(&found->value.content);
}

class OptionReader final : public OptionVisitor {
 public:
  OptionReader(const std::filesystem::path& path, std::string_view section, const TomlTable& table)
      : path_(path),
        where_("[" + std::string(section) + "] "),
        fields_(path, std::string(section), table) {}

  void visit(const OptionInfo& info, int& value) override {
    const auto found = fields_.integer(info.name);
    if (!found) return;
    check(info, static_cast<double>(*found));
    if (*found < std::numeric_limits<int>::min() || *found > std::numeric_limits<int>::max()) {
      fields_.fail(info.name, std::to_string(*found), "a whole number below 2^31");
    }
    value = static_cast<int>(*found);
  }
  void visit(const OptionInfo& info, double& value) override {
    const auto found = fields_.number(info.name);
    if (!found) return;
    check(info, *found);
    value = *found;
  }
  void visit(const OptionInfo& info, bool& value) override {
    value = fields_.boolean(info.name).value_or(value);
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    if (const auto found = fields_.choice(info.name, choices)) value = static_cast<int>(*found);
  }
  void finish() const { fields_.finish(); }

 private:
  void check(const OptionInfo& info, double value) const {
    if (const auto fault = find_option_fault(info, value)) {
      throw FileError(path_.string(), where_ + *fault);
    }
  }
  const std::filesystem::path& path_;
  std::string where_;
  TomlFields fields_;
};

}  // namespace

std::string quote_for_toml(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (byte < ' ' || byte == 0x7F) {
      result += "\\u00";
      result += digits[byte >> 4U];
      result += digits[byte & 15U];
    } else {
      result += c;
    }
  }
  return result + "\"";
}

OptionFile::OptionFile(std::filesystem::path path)
    : path_(std::move(path)), table_(read_toml(path_)) {
  for (const TomlField& field : table_) {
    if (!std::holds_alternative<TomlTable>(field.value.content)) {
      throw FileError(
          path_.string(),
          field.name +
              " is outside of all sections; allowed: options below a section name, [name]");
    }
  }
}

OptionFile::~OptionFile() = default;
OptionFile::OptionFile(OptionFile&&) noexcept = default;
OptionFile& OptionFile::operator=(OptionFile&&) noexcept = default;

void OptionFile::apply(std::string_view section, const std::function<void(OptionVisitor&)>& visit) {
  const TomlTable* table = find_section(table_, section);
  if (table == nullptr) return;
  OptionReader reader(path_, section, *table);
  visit(reader);
  reader.finish();
}

std::optional<std::string> OptionFile::take_text(std::string_view section, std::string_view field) {
  TomlTable* table = find_section(table_, section);
  if (table == nullptr) return std::nullopt;
  TomlFields fields(path_, std::string(section), *table);
  auto text = fields.text(field);
  std::erase_if(*table, [&](const TomlField& each) { return each.name == field; });
  return text;
}

bool OptionFile::has(std::string_view section, std::string_view field) const {
  const TomlTable* table = find_section(table_, section);
  return table != nullptr && std::ranges::find(*table, field, &TomlField::name) != table->end();
}

void OptionFile::require_sections(std::span<const std::string_view> own,
                                  std::span<const std::string_view> others) const {
  for (const TomlField& field : table_) {
    if (std::ranges::find(own, field.name) != own.end()) continue;
    if (std::ranges::find(others, field.name) != others.end()) continue;
    std::string all;
    for (const auto name : own) all += (all.empty() ? "" : ", ") + std::string(name);
    throw FileError(path_.string(), "[" + to_readable_line(field.name) +
                                        "] is not a known section" + suggest_name(field.name, own) +
                                        "; known: " + (all.empty() ? "none" : all));
  }
}

}  // namespace panonav
