#include "bindings.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::python {

namespace {

/// Reads the keyword arguments of the options that it visits.
class KeywordReader final : public OptionVisitor {
 public:
  KeywordReader(py::dict& argument, std::vector<std::string>& known, std::string prefix)
      : unread_(argument), known_(known), prefix_(std::move(prefix)) {}

  void visit(const OptionInfo& info, int& value) override {
    read(info, value, "whole numbers " + describe_range(info));
  }
  void visit(const OptionInfo& info, double& value) override {
    read(info, value, "numbers " + describe_range(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    const auto [name, argument] = find(info);
    if (!argument) return;
    if (!py::isinstance<py::bool_>(argument)) refuse(name, argument, "True, False");
    value = argument.cast<bool>();
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    const auto [name, argument] = find(info);
    if (!argument) return;
    std::string all;
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (py::isinstance<py::str>(argument) && argument.cast<std::string>() == choices[i]) {
        value = static_cast<int>(i);
        return;
      }
      all += (all.empty() ? "'" : ", '") + std::string(choices[i]) + "'";
    }
    refuse(name, argument, all);
  }

 private:
  std::pair<std::string, py::object> find(const OptionInfo& info) {
    const std::string name = prefix_ + std::string(info.name);
    known_.push_back(name);
    return {name, unread_.contains(name) ? unread_.attr("pop")(name) : py::object()};
  }
  [[noreturn]] static void refuse(const std::string& name, const py::handle& argument,
                                  const std::string& allowed) {
    throw ContractError(name, std::string(py::repr(argument)), allowed);
  }
  template <class Number>
  void read(const OptionInfo& info, Number& value, const std::string& allowed) {
    const auto [name, argument] = find(info);
    if (!argument) return;
    py::detail::make_caster<Number> number;
    if (py::isinstance<py::bool_>(argument) || !number.load(argument, true))
      refuse(name, argument, allowed);
    value = number;
  }

  py::dict& unread_;
  std::vector<std::string>& known_;
  std::string prefix_;
};

std::string make_name_prefix(const std::string& prefix) {
  return prefix.empty() ? "" : prefix + "_";
}

/// Appends the description of each option that it visits to a docstring.
class DocstringLister final : public OptionVisitor {
 public:
  DocstringLister(std::string& text, std::string prefix)
      : text_(text), prefix_(std::move(prefix)) {}
  void visit(const OptionInfo& info, int& value) override {
    list(info, "int", std::to_string(value), describe_range(info));
  }
  void visit(const OptionInfo& info, double& value) override {
    list(info, "float", to_text(value), describe_range(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    list(info, "bool", value ? "True" : "False", "");
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    std::string all;
    for (const auto choice : choices)
      all += (all.empty() ? "'" : ", '") + std::string(choice) + "'";
    list(info, "str", "'" + std::string(choices[static_cast<std::size_t>(value)]) + "'", all);
  }

 private:
  void list(const OptionInfo& info, const char* type, const std::string& value,
            const std::string& allowed) {
    text_ += "\n    " + prefix_ + std::string(info.name) + ": " + type + " = " + value +
             "\n        " + std::string(info.help) +
             (allowed.empty() ? "" : "; allowed: " + allowed);
  }
  std::string& text_;
  std::string prefix_;
};

}  // namespace

Keywords::Keywords(const py::kwargs& argument) : all_(argument), unread_(argument.attr("copy")()) {}

void Keywords::apply(const std::string& prefix, const std::function<void(OptionVisitor&)>& visit) {
  KeywordReader reader(unread_, known_, make_name_prefix(prefix));
  visit(reader);
}

void Keywords::finish() const {
  if (unread_.empty()) return;
  const auto name = py::str(unread_.begin()->first);
  const auto near = py::module_::import("difflib").attr("get_close_matches")(name, known_, 1);
  std::string line = "there is no option '" + std::string(name) + "'";
  if (py::len(near) > 0) {
    line += "; did you mean '" + near.cast<py::list>()[0].cast<std::string>() + "'?";
  } else {
    std::string all;
    for (const auto& one : known_) all += (all.empty() ? "" : ", ") + one;
    line += "; allowed: " + (all.empty() ? "none" : all);
  }
  throw OptionError(line);
}

std::string append_option_list(const std::string& text, const std::vector<ListedOptions>& listed) {
  std::string all = text + "\n\nOptions:";
  for (const ListedOptions& options : listed) {
    DocstringLister lister(all, make_name_prefix(options.prefix));
    options.visit(lister);
  }
  return all;
}

}  // namespace panonav::python
