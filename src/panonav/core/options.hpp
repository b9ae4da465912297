#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

namespace panonav {

/// Name, help and range of one option. Each option is defined once, as a member of its module's
/// options struct, and listed in the `OptionTable` of that struct, from which the command line,
/// TOML files and bindings are derived.
struct OptionInfo {
  /// Lower bound of a range; converts implicitly from a number, which is then allowed itself.
  struct Low {
    double value = -std::numeric_limits<double>::infinity();  ///< the bound
    bool is_open = false;                                     ///< the bound itself is not allowed
    constexpr Low() = default;                                ///< No bound.
    /// Makes a bound; the bound itself is allowed unless `is_open`.
    constexpr Low(double bound, bool is_open_ = false)
        : value(bound), is_open(is_open_) {}  // NOLINT
  };
  std::string_view name;  ///< name of the member: snake_case, with its unit
  std::string_view help;  ///< one plain line
  double low = -std::numeric_limits<double>::infinity();  ///< smallest allowed value
  double high = std::numeric_limits<double>::infinity();  ///< largest allowed value
  bool low_open = false;                                  ///< `low` itself is not allowed
};

/// Visits the members of an options struct. Each options struct `T` has a function `void
/// visit_options(T&, OptionVisitor&)`, which visits all entries of its `OptionTable`.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  /// Visits an int. A visitor may change `value`, and must check the range of `info` itself.
  virtual void visit(const OptionInfo& info, int& value) = 0;
  /// Visits a double, in the unit in which the member's name ends.
  virtual void visit(const OptionInfo& info, double& value) = 0;
  /// Visits a bool, which has no range.
  virtual void visit(const OptionInfo& info, bool& value) = 0;
  /// Visits a choice; `value` is an index into `choices`.
  virtual void visit(const OptionInfo& info, std::span<const std::string_view> choices,
                     int& value) = 0;
};

/// Describes the allowed range: ">= 1 and <= 20".
[[nodiscard]] std::string describe_range(const OptionInfo& info);

/// Describes a value that is out of its range or not a number; nullopt when it is valid.
[[nodiscard]] std::optional<std::string> find_option_fault(const OptionInfo& info, double value);

namespace detail {
/// Throws OptionError that lists the invalid values among all options that `visit` visits, if there
/// are any.
void require_valid(const std::function<void(OptionVisitor&)>& visit);

/// Returns the member's name, extracted from the compiler's text for &Options::member in
/// __PRETTY_FUNCTION__.
template <auto member>
constexpr std::string_view member_name() {
  std::string_view text = __PRETTY_FUNCTION__;
  text = text.substr(text.find("member = &"));
  text = text.substr(0, text.find_first_of(";]"));
  return text.substr(text.rfind(':') + 1);
}

template <class Options, class Value>
Options options_with(Value Options::*);
template <auto member>
using OptionsWith = decltype(options_with(member));

struct ConvertibleToAny {
  template <class Value>
  operator Value() const;  // NOLINT: only declared, never called
};

/// Number of members of the aggregate: the largest number that braces can initialise.
template <class Options, class... Members>
consteval std::size_t member_count() {
  if constexpr (requires { Options{Members{}..., ConvertibleToAny{}}; }) {
    return member_count<Options, Members..., ConvertibleToAny>();
  } else {
    return sizeof...(Members);
  }
}

/// One member in an `OptionTable`. If `is_listed` is false, visitors skip it.
template <auto member, std::size_t choice_count, bool is_listed = true>
struct OptionEntry {
  using Options = OptionsWith<member>;
  static constexpr std::string_view name = member_name<member>();
  OptionInfo info = {.name = name, .help = {}};
  std::array<std::string_view, choice_count> choices = {};

  void visit(Options& options, OptionVisitor& visitor) const {
    using Value = std::remove_cvref_t<decltype(options.*member)>;
    if constexpr (choice_count > 0) {
      int value = static_cast<int>(options.*member);
      visitor.visit(info, choices, value);
      options.*member = static_cast<Value>(value);
    } else if constexpr (is_listed && std::is_arithmetic_v<Value>) {
      visitor.visit(info, options.*member);
    } else if constexpr (is_listed) {
      visit_options(options.*member, visitor);
    }
  }
};

}  // namespace detail

/// Makes an open lower bound, so that values must be greater than `low`: `option<&T::step_m>("...",
/// above(0), 100)`.
constexpr OptionInfo::Low above(double low) {
  return {low, true};
}

/// Makes the table entry of a number or a bool.
template <auto member>
constexpr auto option(std::string_view help, OptionInfo::Low low = {},
                      double high = std::numeric_limits<double>::infinity()) {
  detail::OptionEntry<member, 0> entry;
  entry.info = {entry.name, help, low.value, high, low.is_open};
  return entry;
}

/// Makes the table entry of an enum or int that is an index into `choices`.
template <auto member, std::size_t count>
constexpr auto option(std::string_view help, const std::array<std::string_view, count>& choices) {
  detail::OptionEntry<member, count> entry;
  entry.info.help = help;
  entry.choices = choices;
  return entry;
}
/// Makes the table entry of an enum, with the names of its values in order.
template <auto member, class... Names>
constexpr auto choice(std::string_view help, Names... choices) {
  return option<member>(help, std::array<std::string_view, sizeof...(Names)>{choices...});
}

/// Makes the table entry of a nested options struct; its options are visited in turn.
template <auto member>
constexpr auto options_of() {
  return detail::OptionEntry<member, 0>();
}

/// Makes the table entry of a member that is not an option, with the reason.
template <auto member>
constexpr auto no_option(std::string_view /*reason*/) {
  return detail::OptionEntry<member, 0, false>();
}

/// Lists every member of an options struct exactly once, in
/// display order; a missing or repeated member is a compile error:
///
///     constexpr OptionTable table{
///         option<&SearchOptions::radius_m>("how far", above(0), 100),
///         choice<&SearchOptions::norm>("which sum", "l1", "l2"),
///     };
template <class... Entries>
class OptionTable {
 public:
  /// The struct whose members the entries name.
  using Options = typename std::tuple_element_t<0, std::tuple<Entries...>>::Options;

  /// The entries in the order in which help shows them.
  constexpr explicit OptionTable(const Entries&... entries) : entries_(entries...) {}

  /// Passes each option to `visitor` in the order of the entries, including the options of nested
  /// structs.
  void visit(Options& options, OptionVisitor& visitor) const {
    std::apply([&](const auto&... entry) { (entry.visit(options, visitor), ...); }, entries_);
  }

 private:
  static consteval bool has_unique_names() {
    const std::array<std::string_view, sizeof...(Entries)> names{Entries::name...};
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (names[i] == names[j]) return false;
      }
    }
    return true;
  }
  static_assert(
      detail::member_count<Options>() == sizeof...(Entries),
      "each member has one entry: option, choice, options_of, or no_option with a reason");
  static_assert(has_unique_names(), "no member has two entries");
  std::tuple<Entries...> entries_;
};

/// Throws OptionError that lists all faults of `options`: field, value, allowed range.
template <class Options>
void validate(const Options& options) {
  Options copy = options;
  detail::require_valid([&copy](OptionVisitor& visitor) { visit_options(copy, visitor); });
}

}  // namespace panonav
