#pragma once

#include <gtest/gtest.h>

namespace panonav::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace panonav::test

/// For tests that count rates over thousands of trials: other tests run the same code once, and
/// under a sanitizer the trials take minutes.
#define PANONAV_SKIP_RATES_UNDER_SANITIZERS() \
  if (panonav::test::sanitized) GTEST_SKIP() << "a rate over many trials"
