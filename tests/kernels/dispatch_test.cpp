#include "panonav/kernels/dispatch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "panonav/core/error.hpp"

namespace panonav::kernels {
namespace {

TEST(Dispatch, ScalarIsAlwaysThereAndFirst) {
  const auto sets = available_instructions();
  ASSERT_FALSE(sets.empty());
  EXPECT_EQ(sets.front(), Instructions::scalar);
  std::set<std::string_view> names;
  for (const Instructions set : sets) names.insert(name(set));
  EXPECT_EQ(names.size(), sets.size());
}

TEST(Dispatch, ChoiceObeysTheEnvironmentOrIsTheWidest) {
  const auto sets = available_instructions();
  const char* const forced = std::getenv("PANONAV_INSTRUCTIONS");
  const Instructions chosen = chosen_instructions();
  EXPECT_EQ(std::ranges::count(sets, chosen), 1);
  if (forced != nullptr && *forced != '\0') {
    EXPECT_EQ(name(chosen), forced);
  } else {
    EXPECT_EQ(chosen, sets.back());
  }
}

// Death tests run in a process of their own, where the choice has not been made yet.
TEST(DispatchDeathTest, UnknownSetIsRefusedWithTheAllowedOnes) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(
      {
        setenv("PANONAV_INSTRUCTIONS", "mmx", 1);
        try {
          static_cast<void>(chosen_instructions());
        } catch (const ContractError& error) {
          const std::string_view what = error.what();
          const bool clear = what.find("PANONAV_INSTRUCTIONS is mmx") != what.npos &&
                             what.find("scalar") != what.npos;
          std::exit(clear ? 3 : 4);
        }
        std::exit(5);
      },
      ::testing::ExitedWithCode(3), "");
}

TEST(DispatchDeathTest, EveryAvailableSetCanBeForced) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  for (const Instructions set : available_instructions()) {
    EXPECT_EXIT(
        {
          setenv("PANONAV_INSTRUCTIONS", name(set).data(), 1);
          std::exit(chosen_instructions() == set ? 3 : 4);
        },
        ::testing::ExitedWithCode(3), "")
        << name(set);
  }
}

}  // namespace
}  // namespace panonav::kernels
