#include "panonav/core/error.hpp"

#include <array>
#include <charconv>

#include "panonav/core/address.hpp"

namespace panonav {

namespace {

std::string format_fault(std::string_view field, std::string_view value, std::string_view allowed) {
  return std::string(field).append(" is ").append(value).append("; allowed: ").append(allowed);
}

}  // namespace

std::string to_text(double value) {
  std::array<char, 64> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), result.ptr};
}

ContractError::ContractError(std::string_view field, std::string_view value,
                             std::string_view allowed)
    : Error(format_fault(field, value, allowed)) {}

ContractError::ContractError(std::string_view field, double value, std::string_view allowed)
    : Error(format_fault(field, to_text(value), allowed)) {}

FileError::FileError(std::string_view path, std::string_view fault)
    : Error((is_address(path) ? mask_credentials(path) : std::string(path)) + ": " +
            std::string(fault)) {}

}  // namespace panonav
