#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

namespace panonav {

/// What a person must know of one option. Options live once, as members of the struct of their
/// module; the command line, TOML files and bindings are derived from its `OptionTable`.
struct OptionInfo {
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
  /// The same for a double, in the unit in which the member's name ends.
  virtual void visit(const OptionInfo& info, double& value) = 0;
  /// The same for a bool, which has no range.
  virtual void visit(const OptionInfo& info, bool& value) = 0;
  /// `value` is an index into `choices`.
  virtual void visit(const OptionInfo& info, std::span<const std::string_view> choices,
                     int& value) = 0;
};

/// The allowed range in words: ">= 1 and <= 20".
[[nodiscard]] std::string describe_range(const OptionInfo& info);

/// Every value that is out of its range or not a number, one sentence each; empty when all is well.
[[nodiscard]] std::vector<std::string> option_faults(const OptionInfo& info, double value);

namespace detail {
class FaultCollector final : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& value) override;
  void visit(const OptionInfo& info, double& value) override;
  void visit(const OptionInfo& info, bool& value) override;
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override;
  /// Throws OptionError with all faults in one line, if there are any.
  void finish() const;

 private:
  std::vector<std::string> faults_;
};

/// What the compiler writes for &Options::member ends in the member's name.
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

/// How many members the aggregate has: the most that braces can initialise.
template <class Options, class... Members>
consteval std::size_t member_count() {
  if constexpr (requires { Options{Members{}..., AnyMember{}}; }) {
    return member_count<Options, Members..., AnyMember>();
  } else {
    return sizeof...(Members);
  }
}

template <auto member, std::size_t choice_count>
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
    } else if constexpr (std::is_arithmetic_v<Value>) {
      visitor.visit(info, options.*member);
    } else {
      visit_options(options.*member, visitor);
    }
  }
};

template <auto member>
struct UnlistedEntry {
  using Options = OptionsWith<member>;
  static constexpr std::string_view name = member_name<member>();
  void visit(Options& /*options*/, OptionVisitor& /*visitor*/) const {}
};

/// The smallest value of an option; the largest one may be left away like it.
struct Low {
  double value = -std::numeric_limits<double>::infinity();
  bool open = false;
  constexpr Low() = default;
  constexpr Low(double least, bool is_open = false) : value(least), open(is_open) {}  // NOLINT
};
}  // namespace detail

/// Values above `low`, which is not allowed itself: `option<&T::step_m>("...", above(0), 100)`.
constexpr detail::Low above(double low) {
  return {low, true};
}

/// The entry of a number or of a bool.
template <auto member>
constexpr auto option(std::string_view help, detail::Low low = {},
                      double high = std::numeric_limits<double>::infinity()) {
  detail::OptionEntry<member, 0> entry;
  entry.info = {entry.name, help, low.value, high, low.open};
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
  return detail::UnlistedEntry<member>();
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
  detail::FaultCollector collector;
  visit_options(copy, collector);
  collector.finish();
}

}  // namespace panonav
