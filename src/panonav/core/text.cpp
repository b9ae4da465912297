#include "panonav/core/text.hpp"

#include <iomanip>
#include <sstream>

namespace panonav {

std::string fixed(double value, int digits) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value;
  const std::string shown = text.str();
  // What rounds to nothing has no sign.
  const bool nothing = shown.find_first_not_of("-0.") == std::string::npos;
  return nothing && shown.front() == '-' ? shown.substr(1) : shown;
}

std::string short_number(double value) {
  std::ostringstream text;
  text << std::setprecision(6) << value;
  return text.str();
}

}  // namespace panonav
