#pragma once

#include <optional>
#include <string_view>

#include "panonav_server/http_server.hpp"

namespace panonav::server {

/// Returns the refusal (status 401 or 403) of a request that may not be answered; nullopt if it
/// may. Without a token, the request must be of the same origin (`is_same_origin`). With a token,
/// it must send the token, as a bearer token or, as browsers do after asking the user, as the
/// password of any user name. With a password, no page of another origin may have made the request.
[[nodiscard]] std::optional<HttpAnswer> find_refusal(const HttpRequest& head,
                                                     std::string_view token);

}  // namespace panonav::server
