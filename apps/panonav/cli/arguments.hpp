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

#include "cli/session.hpp"
#include "cli/verb.hpp"
#include "panonav/core/options.hpp"

namespace panonav::command {

/// Wrong use of the command line. The message is one line; the caller adds where to find help.
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
  std::string name;        ///< "--cell-size-m"; of a positional "MEMORY"
  std::string short_form;  ///< "-o", or empty
  std::string value;       ///< what stands for its value: "FILE", "LOW HIGH"; empty: a switch
  std::string help;
  std::string initial;               ///< its default; empty: none, or said in `help`
  std::string range;                 ///< of numbers; empty: any
  std::vector<std::string> choices;  ///< all allowed values; of a positional some of them
  std::string section;               ///< of option files; empty: not in them
  bool of_every_verb = false;        ///< as --json
  bool required = false;
  bool repeated = false;  ///< a positional that takes all words that are left
  bool common = true;     ///< shown by --help; the others by --help-all alone

  [[nodiscard]] bool positional() const { return name.front() != '-'; }
};

/// The command line of one verb. Values are bound by reference and must live until the verb has
/// run. A declared flag is written "--out FILE" or "-o,--out FILE": the word after the flag names
/// its value in help and messages; FILE, FOLDER and names of data are completed as files. `--help`
/// shows the flags that are declared one by one, `--help-all` those of options structs, too, unless
/// `show_in_help` and `hide_from_help` decide otherwise.
class Arguments {
 public:
  Arguments();
  ~Arguments();
  Arguments(const Arguments&) = delete;
  Arguments& operator=(const Arguments&) = delete;

  /// Required, in the order of declaration. `choices` are some values to propose.
  void positional(const std::string& name, std::string& value, const std::string& help,
                  std::vector<std::string> choices = {});
  /// One or more; the last positional of a verb.
  void positionals(const std::string& name, std::vector<std::string>& values,
                   const std::string& help);
  /// Declares positionals that may be missing.
  void optional_positionals(const std::string& name, std::vector<std::string>& values,
                            const std::string& help, std::vector<std::string> choices = {});
  void option(const std::string& flag, std::string& value, const std::string& help);
  void required_option(const std::string& flag, std::string& value, const std::string& help);
  void option(const std::string& flag, std::optional<std::string>& value, const std::string& help);
  void option(const std::string& flag, std::optional<std::uint64_t>& value,
              const std::string& help);
  void option(const std::string& flag, std::optional<double>& value, const std::string& help);
  /// Exactly two numbers, low and high.
  void option(const std::string& flag, std::optional<std::pair<double, double>>& value,
              const std::string& help);
  /// Exactly two numbers; `words` stands for them in texts, "X_M Y_M".
  void option(const std::string& flag, const std::string& words,
              std::optional<std::pair<double, double>>& value, const std::string& help);
  /// Exactly two names; `words` stands for them in texts, "ODOM BASE".
  void option(const std::string& flag, const std::string& words,
              std::optional<std::pair<std::string, std::string>>& value, const std::string& help);
  /// Declares an option that takes an integer of at least `low`.
  void option(const std::string& flag, int& value, int low, const std::string& help);
  void option(const std::string& flag, std::optional<int>& value, int low, const std::string& help);
  /// One of `choices`.
  void choice(const std::string& flag, std::optional<std::string>& value,
              std::vector<std::string> choices, const std::string& help);
  void flag(const std::string& flag, bool& value, const std::string& help);

  /// One flag for each member that visit_options shows: `cell_size_m` becomes `--cell-size-m`, with
  /// a prefix "area" `--area-cell-size-m`. The same members are read from the table [`section`] of
  /// a --config file; flags win over the file, the file over defaults.
  template <class Options>
  void options(const std::string& section, Options& values, const std::string& prefix = "") {
    add_section(
        section, prefix, [&values](OptionVisitor& visitor) { visit_options(values, visitor); },
        [&values] { validate(values); });
  }

  /// Allows flags declared before, of texts and with one value each, in the table [`section`] of a
  /// --config file, beside its options.
  void allow_in_config_files(const std::string& section,
                             std::initializer_list<std::string_view> flags);

  /// Declares which flags and positionals name files that the verb writes; none may be a file that
  /// another value names (outputs.hpp). Throws logic_error if there is none of that name.
  void writes(std::initializer_list<std::string_view> names);

  /// Flags declared before that `--help` shows, or leaves to `--help-all`. Throws logic_error when
  /// there is no such flag.
  void show_in_help(std::initializer_list<std::string_view> flags) { set_common(flags, true); }
  void hide_from_help(std::initializer_list<std::string_view> flags) { set_common(flags, false); }

  /// True if the user set this member by flag or file; with an empty name, any member of the
  /// section. Valid once the verb runs.
  [[nodiscard]] bool is_set(const std::string& section, const std::string& name = "") const;

  /// Refuses options that were typed although `used` is false, once everything is read, in one
  /// line that ends in `why` ("without --areas"). An entry is a flag, or "[section]" for each
  /// option of one. Options of a --config file are ignored: it may serve several verbs.
  void reject_options_unless(std::vector<std::string> options, std::function<bool()> used,
                             std::string why);
  /// Throws UsageError if one of the options was typed, for conditions known only after the input
  /// was read.
  void reject_options(std::span<const std::string> options, const std::string& why) const;
  void reject_options(std::initializer_list<std::string> options, const std::string& why) const {
    reject_options(std::span(options.begin(), options.size()), why);
  }

  /// Throws ContractError if the user set an option of the section, by flag or file, to another
  /// value than `kept`, that of an existing memory. `as` ends the message: whose value counts, and
  /// what to do.
  template <class Options>
  void require_same(const std::string& section, Options typed, Options kept,
                    const std::string& as) const {
    require_equal(
        section, [&](OptionVisitor& visitor) { visit_options(typed, visitor); },
        [&](OptionVisitor& visitor) { visit_options(kept, visitor); }, as);
  }

  /// Reads the words behind the verb into the values; with `may_miss` also where required ones are
  /// missing. Throws UsageError.
  void read(std::span<const std::string> words, std::string_view verb, bool may_miss);
  /// Fills the option structs once all words are read: file first, then flags, then checks. The
  /// file may also have sections that only other verbs know.
  void resolve(const std::optional<std::string>& config,
               const std::function<std::vector<std::string>()>& sections_of_all_verbs);
  [[nodiscard]] std::vector<std::string> sections() const;

  [[nodiscard]] const std::vector<ArgumentInfo>& infos() const;
  /// An option file for this verb: what the user gave is set, all else a comment with its default.
  [[nodiscard]] std::string config_template(std::string_view verb) const;

 private:
  using Visit = std::function<void(OptionVisitor&)>;
  using Take = std::function<void(std::span<const std::string>)>;
  ArgumentInfo& add(const std::string& declared, const std::string& value, const std::string& help,
                    Take take);
  void add_section(const std::string& section, const std::string& prefix, Visit visit,
                   std::function<void()> check);
  void require_equal(const std::string& section, const Visit& typed, const Visit& kept,
                     const std::string& as) const;
  void set_common(std::initializer_list<std::string_view> flags, bool common);
  [[nodiscard]] std::string explain_unknown_flag(const std::string& typed) const;
  void read_positionals(std::span<const std::string> words, std::string_view verb, bool may_miss);

  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A verb with its arguments filled in, ready to run.
struct ParsedCommand {
  std::string_view verb;
  SessionOptions session;
  Run run;
};

/// Reads the command line; what asks for a text, such as --help, becomes a command that prints it.
/// Throws UsageError on wrong use and panonav::Error on a wrong value.
[[nodiscard]] ParsedCommand parse(std::span<const Verb> verbs, std::span<const std::string> words);

/// The verb that the words begin with, under its name or its alias; null when there is none.
[[nodiscard]] const Verb* find_verb(std::span<const Verb> verbs,
                                    std::span<const std::string> words);

/// Returns the verb as `find_verb`; throws UsageError with the most similar name if there is none.
[[nodiscard]] const Verb& find_required_verb(std::span<const Verb> verbs,
                                             std::span<const std::string> words);

}  // namespace panonav::command
