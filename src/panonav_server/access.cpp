#include "panonav_server/access.hpp"

#include <string>

#include "panonav_server/json_answer.hpp"

namespace panonav::server {

namespace {

/// Decodes base64 up to its padding; nullopt on any other character.
std::optional<std::string> decode_base64(std::string_view text) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  while (text.ends_with('=')) text.remove_suffix(1);
  std::string bytes;
  unsigned bits = 0;
  int bit_count = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == digits.npos) return std::nullopt;
    bits = (bits << 6U | static_cast<unsigned>(digit)) & 0xFFFFU;
    bit_count += 6;
    if (bit_count < 8) continue;
    bit_count -= 8;
    bytes += static_cast<char>(bits >> static_cast<unsigned>(bit_count) & 0xFFU);
  }
  return bytes;
}

/// True if no page, or a page of the named host, made the request. The scheme may be that of a
/// proxy.
bool is_from_own_page(const HttpRequest& head) {
  const std::size_t name = head.origin.find("://");
  return head.origin.empty() ||
         (name != head.origin.npos && head.origin.substr(name + 3) == head.host);
}

bool has_token(const HttpRequest& head, std::string_view token) {
  constexpr std::string_view bearer = "Bearer ";
  constexpr std::string_view basic = "Basic ";
  const std::string_view sent = head.authorization;
  if (sent.starts_with(bearer)) return is_same_secret(sent.substr(bearer.size()), token);
  if (!sent.starts_with(basic) || !is_from_own_page(head)) return false;
  const auto user_and_password = decode_base64(sent.substr(basic.size()));
  if (!user_and_password) return false;
  const std::size_t colon = user_and_password->find(':');
  return colon != user_and_password->npos &&
         is_same_secret(std::string_view(*user_and_password).substr(colon + 1), token);
}

}  // namespace

std::optional<HttpAnswer> find_refusal(const HttpRequest& head, std::string_view token) {
  if (token.empty()) {
    if (is_same_origin(head)) return std::nullopt;
    return make_error(403,
                      "without a token this server answers programs that call it by its number or "
                      "as localhost");
  }
  if (has_token(head, token)) return std::nullopt;
  return make_error(401,
                    "the token of this server is missing: Authorization: Bearer TOKEN; in a "
                    "browser, enter it as the password");
}

}  // namespace panonav::server
