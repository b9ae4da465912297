#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "panonav_server/http_server.hpp"

namespace panonav::server {

/// Makes an answer of one line of JSON. Bytes that are not UTF-8 become U+FFFD.
[[nodiscard]] HttpAnswer make_json_answer(const nlohmann::ordered_json& document, int status = 200);
/// Makes the answer {"error": why} as one line.
[[nodiscard]] HttpAnswer make_error(int status, std::string_view why);

}  // namespace panonav::server
