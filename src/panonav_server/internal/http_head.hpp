#pragma once

#include <microhttpd.h>

#include <cstddef>

#include "panonav_server/http_server.hpp"

namespace panonav::server {

/// Largest head of a request, in bytes.
inline constexpr std::size_t max_head_bytes = 8192;

/// True if this version of libmicrohttpd accepts malformed heads and has no option against it.
[[nodiscard]] bool is_lenient_version();

/// Result of reading a head, besides the fields of `HttpRequest`.
struct HttpHead {
  int status = 0;              ///< error status for a refusal; 0: accepted
  std::size_t body_bytes = 0;  ///< as announced
};

/// Reads the fields of a head that libmicrohttpd has parsed. `method` and `version` are the texts
/// that libmicrohttpd gave with the head. Cost: linear in the head.
[[nodiscard]] HttpHead read_http_head(MHD_Connection* handle, const char* method,
                                      const char* version, std::size_t max_body,
                                      HttpRequest& request);

}  // namespace panonav::server
