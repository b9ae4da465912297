#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace panonav::testing {

/// True if `part` stands in the text; a failure shows the text.
inline ::testing::AssertionResult contains(std::string_view text, std::string_view part) {
  if (text.find(part) != std::string_view::npos) {
    return ::testing::AssertionSuccess() << "'" << part << "' stands in: " << text;
  }
  return ::testing::AssertionFailure() << "'" << part << "' is not in: " << text;
}

/// The message of the ErrorType that `call` throws; "no error" when it throws none.
template <class ErrorType, class Call>
std::string message_of(Call&& call) {
  try {
    call();
  } catch (const ErrorType& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace panonav::testing
