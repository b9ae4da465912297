#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/outputs.hpp"
#include "cli/session.hpp"
#include "cli/verb.hpp"
#include "panonav/core/options.hpp"

namespace panonav::command {

/// Reports wrong use of the command line. The message is one line; main adds which help to read.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The arguments of every verb.
struct CommonArguments {
  SessionOptions session;
  std::optional<std::string> config;
  bool config_template = false;
};

/// Describes one argument of a verb, for help, completion, manual and option files.
struct ArgumentInfo {
  std::string name;        ///< "--cell-size-m", or "MEMORY" for a positional
  std::string short_form;  ///< "-o", or empty
  std::string value;       ///< placeholder of its value: "FILE", "LOW HIGH"; empty: a switch
  std::string help;
  std::string default_value;         ///< empty: there is none, or `help` states it
  std::string range;                 ///< allowed numbers; empty: any
  std::vector<std::string> choices;  ///< all allowed values; for a positional only proposals
  std::string section;               ///< table in option files; empty: not allowed there
  bool of_every_verb = false;        ///< an option like --json
  bool required = false;
  bool repeated = false;         ///< a positional that takes all remaining words
  bool is_in_short_help = true;  ///< --help shows it; otherwise only --help-all

  [[nodiscard]] bool positional() const { return name.front() != '-'; }
};

/// Declares and parses the arguments of one verb. Values are bound by reference and must live until
/// the verb has run. A declared flag is written "--out FILE" or "-o,--out FILE": the word after the
/// flag names its value in help and messages; FILE, FOLDER and names of data are completed as
/// files. `--help` shows the flags that are declared one by one, `--help-all` also those of option
/// structs; `show_in_help` and `hide_from_help` change this.
class Arguments {
 public:
  Arguments();
  ~Arguments();
  Arguments(const Arguments&) = delete;
  Arguments& operator=(const Arguments&) = delete;

  /// Declares a required positional; positionals are read in the order of declaration. Shells
  /// propose `choices`; other values are allowed, too.
  void positional(const std::string& name, std::string& value, const std::string& help,
                  std::vector<std::string> choices = {});
  /// Declares a positional that takes one or more words; it must be the last one of the verb.
  void positionals(const std::string& name, std::vector<std::string>& values,
                   const std::string& help);
  /// Declares a positional that takes any number of words, or none; it must be the last one.
  void optional_positionals(const std::string& name, std::vector<std::string>& values,
                            const std::string& help, std::vector<std::string> choices = {});
  void option(const std::string& flag, std::string& value, const std::string& help);
  void required_option(const std::string& flag, std::string& value, const std::string& help);
  void option(const std::string& flag, std::optional<std::string>& value, const std::string& help);
  void option(const std::string& flag, std::optional<std::uint64_t>& value,
              const std::string& help);
  void option(const std::string& flag, std::optional<double>& value, const std::string& help);
  /// Declares an option that takes two numbers, low and high.
  void option(const std::string& flag, std::optional<std::pair<double, double>>& value,
              const std::string& help);
  /// Declares an option that takes two numbers; `words` names them in help texts, such as "X_M
  /// Y_M".
  void option(const std::string& flag, const std::string& words,
              std::optional<std::pair<double, double>>& value, const std::string& help);
  /// Declares an option that takes two names; `words` names them in help texts, such as "ODOM
  /// BASE".
  void option(const std::string& flag, const std::string& words,
              std::optional<std::pair<std::string, std::string>>& value, const std::string& help);
  /// Declares an option that takes as many words as `words` names in help texts, such as "VIEW VIEW
  /// LENGTH".
  void option(const std::string& flag, const std::string& words,
              std::optional<std::vector<std::string>>& value, const std::string& help);
  /// Declares an option that takes an integer of at least `low`.
  void option(const std::string& flag, int& value, int low, const std::string& help);
  void option(const std::string& flag, std::optional<int>& value, int low, const std::string& help);
  /// Declares an option whose value is one of `choices`.
  void choice(const std::string& flag, std::optional<std::string>& value,
              std::vector<std::string> choices, const std::string& help);
  void flag(const std::string& flag, bool& value, const std::string& help);

  /// Declares a flag for each member that visit_options visits: `cell_size_m` becomes
  /// `--cell-size-m`, or `--area-cell-size-m` with the prefix "area". The same members are read
  /// from the table [`section`] of a --config file; flags have priority over the file, and the file
  /// over the defaults.
  template <class Options>
  void options(const std::string& section, Options& values, const std::string& prefix = "") {
    add_section(
        section, prefix, [&values](OptionVisitor& visitor) { visit_options(values, visitor); },
        [&values] { validate(values); });
  }

  /// Allows flags that were declared before and take one text in the table [`section`] of a
  /// --config file, in addition to the options of this section.
  void allow_in_config_files(const std::string& section,
                             std::initializer_list<std::string_view> flags);

  /// Declares which flags and positionals name files that the verb writes; such a file must not be
  /// one that another argument names (outputs.hpp). Throws logic_error if no argument has such a
  /// name.
  void declare_outputs(std::initializer_list<std::string_view> names);

  /// Sets what Ctrl-C prints if `writes` returns true after `resolve` (empty: always): which
  /// results are kept and how to continue. Default: a text for verbs with outputs.
  void explain_interruption(std::string_view text, std::function<bool()> writes = {}) {
    interruption_text_ = text;
    writes_ = std::move(writes);
  }
  /// Returns that text, empty if this call of the verb writes nothing. Valid after `resolve`.
  [[nodiscard]] std::string_view interruption_text() const;

  /// Makes `--help` show these flags, or only `--help-all`. Throws logic_error if a flag was not
  /// declared before.
  void show_in_help(std::initializer_list<std::string_view> flags) {
    set_in_short_help(flags, true);
  }
  void hide_from_help(std::initializer_list<std::string_view> flags) {
    set_in_short_help(flags, false);
  }

  /// True if the user set this member by flag or file, or with an empty `name` any member of the
  /// section. Valid after `resolve`.
  [[nodiscard]] bool is_set(const std::string& section, const std::string& name = "") const;

  /// Makes `resolve` throw UsageError if one of the options was typed and `used` returns false.
  /// `why` ends the message ("without --areas"). An entry is a flag, or "[section]" for all
  /// options of a section. Options in a --config file are not rejected, as the file may serve
  /// several verbs.
  void reject_options_unless(std::vector<std::string> options, std::function<bool()> used,
                             std::string why);
  /// Throws UsageError if one of the options was typed. For conditions that are known only after
  /// the input was read.
  void reject_options(std::span<const std::string> options, const std::string& why) const;
  void reject_options(std::initializer_list<std::string> options, const std::string& why) const {
    reject_options(std::span(options.begin(), options.size()), why);
  }

  /// Throws ContractError if the user set an option of the section, by flag or file, to another
  /// value than `stored`, the value in an existing memory. `message_end` says where that value
  /// comes from and what the user can do.
  template <class Options>
  void require_same(const std::string& section, Options typed, Options stored,
                    const std::string& message_end) const {
    require_equal(
        section, [&](OptionVisitor& visitor) { visit_options(typed, visitor); },
        [&](OptionVisitor& visitor) { visit_options(stored, visitor); }, message_end);
  }

  /// Parses the words after the verb into the bound values. Throws UsageError, but with
  /// `allow_missing` not for missing required arguments.
  void read(std::span<const std::string> words, std::string_view verb, bool allow_missing);
  /// Fills the option structs from the config file, then from the flags, and checks them. Called
  /// after `read`. The file may also have sections that only other verbs use. Returns the outputs
  /// that exist already.
  [[nodiscard]] EarlierOutputs resolve(
      const std::optional<std::string>& config,
      const std::function<std::vector<std::string>()>& all_sections);
  [[nodiscard]] std::vector<std::string> sections() const;

  [[nodiscard]] const std::vector<ArgumentInfo>& infos() const;
  /// Returns an option file for this verb: options that the user set have their values, all others
  /// are comments with their defaults.
  [[nodiscard]] std::string config_template(std::string_view verb) const;

 private:
  using Visit = std::function<void(OptionVisitor&)>;
  using ValueSetter = std::function<void(std::span<const std::string>)>;
  ArgumentInfo& add(const std::string& declared, const std::string& value, const std::string& help,
                    ValueSetter value_setter);
  void add_section(const std::string& section, const std::string& prefix, Visit visit,
                   std::function<void()> check);
  void require_equal(const std::string& section, const Visit& typed, const Visit& stored,
                     const std::string& message_end) const;
  void set_in_short_help(std::initializer_list<std::string_view> flags, bool is_in_short_help);
  [[nodiscard]] std::string explain_unknown_flag(const std::string& typed) const;
  /// Returns the indices of all positionals.
  [[nodiscard]] std::vector<std::size_t> find_positionals() const;
  /// Throws UsageError with the corrected command if MEMORY is not a memory file, but another
  /// positional is.
  void require_memory_in_its_place(std::span<const std::string> words,
                                   std::span<const std::string> option_words,
                                   std::string_view verb) const;
  void read_positionals(std::span<const std::string> words, bool allow_missing);

  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
  std::string_view interruption_text_;
  std::function<bool()> writes_;  ///< whether the text applies; empty: always
};

/// A verb with its arguments filled in, ready to run.
struct ParsedCommand {
  std::string_view verb;
  SessionOptions session;
  Run run;
  std::string_view interruption_text = {};  ///< printed at Ctrl-C; empty: nothing
};

/// Parses the command line. For flags such as --help it returns a command that prints the text.
/// Throws UsageError on wrong use and panonav::Error on a wrong value.
[[nodiscard]] ParsedCommand parse(std::span<const Verb> verbs, std::span<const std::string> words);

/// Returns the verb whose name or alias the words begin with; null if there is none.
[[nodiscard]] const Verb* find_verb(std::span<const Verb> verbs,
                                    std::span<const std::string> words);

/// Returns the same verb as `find_verb`. Throws UsageError, which proposes the most similar name,
/// if there is none.
[[nodiscard]] const Verb& find_required_verb(std::span<const Verb> verbs,
                                             std::span<const std::string> words);

}  // namespace panonav::command
