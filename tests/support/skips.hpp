#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>

namespace panonav::testing {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

/// A folder of real recordings or worlds below that of the environment variable PANONAV_DATA; empty
/// when it is not there.
inline std::optional<std::filesystem::path> real_data(std::string_view folder) {
  const char* const root = std::getenv("PANONAV_DATA");
  if (root == nullptr || *root == '\0') return std::nullopt;
  const auto path = std::filesystem::path(root) / folder;
  if (!std::filesystem::is_directory(path)) return std::nullopt;
  return path;
}

}  // namespace panonav::testing

/// For tests that count rates over thousands of trials: other tests run the same code once, and
/// under a sanitizer the trials take minutes. On an emulated processor they may be skipped, too: by
/// the environment variable PANONAV_SKIP_RATES.
#define PANONAV_SKIP_RATES_UNDER_SANITIZERS()                                        \
  if (panonav::testing::sanitized || std::getenv("PANONAV_SKIP_RATES") != nullptr) { \
    GTEST_SKIP() << "a rate over many trials";                                       \
  }

/// Skips the test unless `found`, an optional, holds real data from the folder `name`.
#define PANONAV_REQUIRE_DATA(found, name) \
  if (!(found)) GTEST_SKIP() << "PANONAV_DATA does not name a folder that holds " << (name)
