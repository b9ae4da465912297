#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace panonav {

/// Base of everything that panonav throws. The message is one line that says what is wrong, where,
/// which value was found and which values are allowed. "No answer" (lost, nothing visible) is never
/// an error: functions return an empty optional for it.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller broke a documented precondition of a function.
class ContractError : public Error {
 public:
  using Error::Error;
  /// Message "`field` is `value`; allowed: `allowed`".
  ContractError(std::string_view field, std::string_view value, std::string_view allowed);
  /// Message with the value as `to_text` writes it.
  ContractError(std::string_view field, double value, std::string_view allowed);
};

/// One or more option values are out of range. The message lists every fault.
class OptionError : public Error {
 public:
  using Error::Error;
};

/// A file is missing, unreadable, damaged, of a foreign kind, of another version, or cannot be
/// written.
class FileError : public Error {
 public:
  /// Message "`path`: `fault`", of an address without its password. `fault` names the field, the
  /// value and the allowed range where there are any.
  FileError(std::string_view path, std::string_view fault);
};

/// Throws ContractError(field, value, allowed) unless `holds`.
inline void require(bool holds, std::string_view field, double value, std::string_view allowed) {
  if (!holds) throw ContractError(field, value, allowed);
}

/// The shortest text that reads back as the same number; "nan" and "inf" as words.
std::string to_text(double value);

}  // namespace panonav
