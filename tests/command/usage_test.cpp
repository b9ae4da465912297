#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "support/command_runner.hpp"

namespace panonav::testing {
namespace {

constexpr std::array<const char*, 7> group_titles{
    "First steps:",     "Memory:",         "Localisation and tracking:",
    "Maps and routes:", "Several robots:", "Tools:",
    "Experiments:"};

/// The first words of lines that are two blanks further in, such as verbs and flags.
std::vector<std::string> rows_after(const std::string& text, const std::string& title) {
  std::vector<std::string> names;
  bool inside = false;
  for (const auto& line : lines(text)) {
    if (line == title) {
      inside = true;
    } else if (inside && line.empty()) {
      break;
    } else if (inside && line.starts_with("  ") && line[2] != ' ') {
      names.push_back(line.substr(2, line.find("  ", 2) - 2));
    }
  }
  return names;
}

std::vector<std::string> verbs() {
  const std::string help = run_panonav({"--help"}).out;
  std::vector<std::string> all;
  for (const auto* title : group_titles) all = with(all, rows_after(help, title));
  return all;
}

std::string help_of(const std::string& verb, const std::string& flag = "--help") {
  const auto help = run_panonav(with(words_of(verb), {flag}));
  EXPECT_EQ(help.exit_code, 0) << verb << help.err;
  EXPECT_TRUE(help.err.empty()) << help.err;
  return help.out;
}

/// "--out" of each row "-o, --out FILE".
std::vector<std::string> flags_in(const std::string& help) {
  std::vector<std::string> flags;
  for (const auto& line : lines(help)) {
    const std::size_t at = line.find("--");
    if (!line.starts_with("  -") || at == std::string::npos) continue;
    flags.push_back(line.substr(at, line.find_first_of(" \n", at) - at));
  }
  return flags;
}

/// Returns the standard output of a shell command, followed by its standard error.
std::string shell(const std::string& script) {
  const std::string quoted = "exec 2>&1; " + script;
  FILE* pipe = popen(quoted.c_str(), "r");
  if (pipe == nullptr) return "no shell";
  std::string text;
  std::array<char, 4096> buffer{};
  for (std::size_t count = 1; count > 0;) {
    count = fread(buffer.data(), 1, buffer.size(), pipe);
    text.append(buffer.data(), count);
  }
  EXPECT_EQ(pclose(pipe), 0) << text;
  return text;
}

std::set<std::string> words_in(const std::string& text) {
  const auto words = words_of(text);
  return {words.begin(), words.end()};
}

TEST(Usage, VersionAndHelpGoToStandardOutput) {
  const auto version = run_panonav({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out.substr(0, 8), "panonav ");
  EXPECT_TRUE(version.err.empty());
  const auto help = run_panonav({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_TRUE(contains(help.out, "Usage"));
  EXPECT_TRUE(help.err.empty());
  for (const auto& line : lines(help.out)) EXPECT_LE(line.size(), 80U) << line;
}

TEST(Usage, TheOverviewHasEachVerbInOneLineBelowItsGroup) {
  const std::string help = run_panonav({"--help"}).out;
  std::size_t at = 0;
  for (const auto* title : group_titles) {
    const std::size_t found = help.find("\n\n" + std::string(title) + "\n", at);
    if (rows_after(help, title).empty()) continue;  // a build may leave out all verbs of a group
    ASSERT_NE(found, std::string::npos) << title;
    at = found;
  }
  EXPECT_EQ(rows_after(help, "Memory:").front(), "memorise");
  EXPECT_EQ(rows_after(help, "Maps and routes:"),
            (std::vector<std::string>{"map", "scale", "arrange", "route record", "route follow"}));
  const auto all = verbs();
  EXPECT_EQ(std::set<std::string>(all.begin(), all.end()).size(), all.size());
  const std::string list = help.substr(0, help.find("panonav help VERB"));
  for (const auto& line : lines(list)) {
    EXPECT_FALSE(line.starts_with("   ")) << "a second line of a summary: " << line;
  }
  // Every verb that completion knows stands in a group.
  const auto completed = words_of(run_panonav({"completion", "fish"}).out);
  for (std::size_t i = 0; i + 1 < completed.size(); ++i) {
    if (completed[i] != "__fish_use_subcommand" || completed[i + 1] != "-a") continue;
    const std::string& word = completed.at(i + 2);
    EXPECT_TRUE(contains(list, "  " + word + " ") || word.ends_with("ize")) << word;
  }
}

TEST(Usage, WrongUseIsOneLineWithAHint) {
  expect_refusal({}, "a verb is missing; see panonav --help");
  expect_refusal({"frobnicate"}, "'frobnicate' is not a verb; see");
  (void)refusal({"--no-such-flag"});
  expect_refusal({"info"}, "FILE is required");
  expect_refusal({"info", "a", "b"}, "'b' is an extra argument");
  expect_refusal({"info", "a", "--threads"}, "--threads needs a value: INT");
  expect_refusal({"info", "a", "--json=yes"}, "--json takes no value");
  expect_refusal({"info", "a", "--threads=1", "--threads", "2"}, "given twice");
  expect_refusal({"info", "a", "--quiet", "--verbose"}, "cannot be combined");
  expect_refusal({"info", "--", "--json", "--threads"}, "'--threads' is an extra");
}

TEST(Usage, AMisspeltFlagIsNamedEvenWhereSomethingElseIsMissing) {
  expect_refusal({"memorise", "--componnets", "5"}, "--componnets");
  expect_refusal({"memorise", "a", "b", "--componnets", "5"}, "--componnets");
}

TEST(Usage, TheNearestNameIsProposed) {
  expect_refusal({"locallise"}, "is not a verb (did you mean 'localise'?)");
  expect_refusal({"rout", "record"}, "(did you mean 'route record'?)");
  expect_refusal({"route", "recrod"}, "(did you mean 'route record'?)");
  expect_refusal({"memorise", "a", "b", "--componnets", "5"},
                 "no such option: --componnets (did you mean '--components'?)");
  expect_refusal({"localise", "a", "b", "--elevation", "5"}, "(did you mean '--elevation-deg'?)");
  EXPECT_EQ(refusal({"info", "a", "--zzzzzzzzzz"}).find("did you mean"), std::string::npos);
  const auto hidden = refusal({"memorise", "a", "b", "--camera-height-m", "1"});
  EXPECT_TRUE(contains(hidden, "no such option: --camera-height-m")) << hidden;
  EXPECT_FALSE(contains(hidden, "did you mean")) << hidden;
}

TEST(Usage, FilesOfOptionsProposeTheNearestNameAndOnlyThisVerbsSections) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) {
    return refusal({"localise", "a", "b", "--config", folder.write("c.toml", text).string()});
  };
  const auto section = refused("[localizer]\ntop = 3\n");
  EXPECT_TRUE(contains(section,
                       "[localizer] is not a known section (did you mean 'localiser'?); "
                       "known: localiser, accuracy"));
  EXPECT_EQ(section.find("monte_carlo"), std::string::npos) << section;
  EXPECT_TRUE(contains(refused("[localiser]\ncomponnets = 3\n"), "(did you mean 'components'?)"));
  EXPECT_TRUE(contains(refused("[monte_carlo]\nseed = 3\n"), "o such file")) << "another verb's";
}

TEST(Usage, SwappedArgumentsAreRecognised) {
  expect_refusal({"localise", "my image.jpg", "memory.panonav"},
                 "did you mean 'panonav localise memory.panonav 'my image.jpg''?");
  for (const auto& [verb, input] : {std::pair("memorise", "INPUT"), {"map", "INPUT"}}) {
    const auto line = refusal({verb, "folder", "m.panonav", "--kind", "panorama", "-q"});
    EXPECT_TRUE(contains(line, "MEMORY is 'folder' and " + std::string(input) + " is 'm.panonav'"));
    EXPECT_TRUE(contains(line, "did you mean 'panonav " + std::string(verb) +
                                   " m.panonav folder --kind panorama -q'?"))
        << line;
  }
  expect_refusal({"route", "record", "walk.mp4", "m.panonav"},
                 "did you mean 'panonav route record m.panonav walk.mp4'?");
  expect_refusal({"forget", "a.png", "b.png", "m.panonav"}, "in the wrong order");
  // No memory stands in the place of another one.
  EXPECT_EQ(refusal({"serve", "a=postgresql://127.0.0.1:1/none", "no.panonav"})
                .find("in the wrong order"),
            std::string::npos);
  // A folder of pictures may have any name.
  const TemporaryFolder folder;
  EXPECT_EQ(refusal({"localise", "no.db", folder.path()}).find("in the wrong order"),
            std::string::npos);
  std::filesystem::create_directory(folder / "run.panonav");
  EXPECT_EQ(refusal({"localise", "no.db", folder / "run.panonav"}).find("in the wrong order"),
            std::string::npos);
}

TEST(Usage, VerbsHaveAnotherSpelling) {
  for (const auto& [spelling, verb] :
       {std::pair("localize", "localise"), {"memorize", "memorise"}}) {
    EXPECT_EQ(help_of(spelling), help_of(verb));
    EXPECT_TRUE(contains(help_of(verb), "Other spelling: panonav " + std::string(spelling)));
    expect_refusal({spelling}, "panonav " + std::string(verb) + ": ");
  }
}

TEST(Usage, EveryVerbHasAShortHelpWithAnExampleAndALongOneWithAllOptions) {
  const auto all = verbs();
  EXPECT_GE(all.size(), 15U);
  for (const auto& verb : all) {
    const std::string help = help_of(verb);
    const auto flags = flags_in(help);
    EXPECT_LE(flags.size(), 15U) << help;
    const auto examples = help.find("Examples:\n");
    ASSERT_NE(examples, std::string::npos) << verb;
    EXPECT_NE(help.find("  panonav " + verb, examples), std::string::npos) << verb;
    EXPECT_LE(rows_after(help, "Examples:").size(), 2U) << verb;

    const std::string full = help_of(verb, "--help-all");
    const auto all_flags = flags_in(full);
    const std::set<std::string> distinct(all_flags.begin(), all_flags.end());
    EXPECT_EQ(distinct.size(), all_flags.size()) << full;
    for (const auto& flag : flags) EXPECT_TRUE(distinct.contains(flag)) << verb << flag;
    for (const auto* flag : {"--json", "--quiet", "--verbose", "--threads", "--config",
                             "--config-template", "--help", "--help-all"}) {
      EXPECT_TRUE(distinct.contains(flag)) << verb << flag;
    }
    const std::size_t hidden = all_flags.size() - flags.size();
    EXPECT_TRUE(contains(help, "This verb has " + std::to_string(hidden) +
                                   " more options; to list them: panonav " + verb + " --help-all"));
    for (const auto& line : lines(help.substr(help.find("Arguments:") + 1))) {
      EXPECT_LE(line.size(), 80U) << line;
    }
    EXPECT_EQ(run_panonav(with({"help"}, words_of(verb))).out, help);
  }
  EXPECT_EQ(run_panonav({"help"}).out, run_panonav({"--help"}).out);
  expect_refusal({"help", "locallise"}, "did you mean 'localise'?");
}

// Their files are not there, so that is all that may be wrong with them. A file that is
// synchronised need not be there, and its server is elsewhere.
TEST(Usage, ExamplesAreUnderstood) {
  const std::set<std::string> runs{"simulate", "explore",    "demo", "reproduce",
                                   "help",     "completion", "man",  "synchronise"};
  int tried = 0;
  for (const auto& verb : verbs()) {
    if (runs.contains(verb)) continue;
    for (const auto& line : rows_after(help_of(verb, "--help-all"), "Examples:")) {
      auto words = words_of(line);
      words.erase(words.begin(), std::ranges::find(words, "panonav") + 1);  // behind mpirun, too
      const auto result = run_panonav(words);
      EXPECT_EQ(result.exit_code, 2) << line;
      EXPECT_TRUE(contains(result.err, "o such file")) << '\n';
      ++tried;
    }
  }
  EXPECT_GE(tried, 10);
}

TEST(Usage, TemplatesOfOptionFilesReadBackAsTheDefaults) {
  const TemporaryFolder folder;
  int options = 0;
  for (const auto& verb : verbs()) {
    const auto command = with(words_of(verb), {"--config-template"});
    const auto printed = run_panonav(command);
    ASSERT_EQ(printed.exit_code, 0) << verb << printed.err;
    // The template as printed sets nothing. With each option set it sets the values that it shows,
    // and they are shown again.
    const std::string path = folder.write("template.toml", printed.out);
    EXPECT_EQ(run_panonav(with(command, {"--config", path})).out, printed.out) << verb;
    std::string set;
    for (const auto& line : lines(printed.out)) {
      const std::size_t equals = line.find(" = ");
      const bool is_option = line.starts_with("# ") && equals != std::string::npos &&
                             line.substr(2, equals - 2).find(' ') == std::string::npos;
      set += (is_option ? line.substr(2) : line) + "\n";
      options += is_option ? 1 : 0;
    }
    const auto again = run_panonav(with(command, {"--config", folder.write("set.toml", set)}));
    EXPECT_EQ(again.exit_code, 0) << verb << again.err;
    EXPECT_EQ(again.out, set) << verb;
  }
  EXPECT_GE(options, 60);
  EXPECT_TRUE(
      contains(run_panonav({"localise", "--top", "7", "--config-template"}).out, "\ntop = 7\n"));
}

TEST(Usage, CompletionOfBashKnowsVerbsOptionsAndChoices) {
  const TemporaryFolder folder;
  const std::string script =
      folder.write("script.sh", run_panonav({"completion", "bash"}).out +
                                    "complete_words() {\n"
                                    "  COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1))\n"
                                    "  _panonav; echo \"${COMPREPLY[*]}\"\n}\n");
  const auto completed = [&](const std::string& words) {
    return words_in(shell("bash -c '. " + script + "; complete_words " + words + "'"));
  };
  EXPECT_EQ(completed("panonav loc"), (std::set<std::string>{"localise", "localize"}));
  EXPECT_EQ(completed("panonav route \"\""), (std::set<std::string>{"record", "follow"}));
  EXPECT_EQ(completed("panonav localise m.panonav --kind \"\""),
            (std::set<std::string>{"panorama", "equirectangular", "mirror", "pinhole"}));
  EXPECT_EQ(completed("panonav localise m.panonav --top \"\""), (std::set<std::string>{}));
  EXPECT_EQ(completed("panonav completion \"\""), (std::set<std::string>{"bash", "zsh", "fish"}));
  std::string all;
  std::vector<std::set<std::string>> flags;
  for (const auto& verb : verbs()) {
    all += "complete_words panonav " + verb + " -; ";
    const auto in_help = flags_in(help_of(verb, "--help-all"));
    flags.emplace_back(in_help.begin(), in_help.end());
  }
  const auto said = lines(shell("bash -c '. " + script + "; " + all + "'"));
  ASSERT_EQ(said.size(), flags.size());
  for (std::size_t i = 0; i < said.size(); ++i) {
    const auto words = words_in(said[i]);
    for (const auto& flag : flags[i]) EXPECT_TRUE(words.contains(flag)) << flag;
  }
}

TEST(Usage, CompletionOfOtherShellsNamesEveryOption) {
  const std::string zsh = run_panonav({"completion", "zsh"}).out;
  const std::string fish = run_panonav({"completion", "fish"}).out;
  for (const auto& verb : verbs()) {
    const std::size_t begin = zsh.find("  '" + verb + "'");
    ASSERT_NE(begin, std::string::npos) << verb;
    const std::string own = zsh.substr(begin, zsh.find(";;", begin) - begin);
    for (const auto& flag : flags_in(help_of(verb, "--help-all"))) {
      EXPECT_TRUE(own.find("'" + flag + "=[") != std::string::npos ||
                  own.find("'" + flag + "[") != std::string::npos)
          << verb << flag;
      EXPECT_TRUE(fish.find("'__panonav_verb " + verb + "' -l " + flag.substr(2) + " ") !=
                  std::string::npos)
          << verb << flag;
    }
  }
  for (const auto& [name, script] : {std::pair("zsh", zsh), std::pair("fish", fish)}) {
    if (std::system(("command -v " + std::string(name) + " >/dev/null").c_str()) != 0) continue;
    const TemporaryFolder folder;
    EXPECT_EQ(shell(std::string(name) + " -n " + folder.write("script", script).string()), "");
  }
  expect_refusal({"completion", "tcsh"}, "allowed: bash, zsh, fish");
}

TEST(Usage, ManualPagesNameEveryOptionAndFormatWithoutWarnings) {
  const TemporaryFolder folder;
  run_well({"man", "--out", folder / "man"});
  const bool has_groff = std::system("command -v groff >/dev/null") == 0;
  const auto shown = [&](const std::string& page) {
    return shell("groff -man -Tascii -P-c -ww '" + page + "'");
  };
  for (const auto& verb : verbs()) {
    std::string name = "panonav-" + verb;
    std::ranges::replace(name, ' ', '-');
    const std::string path = folder / ("man/" + name + ".1");
    const std::string page = bytes_of(path);
    EXPECT_EQ(run_panonav(with({"man"}, words_of(verb))).out, page);
    for (const auto& flag : flags_in(help_of(verb, "--help-all"))) {
      std::string escaped;
      for (const char c : flag) escaped += c == '-' ? "\\-" : std::string(1, c);
      EXPECT_TRUE(page.find(escaped + "\\fR") != std::string::npos ||
                  page.find(escaped + " ") != std::string::npos)
          << verb << flag;
    }
    for (const auto* title : {"NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXAMPLES",
                              "EXIT STATUS", "ENVIRONMENT", "FILES", "SEE ALSO"}) {
      EXPECT_TRUE(contains(page, ".SH " + std::string(title) + "\n"));
    }
    if (!has_groff) continue;
    const std::string formatted = shown(path);
    EXPECT_TRUE(contains(formatted, "--config-template"));
    EXPECT_EQ(formatted.find("warning"), std::string::npos) << formatted;
  }
  const std::string overview = bytes_of(folder / "man/panonav.1");
  EXPECT_EQ(run_panonav({"man"}).out, overview);
  for (const auto& verb : verbs()) EXPECT_TRUE(contains(overview, "\n\\fB" + verb + "\\fR\n"));
  EXPECT_TRUE(contains(overview, ".SS \"Maps and routes\"\n.TP\n\\fBmap\\fR\n"));
  if (has_groff) {
    EXPECT_EQ(shell("groff -man -Tascii -ww -z '" + (folder / "man/panonav.1").string() + "'"), "");
  }
}

std::vector<std::string> simulate_one(const std::string& out) {
  return {"simulate", "office",    out,  "--random",        "1", "--kind", "panorama", "--rows",
          "8",        "--columns", "32", "--rays-per-axis", "1"};
}

TEST(Usage, NextLinesHaveWordsAsAShellWantsThem) {
  const TemporaryFolder folder;
  const std::string out = folder / "it's a run";
  const auto said = lines(run_panonav(simulate_one(out)).out);
  ASSERT_FALSE(said.empty());
  const std::string start = "Next: panonav memorise ";
  ASSERT_EQ(said.back().find(start), 0U) << said.back();
  const std::string words = said.back().substr(start.size());
  EXPECT_EQ(shell("set -- " + words + "; printf '%s\\n' \"$#\" \"$2\""), "2\n" + out + "\n");
}

TEST(Usage, QuietLeavesTheResultAndVerboseAddsTheStages) {
  const TemporaryFolder folder;
  const auto quiet = run_panonav(with(simulate_one(folder / "a"), {"--quiet"}));
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_TRUE(quiet.err.empty()) << quiet.err;
  EXPECT_EQ(lines(quiet.out).size(), 1U) << quiet.out;
  EXPECT_TRUE(contains(quiet.out, "1 view of office"));
  const auto usual = run_panonav(simulate_one(folder / "b"));
  EXPECT_TRUE(usual.err.empty()) << usual.err;
  const auto verbose = run_panonav(with(simulate_one(folder / "c"), {"-v"}));
  EXPECT_EQ(lines(verbose.out).size(), 2U) << verbose.out;
  EXPECT_TRUE(contains(verbose.err, "s] rendering: 1 of 1 in "));
  EXPECT_TRUE(contains(verbose.err, "s] done"));
}

// The program runs on a terminal of its own until the bar says how much time is left.
TEST(Usage, ProgressBarsSayTheTimeLeftOnATerminal) {
  const TemporaryFolder folder;
  const std::string out = folder / "run";
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(terminal, 0);
  ASSERT_EQ(grantpt(terminal), 0);
  ASSERT_EQ(unlockpt(terminal), 0);
  const std::string name = ptsname(terminal);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const int other = open(name.c_str(), O_RDWR | O_NOCTTY);
    dup2(other, STDOUT_FILENO);
    dup2(other, STDERR_FILENO);
    execl(PANONAV_COMMAND, "panonav", "simulate", "office", out.c_str(), "--random", "2000",
          "--kind", "panorama", "--rows", "64", "--columns", "256", nullptr);
    _exit(127);
  }
  std::string text;
  const auto start = std::chrono::steady_clock::now();
  while (text.find(" left") == std::string::npos &&
         std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
    pollfd polled{terminal, POLLIN, 0};
    std::array<char, 4096> buffer{};
    if (poll(&polled, 1, 200) <= 0) continue;
    const auto count = read(terminal, buffer.data(), buffer.size());
    if (count <= 0) break;  // the program has ended
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  close(terminal);
  EXPECT_TRUE(contains(text, "/2000, about "));
  EXPECT_TRUE(contains(text, "/2000\r")) << "nothing is said of the time at first";
}

}  // namespace
}  // namespace panonav::testing
