#pragma once

#include <string>

namespace panonav {

/// A number with this many digits after the point, for people.
[[nodiscard]] std::string fixed(double value, int digits);

/// A number with up to six significant digits, for people: 30, not 29.999999999999996.
[[nodiscard]] std::string short_number(double value);

}  // namespace panonav
