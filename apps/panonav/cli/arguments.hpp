#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/verb.hpp"
#include "panonav/core/options.hpp"

namespace panonav::command {

/// Wrong use of the command line. The message is one line; the caller adds where to find help.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What every verb takes.
struct CommonArguments {
  bool json = false;
  bool former_keys = false;  ///< of JSON
  int threads = 0;           ///< 0: one per core
  std::optional<std::string> config;
};

/// The command line of one verb. Values are bound by reference and must live until the verb has
/// run.
class Arguments {
 public:
  struct Parser;  // hides the parser's header
  explicit Arguments(Parser& parser);
  ~Arguments();
  Arguments(const Arguments&) = delete;
  Arguments& operator=(const Arguments&) = delete;

  /// Required, in the order of declaration.
  void positional(const std::string& name, std::string& value, const std::string& help);
  /// One or more; the last positional of a verb.
  void positionals(const std::string& name, std::vector<std::string>& values,
                   const std::string& help);
  /// `flag` as typed, with its short form where there is one ("-o,--output").
  void option(const std::string& flag, std::string& value, const std::string& help);
  void required_option(const std::string& flag, std::string& value, const std::string& help);
  void option(const std::string& flag, std::optional<std::string>& value, const std::string& help);
  void option(const std::string& flag, std::optional<std::uint64_t>& value,
              const std::string& help);
  void option(const std::string& flag, std::optional<double>& value, const std::string& help);
  /// Exactly two numbers, low and high.
  void option(const std::string& flag, std::optional<std::pair<double, double>>& value,
              const std::string& help);
  /// Whole number from `low` on.
  void option(const std::string& flag, int& value, int low, const std::string& help);
  void option(const std::string& flag, std::optional<int>& value, int low, const std::string& help);
  /// One of `choices`.
  void choice(const std::string& flag, std::optional<std::string>& value,
              std::vector<std::string> choices, const std::string& help);
  void flag(const std::string& flag, bool& value, const std::string& help);

  /// One flag for each member that visit_options shows: `cell_size_m` becomes `--cell-size-m`, with
  /// a prefix "area" `--area-cell-size-m`. The same members are read from the table [`section`] of
  /// a --config file; flags win over the file, the file over defaults. Former names of members and
  /// of their choices are taken, too.
  template <class Options>
  void options(const std::string& section, Options& values, const std::string& prefix = "") {
    add_section(
        section, prefix, [&values](OptionVisitor& visitor) { visit_options(values, visitor); },
        [&values] { validate(values); });
  }

  /// `former` is what the flag `now` was called in the last version: `--help` does not show it, but
  /// it is taken, with a warning.
  void formerly(const std::string& former, const std::string& now);
  /// The same of one value of a flag.
  void formerly(const std::string& flag, const std::string& former, const std::string& now);
  /// What was typed, with new names in the place of former ones; warns of them on standard error.
  /// Throws UsageError when a flag is there under both names.
  [[nodiscard]] std::vector<std::string> renamed(std::vector<std::string> typed) const;

  /// Whether the user gave this member by flag or file; an empty name: any member of the section.
  /// Meaningful once the verb runs.
  [[nodiscard]] bool given(const std::string& section, const std::string& name = "") const;

  /// Fills the option structs once everything is typed: file first, then flags, then checks. Other
  /// sections of the file than `known_sections` are refused.
  void resolve(const std::optional<std::string>& config,
               std::span<const std::string_view> known_sections);
  [[nodiscard]] std::vector<std::string_view> sections() const;

 private:
  using Visit = std::function<void(OptionVisitor&)>;
  void add_section(const std::string& section, const std::string& prefix, Visit visit,
                   std::function<void()> check);

  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A verb with its arguments filled in, ready to run.
struct ParsedCommand {
  std::string_view verb;
  CommonArguments common;
  Run run;
};

/// Reads the command line. Empty when --help or --version was asked for and has been printed to
/// standard output. Throws UsageError on wrong use and panonav::Error on a wrong value.
[[nodiscard]] std::optional<ParsedCommand> parse(std::span<const Verb> verbs, int argc,
                                                 const char* const* argv);

/// The name of the verb that the command line starts with, for messages; empty when there is none.
[[nodiscard]] std::string_view verb_in(std::span<const Verb> verbs, int argc,
                                       const char* const* argv);

}  // namespace panonav::command
