#include "panonav/io/option_file.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "support/temporary_folder.hpp"

namespace panonav::testing {

// Outside the unnamed namespace: `visit_options` is found by its argument.
struct SampleOptions {
  int count = 3;
  double radius_m = 0.5;
  bool fast = false;
  int kind = 0;
  friend bool operator==(const SampleOptions&, const SampleOptions&) = default;
};

void visit_options(SampleOptions& options, OptionVisitor& visitor) {
  using T = SampleOptions;
  constexpr OptionTable table{
      option<&T::count>("", 1, 10),
      option<&T::radius_m>("", above(0)),
      option<&T::fast>(""),
      choice<&T::kind>("", "plain", "fancy"),
  };
  table.visit(options, visitor);
}

namespace {

using OptionFiles = InTemporaryFolder;

TEST_F(OptionFiles, FieldsReplaceDefaults) {
  OptionFile file(folder.write("a.toml",
                               "[sample]\ncount = 7\nradius_m = 2\nfast = true\nkind = \"fancy\"\n"
                               "[half]\nradius_m = 0.25\n"));
  SampleOptions options;
  file.apply("sample", options);
  EXPECT_EQ(options, (SampleOptions{7, 2.0, true, 1}));
  options = {};
  file.apply("half", options);
  EXPECT_EQ(options, (SampleOptions{3, 0.25, false, 0}));
  options = {};
  file.apply("absent", options);
  EXPECT_EQ(options, SampleOptions{});
  EXPECT_TRUE(file.has("half", "radius_m"));
  EXPECT_FALSE(file.has("half", "count"));
  EXPECT_FALSE(file.has("absent", "count"));
  file.require_sections(std::array<std::string_view, 3>{"half", "sample", "more"});
}

TEST_F(OptionFiles, FaultsNameFileSectionFieldAndRange) {
  const auto expect_fault = [&](std::string_view fields, std::string_view part) {
    const auto path = folder.write("a.toml", "[sample]\n" + std::string(fields) + "\n");
    SampleOptions options;
    const std::string message =
        message_of<FileError>([&] { OptionFile(path).apply("sample", options); });
    EXPECT_EQ(message.rfind(path.string() + ": ", 0), 0U) << message;
    EXPECT_TRUE(contains(message, part));
  };
  expect_fault("counts = 7",
               "[sample] counts is not a known field (did you mean 'count'?); known: count, ");
  expect_fault("count = 0", "[sample] count is 0; allowed: >= 1 and <= 10");
  expect_fault("count = 99999999999", "[sample] count is 99999999999; allowed: >= 1 and <= 10");
  expect_fault("count = 2.5", "[sample] count is 2.5; allowed: a whole number");
  expect_fault("radius_m = 0", "[sample] radius_m is 0; allowed: > 0");
  expect_fault("radius_m = nan", "[sample] radius_m is nan; allowed: a finite number");
  expect_fault("radius_m = \"1\"", "allowed: a finite number");
  expect_fault("fast = 1", "[sample] fast is 1; allowed: true, false");
  expect_fault("kind = \"odd\"", "[sample] kind is \"odd\"; allowed: \"plain\", \"fancy\"");
  expect_fault("count =", "is not TOML");

  const auto stray = folder.write("b.toml", "count = 3\n");
  EXPECT_TRUE(
      contains(message_of<FileError>([&] { OptionFile file(stray); }), "outside of all sections"));
  const OptionFile file(folder.write("c.toml", "[smaple]\ncount = 3\n"));
  EXPECT_TRUE(contains(message_of<FileError>([&] {
                         file.require_sections(std::array<std::string_view, 1>{"sample"});
                       }),
                       "[smaple] is not a known section (did you mean 'sample'?); known: sample"));
}

}  // namespace
}  // namespace panonav::testing
