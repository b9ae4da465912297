#include <gtest/gtest.h>

#include "command_runner.hpp"

namespace panonav::testing {
namespace {

TEST(Usage, VersionAndHelpGoToStandardOutput) {
  const auto version = run_panonav({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out.substr(0, 8), "panonav ");
  EXPECT_TRUE(version.err.empty());
  const auto help = run_panonav({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Usage"), std::string::npos);
  EXPECT_TRUE(help.err.empty());
}

TEST(Usage, WrongUseIsOneLineWithAHint) {
  EXPECT_NE(refusal({}).find("a verb is missing; see panonav --help"), std::string::npos);
  EXPECT_NE(refusal({"frobnicate"}).find("'frobnicate' is no verb"), std::string::npos);
  (void)refusal({"--no-such-flag"});
}

}  // namespace
}  // namespace panonav::testing
