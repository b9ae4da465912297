#include "panonav/core/error.hpp"

#include <array>
#include <charconv>

namespace panonav {

namespace {

std::string sentence(std::string_view field, std::string_view value, std::string_view allowed) {
  std::string text(field);
  text += " is ";
  text += value;
  text += "; allowed: ";
  text += allowed;
  return text;
}

}  // namespace

std::string to_text(double value) {
  std::array<char, 64> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

ContractError::ContractError(std::string_view field, std::string_view value,
                             std::string_view allowed)
    : Error(sentence(field, value, allowed)) {}

ContractError::ContractError(std::string_view field, double value, std::string_view allowed)
    : Error(sentence(field, to_text(value), allowed)) {}

FileError::FileError(std::string_view path, std::string_view what)
    : Error(std::string(path) + ": " + std::string(what)) {}

}  // namespace panonav
