#include <gtest/gtest.h>

#include <sstream>

#include "support/command_runner.hpp"

namespace panonav::testing {
namespace {

std::vector<std::string> verbs() {
  return {
#ifdef PANONAV_COMMAND_SIMULATES
      "simulate",  "demo",   "reproduce", "evaluate",     "catchment",
#endif
      "calibrate", "unwrap", "memorise",  "info",         "verify",      "forget",
      "undo",      "list",   "show",      "gallery",      "export",      "rename",
      "localise",  "track",  "home",      "route record", "route follow"};
}

/// A verb may have two words.
std::vector<std::string> with_help(const std::string& verb) {
  std::istringstream stream(verb);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  words.emplace_back("--help");
  return words;
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
}

TEST(Usage, WrongUseIsOneLineWithAHint) {
  EXPECT_TRUE(contains(refusal({}), "a verb is missing; see panonav --help"));
  EXPECT_TRUE(contains(refusal({"frobnicate"}), "'frobnicate' is no verb"));
  (void)refusal({"--no-such-flag"});
}

TEST(Usage, AMisspeltFlagIsNamedEvenWhereSomethingElseIsMissing) {
  EXPECT_TRUE(contains(refusal({"memorise", "--componnets", "5"}), "--componnets"));
  EXPECT_TRUE(contains(refusal({"memorise", "a", "b", "--componnets", "5"}), "--componnets"));
}

TEST(Usage, EveryVerbHasHelpWithAnExampleOfItself) {
  const auto help = run_panonav({"--help"});
  for (const auto& verb : verbs()) {
    EXPECT_TRUE(contains(help.out, "  " + with_help(verb).front())) << verb;
    EXPECT_TRUE(contains(help.out, verb)) << verb;
    const auto own = run_panonav(with_help(verb));
    EXPECT_EQ(own.exit_code, 0) << own.err;
    EXPECT_TRUE(contains(own.out, "--json")) << verb;
    EXPECT_TRUE(contains(own.out, "--config")) << verb;
    const auto examples = own.out.find("Example:\n");
    ASSERT_NE(examples, std::string::npos) << verb;
    EXPECT_NE(own.out.find("panonav " + verb, examples), std::string::npos) << verb;
  }
}

// Their files are not there, so that is all that may be wrong with them.
TEST(Usage, ExamplesAreUnderstood) {
  int tried = 0;
  for (const auto& verb : verbs()) {
    if (verb == "simulate" || verb == "demo" || verb == "reproduce") continue;  // these would run
    const auto help = run_panonav(with_help(verb));
    for (const auto& line : lines(help.out.substr(help.out.find("Example:\n")))) {
      if (line.find("panonav ") == std::string::npos) continue;
      std::istringstream stream(line);
      std::vector<std::string> words;
      for (std::string word; stream >> word;) words.push_back(word);
      words.erase(words.begin());
      const auto result = run_panonav(words);
      EXPECT_EQ(result.exit_code, 2) << line;
      EXPECT_TRUE(contains(result.err, "o such file")) << '\n';
      ++tried;
    }
  }
  EXPECT_GE(tried, 10);
}

TEST(Usage, FormerNamesOfFlagsAreTakenWithAWarningAndNotShown) {
  const std::string warning = "--most-difference is now --max-difference\n";
  for (const auto& flag : {"--most-difference=0.2", "--most-difference=2"}) {
    const auto former = run_panonav({"prune", "no.panonav", flag});
    EXPECT_EQ(former.exit_code, 2);
    EXPECT_EQ(former.err.find(warning), 0U) << former.err;
  }
  const auto apart = run_panonav({"prune", "no.panonav", "--most-difference", "2"});
  EXPECT_EQ(apart.err.find(warning), 0U) << apart.err;
  EXPECT_NE(apart.err.find("max_difference is 2; allowed: >= 0 and <= 1"), std::string::npos);
  EXPECT_EQ(run_panonav({"prune", "no.panonav", "--max-difference", "0.2"}).err.find("is now"),
            std::string::npos);
  EXPECT_NE(refusal({"prune", "a", "--most-difference", "0.1", "--max-difference", "0.2"})
                .find("--most-difference is the former name of --max-difference"),
            std::string::npos);
  const auto help = run_panonav({"prune", "--help"});
  EXPECT_NE(help.out.find("--max-difference"), std::string::npos);
  EXPECT_EQ(help.out.find("--most-difference"), std::string::npos);
}

}  // namespace
}  // namespace panonav::testing
