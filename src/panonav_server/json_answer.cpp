#include "panonav_server/json_answer.hpp"

#include <string>

#include "panonav/core/text.hpp"

namespace panonav::server {

using nlohmann::ordered_json;

HttpAnswer make_json_answer(const ordered_json& document, int status) {
  return {.status = status,
          .type = "application/json",
          .content = document.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n"};
}

HttpAnswer make_error(int status, std::string_view why) {
  return make_json_answer({{"error", to_readable_line(std::string(why))}}, status);
}

}  // namespace panonav::server
