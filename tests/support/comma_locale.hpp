#pragma once

#include <clocale>
#include <cstdlib>
#include <locale>
#include <string>

#include "support/temporary_folder.hpp"

namespace panonav::testing {

/// While it lives, the program writes and reads numbers as Germans do: streams of C++ always,
/// functions of C where the system has such a locale or localedef makes one.
class CommaLocale {
 public:
  CommaLocale() : before_(std::locale::global(std::locale(std::locale::classic(), new Comma))) {
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"}) {
      if (has_c_ || std::setlocale(LC_ALL, name) == nullptr) continue;
      has_c_ = true;
    }
    const std::string made = (folder_ / "de_DE.UTF-8").string();
    const std::string command = "localedef -i de_DE -f UTF-8 '" + made + "' >/dev/null 2>&1";
    if (has_c_ || std::system(command.c_str()) != 0) return;
    setenv("LOCPATH", folder_.path().c_str(), 1);
    has_c_ = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
    unsetenv("LOCPATH");
  }
  ~CommaLocale() {
    std::setlocale(LC_ALL, "C");
    std::locale::global(before_);
  }
  CommaLocale(const CommaLocale&) = delete;
  CommaLocale& operator=(const CommaLocale&) = delete;

  /// True if functions of C use it, too.
  [[nodiscard]] bool has_c() const { return has_c_; }

 private:
  struct Comma : std::numpunct<char> {
    [[nodiscard]] char do_decimal_point() const override { return ','; }
    [[nodiscard]] char do_thousands_sep() const override { return '.'; }
    [[nodiscard]] std::string do_grouping() const override { return "\3"; }
  };
  std::locale before_;
  TemporaryFolder folder_;
  bool has_c_ = false;
};

}  // namespace panonav::testing

/// Declares `locale`, and skips the test where functions of C have no decimal comma to use.
#define PANONAV_REQUIRE_COMMA_LOCALE(locale)                                 \
  const panonav::testing::CommaLocale locale;                                \
  if (!locale.has_c())                                                       \
  GTEST_SKIP() << "no locale with decimal commas, and no localedef to make " \
                  "one"
