#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace panonav {

/// Base of everything that panonav throws. The message is one line that says what is wrong, where,
/// which value was found and which values are allowed. A missing answer (robot lost, nothing
/// visible) is not an error: functions then return an empty optional.
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
  /// The same message, with the number converted by `to_text`.
  ContractError(std::string_view field, double value, std::string_view allowed);
};

/// One or more option values are out of range. The message lists every fault.
class OptionError : public Error {
 public:
  using Error::Error;
};

/// A file is missing, unreadable, damaged, of the wrong type or version, or cannot be written.
class FileError : public Error {
 public:
  /// Message "`path`: `fault`"; passwords in an address are masked. `fault` should name field,
  /// value and allowed range, if there are any.
  FileError(std::string_view path, std::string_view fault);
};

/// Throws ContractError(field, value, allowed) unless `holds`.
inline void require(bool holds, std::string_view field, double value, std::string_view allowed) {
  if (!holds) throw ContractError(field, value, allowed);
}

/// Returns the shortest text that reads back as the same number, or "nan" or "inf".
std::string to_text(double value);

}  // namespace panonav
