#include "bindings.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"

namespace panonav::python {

namespace {

/// Takes the given values of the options that it visits.
class Taker final : public OptionVisitor {
 public:
  Taker(py::dict& given, std::vector<std::string>& known, std::string prefix)
      : given_(given), known_(known), prefix_(std::move(prefix)) {}

  void visit(const OptionInfo& info, int& value) override {
    take(info, value, "whole numbers " + describe_range(info));
  }
  void visit(const OptionInfo& info, double& value) override {
    take(info, value, "numbers " + describe_range(info));
  }
  void visit(const OptionInfo& info, bool& value) override {
    const auto [name, given] = find(info);
    if (!given) return;
    if (!py::isinstance<py::bool_>(given)) refuse(name, given, "True, False");
    value = given.cast<bool>();
  }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    const auto [name, given] = find(info);
    if (!given) return;
    std::string all;
    for (std::size_t i = 0; i < choices.size(); ++i) {
      if (py::isinstance<py::str>(given) && given.cast<std::string>() == choices[i]) {
        value = static_cast<int>(i);
        return;
      }
      all += (all.empty() ? "'" : ", '") + std::string(choices[i]) + "'";
    }
    refuse(name, given, all);
  }

 private:
  std::pair<std::string, py::object> find(const OptionInfo& info) {
    const std::string name = prefix_ + std::string(info.name);
    known_.push_back(name);
    return {name, given_.contains(name) ? given_.attr("pop")(name) : py::object()};
  }
  [[noreturn]] static void refuse(const std::string& name, const py::handle& given,
                                  const std::string& allowed) {
    throw ContractError(name, std::string(py::repr(given)), allowed);
  }
  template <class Number>
  void take(const OptionInfo& info, Number& value, const std::string& allowed) {
    const auto [name, given] = find(info);
    if (!given) return;
    py::detail::make_caster<Number> number;
    if (py::isinstance<py::bool_>(given) || !number.load(given, true)) refuse(name, given, allowed);
    value = number;
  }

  py::dict& given_;
  std::vector<std::string>& known_;
  std::string prefix_;
};

std::string joined(const std::string& prefix) {
  return prefix.empty() ? "" : prefix + "_";
}

/// A line of a docstring for each option.
class Lister final : public OptionVisitor {
 public:
  Lister(std::string& text, std::string prefix) : text_(text), prefix_(std::move(prefix)) {}
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

Keywords::Keywords(const py::kwargs& given) : all_(given), given_(given.attr("copy")()) {}

void Keywords::apply(const std::string& prefix, const std::function<void(OptionVisitor&)>& visit) {
  Taker taker(given_, known_, joined(prefix));
  visit(taker);
}

void Keywords::finish() const {
  if (given_.empty()) return;
  const auto name = py::str(given_.begin()->first);
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

std::string with_options(const std::string& text, const std::vector<ListedOptions>& listed) {
  std::string all = text + "\n\nOptions:";
  for (const ListedOptions& options : listed) {
    Lister lister(all, joined(options.prefix));
    options.visit(lister);
  }
  return all;
}

}  // namespace panonav::python
