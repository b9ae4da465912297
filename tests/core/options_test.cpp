#include "panonav/core/options.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panonav/core/error.hpp"

namespace panonav {
namespace {

constexpr std::array<std::string_view, 2> norms = {"l1", "l2"};

struct SampleOptions {
  int views = 3;
  double radius_m = 0.5;
  double tolerance = 0.0;
  bool packed = true;
  int norm = 0;
  friend bool operator==(const SampleOptions&, const SampleOptions&) = default;
};

struct ElevationBounds {
  double low;
  double high;
  friend bool operator==(const ElevationBounds&, const ElevationBounds&) = default;
};

void visit_options(SampleOptions& options, OptionVisitor& visitor) {
  using T = SampleOptions;
  constexpr OptionTable table{
      option<&T::views>("how many", 1, 9), option<&T::radius_m>("how far", above(0)),
      option<&T::tolerance>("any number"), option<&T::packed>("or not"),
      option<&T::norm>("which", norms),
  };
  table.visit(options, visitor);
}

enum class Side { left, right };

struct NestedOptions {
  SampleOptions sample;
  std::optional<ElevationBounds> bounds = std::nullopt;
  Side side = Side::left;
  friend bool operator==(const NestedOptions&, const NestedOptions&) = default;
};

void visit_options(NestedOptions& options, OptionVisitor& visitor) {
  using T = NestedOptions;
  constexpr OptionTable table{
      options_of<&T::sample>(),
      no_option<&T::bounds>("a pair that no text gives"),
      choice<&T::side>("which", "left", "right"),
  };
  table.visit(options, visitor);
}

// The table's own check rests on these: a member more or less does not compile.
static_assert(detail::member_count<SampleOptions>() == 5);
static_assert(detail::member_count<NestedOptions>() == 3);
static_assert(detail::member_count<ElevationBounds>() == 2);
static_assert(detail::member_name<&SampleOptions::radius_m>() == "radius_m");

/// Lists what a table holds, one entry an option; sets choices to the last one.
class Listing final : public OptionVisitor {
 public:
  void visit(const OptionInfo& info, int& /*value*/) override { add(info, "int"); }
  void visit(const OptionInfo& info, double& /*value*/) override { add(info, "double"); }
  void visit(const OptionInfo& info, bool& /*value*/) override { add(info, "bool"); }
  void visit(const OptionInfo& info, std::span<const std::string_view> choices,
             int& value) override {
    std::string all;
    for (std::size_t i = 0; i < choices.size(); ++i) {
      all.append(i == 0 ? "" : "|").append(choices[i]);
    }
    add(info, all);
    value = static_cast<int>(choices.size()) - 1;
  }
  std::string text;

 private:
  void add(const OptionInfo& info, std::string_view kind) {
    text.append(info.name).append(" ").append(kind).append(";");
  }
};

TEST(Options, TablesShowMembersInOrderWithNestedStructsAndChoices) {
  NestedOptions options;
  Listing listing;
  visit_options(options, listing);
  EXPECT_EQ(listing.text,
            "views int;radius_m double;tolerance double;packed bool;norm l1|l2;side left|right;");
  EXPECT_EQ(options.side, Side::right);
  EXPECT_EQ(options.sample, (SampleOptions{.norm = 1}));
}

std::string fault_of(const SampleOptions& options) {
  try {
    validate(options);
  } catch (const OptionError& error) {
    return error.what();
  }
  return "";
}

TEST(Options, DefaultsAndBordersAreValid) {
  EXPECT_EQ(fault_of({}), "");
  EXPECT_EQ(fault_of({.views = 1}), "");
  EXPECT_EQ(fault_of({.views = 9}), "");
  EXPECT_EQ(fault_of({.tolerance = -1e300}), "");
  EXPECT_EQ(fault_of({.norm = 1}), "");
}

TEST(Options, NamesFieldValueAndRange) {
  EXPECT_EQ(fault_of({.views = 10}), "views is 10; allowed: >= 1 and <= 9");
  EXPECT_EQ(fault_of({.views = 0}), "views is 0; allowed: >= 1 and <= 9");
  EXPECT_EQ(fault_of({.radius_m = 0.0}), "radius_m is 0; allowed: > 0");
  EXPECT_EQ(fault_of({.norm = 2}), "norm is 2; allowed: l1 l2");
  EXPECT_EQ(fault_of({.norm = -1}), "norm is -1; allowed: l1 l2");
}

TEST(Options, RefusesWhatIsNotAFiniteNumber) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fault_of({.radius_m = infinity}), "radius_m is inf; allowed: > 0");
  EXPECT_EQ(fault_of({.tolerance = std::numeric_limits<double>::quiet_NaN()}),
            "tolerance is nan; allowed: any finite number");
}

TEST(Options, ReportsAllFaultsInOneLine) {
  const std::string text = fault_of({.views = -4, .radius_m = -1.0, .norm = 7});
  EXPECT_EQ(text,
            "views is -4; allowed: >= 1 and <= 9; radius_m is -1; allowed: > 0; norm is 7; "
            "allowed: l1 l2");
  EXPECT_EQ(text.find('\n'), std::string::npos);
}

TEST(Errors, CarryOneLineWithFieldValueAndRange) {
  EXPECT_STREQ(ContractError("rows", 0.0, ">= 1").what(), "rows is 0; allowed: >= 1");
  EXPECT_STREQ(FileError("a/b.png", "no such file").what(), "a/b.png: no such file");
  EXPECT_NO_THROW(require(true, "x", 1.0, "1"));
  EXPECT_THROW(require(false, "x", 1.0, "2"), Error);
}

TEST(Errors, TextOfANumberReadsBackAsTheSameNumber) {
  for (const double value : {0.0, 0.1, -1.0 / 3.0, 1e-300, 123456789.0, 6.02e23}) {
    EXPECT_EQ(std::stod(to_text(value)), value);
  }
  EXPECT_EQ(to_text(0.5), "0.5");
}

}  // namespace
}  // namespace panonav
