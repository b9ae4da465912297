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

/// Name, help and range of one option. Options live once, as members of the struct of their
/// module; the command line, TOML files and bindings are derived from its `OptionTable`.
struct OptionInfo {
  /// The smallest allowed value; a number stands for itself.
  struct Low {
    double value = -std::numeric_limits<double>::infinity();  ///< the bound
    bool is_open = false;                                     ///< the bound itself is not allowed
    constexpr Low() = default;                                ///< No bound.
    /// A bound that is allowed itself unless it `is_open`.
    constexpr Low(double bound, bool is_open_ = false)
        : value(bound), is_open(is_open_) {}  // NOLINT
  };
  std::string_view name;  ///< the member's: snake_case, with its unit
  std::string_view help;  ///< one plain line
  double low = -std::numeric_limits<double>::infinity();  ///< smallest allowed value
  double high = std::numeric_limits<double>::infinity();  ///< largest allowed value
  bool low_open = false;                                  ///< `low` itself is not allowed
};

/// Visits the members of an options struct. Each options struct `T` has a function
/// `void visit_options(T&, OptionVisitor&)` beside it that holds its `OptionTable` and visits it.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  /// An int. A visitor may change `value`; it checks `info`'s range itself.
  virtual void visit(const OptionInfo& info, int& value) = 0;
  /// Visits a double, in the unit in which the member's name ends.
  virtual void visit(const OptionInfo& info, double& value) = 0;
  /// Visits a bool, which has no range.
  virtual void visit(const OptionInfo& info, bool& value) = 0;
  /// `value` is an index into `choices`.
  virtual void visit(const OptionInfo& info, std::span<const std::string_view> choices,
                     int& value) = 0;
};

/// Describes the allowed range: ">= 1 and <= 20".
[[nodiscard]] std::string describe_range(const OptionInfo& info);

/// Describes a value that is out of its range or not a number; nullopt when it is valid.
[[nodiscard]] std::optional<std::string> find_option_fault(const OptionInfo& info, double value);

namespace detail {
/// Throws OptionError with the faults of all options that `visit` shows, if there are any.
void require_valid(const std::function<void(OptionVisitor&)>& visit);

/// Returns the member's name, with which the compiler's text of &Options::member ends.
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

struct AnyMember {
  template <class Value>
  operator Value() const;  // NOLINT: asked for, never called
};

/// Number of members of the aggregate: the largest number that braces can initialise.
template <class Options, class... Members>
consteval std::size_t member_count() {
  if constexpr (requires { Options{Members{}..., AnyMember{}}; }) {
    return member_count<Options, Members..., AnyMember>();
  } else {
    return sizeof...(Members);
  }
}

/// One member in an `OptionTable`; without `is_listed` no visitor sees it.
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

/// Values above `low`, which is not allowed itself: `option<&T::step_m>("...", above(0), 100)`.
constexpr OptionInfo::Low above(double low) {
  return {low, true};
}

/// The entry of a number or of a bool.
template <auto member>
constexpr auto option(std::string_view help, OptionInfo::Low low = {},
                      double high = std::numeric_limits<double>::infinity()) {
  detail::OptionEntry<member, 0> entry;
  entry.info = {entry.name, help, low.value, high, low.is_open};
  return entry;
}

/// The entry of a member that holds the index of a choice: an enum, or an int.
template <auto member, std::size_t count>
constexpr auto option(std::string_view help, const std::array<std::string_view, count>& choices) {
  detail::OptionEntry<member, count> entry;
  entry.info.help = help;
  entry.choices = choices;
  return entry;
}
/// The entry of a member that holds one of some choices, which are named in the order of the enum.
template <auto member, class... Names>
constexpr auto choice(std::string_view help, Names... choices) {
  return option<member>(help, std::array<std::string_view, sizeof...(Names)>{choices...});
}

/// All options of a member that is an options struct itself.
template <auto member>
constexpr auto options_of() {
  return detail::OptionEntry<member, 0>();
}

/// A member that no user sets by name, and why.
template <auto member>
constexpr auto no_option(std::string_view /*reason*/) {
  return detail::OptionEntry<member, 0, false>();
}

/// The members of an options struct, each of them once and in the order in which they are shown; a
/// member that is missing does not compile:
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

  /// Hands each member to `visitor` in the order of the entries; members of nested structs in turn.
  void visit(Options& options, OptionVisitor& visitor) const {
    std::apply([&](const auto&... entry) { (entry.visit(options, visitor), ...); }, entries_);
  }

 private:
  static consteval bool all_differ() {
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
  static_assert(all_differ(), "no member has two entries");
  std::tuple<Entries...> entries_;
};

/// Throws OptionError that lists all faults of `options`: field, value, allowed range.
template <class Options>
void validate(const Options& options) {
  Options copy = options;
  detail::require_valid([&copy](OptionVisitor& visitor) { visit_options(copy, visitor); });
}

}  // namespace panonav
