#include "panonav/core/address.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <vector>

#include "panonav/core/text.hpp"

namespace panonav {

namespace {

constexpr std::string_view separator = "://";

// Orders the remembered addresses by length, longest first, so that an address is masked before
// another one that is a part of it.
struct LongerFirst {
  bool operator()(const std::string& a, const std::string& b) const {
    return a.size() != b.size() ? a.size() > b.size() : a < b;
  }
};
struct RememberedAddresses {
  std::mutex mutex;
  std::map<std::string, std::string, LongerFirst> masks;
};

RememberedAddresses& remembered_addresses() {
  static RememberedAddresses remembered;
  return remembered;
}

bool is_secret_parameter(std::string_view name) {
  constexpr std::array<std::string_view, 8> words{"pass", "pwd",  "token", "secret",
                                                  "auth", "cred", "key",   "sig"};
  const std::string lower = to_lower_case(name);
  return lower != "sslkey" && std::ranges::any_of(words, [&](std::string_view word) {
           return lower.find(word) != std::string::npos;
         });
}

/// Replaces bytes that are not UTF-8 by U+FFFD, as writers of JSON do.
std::string replace_bad_bytes(std::string_view text) {
  std::string replaced;
  while (!text.empty()) {
    std::size_t size = 1;
    while (size < std::min<std::size_t>(4, text.size()) && !is_utf8(text.substr(0, size))) ++size;
    const bool is_character = is_utf8(text.substr(0, size));
    replaced += is_character ? text.substr(0, size) : "\xEF\xBF\xBD";
    text.remove_prefix(is_character ? size : 1);
  }
  return replaced;
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  if (from.empty() || from == to) return;
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
}

// Replaces each of these characters of the text by its escape.
std::string escape(std::string_view text,
                   const std::vector<std::pair<char, std::string>>& escapes) {
  std::string escaped;
  for (const char c : text) {
    const auto found = std::ranges::find(escapes, c, &std::pair<char, std::string>::first);
    escaped += found == escapes.end() ? std::string(1, c) : found->second;
  }
  return escaped;
}

// Replaces passwords and secret parameters of an address by "***". `is_complete_address`: no other
// text follows the address, so that text after the host's colon that is not a number cannot be a
// port.
std::string mask(std::string_view address, bool is_complete_address) {
  const std::size_t scheme = address.find(separator);
  if (scheme == std::string_view::npos) return std::string(address);
  std::vector<bool> hidden(address.size(), false);
  const auto hide = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) hidden[i] = true;
  };
  // Hides everything between the colon and the last @, because a password may contain any unescaped
  // character.
  const std::size_t colon = address.find(':', scheme + separator.size());
  const std::size_t at = address.rfind('@');
  if (at != std::string_view::npos && colon < at) {
    hide(colon + 1, at);
  } else if (is_complete_address && colon != std::string_view::npos &&
             !address.substr(scheme + 3).starts_with('[')) {
    // Text after the colon that is not a port is taken for a password before a forgotten @ and
    // host.
    const std::size_t end = std::min(address.find_first_of("/?#,", colon), address.size());
    const std::string_view port = address.substr(colon + 1, end - colon - 1);
    if (port.find_first_not_of("0123456789") != std::string_view::npos) hide(colon + 1, end);
  }
  for (std::size_t from = address.find('?', scheme); from < address.size();) {
    const std::size_t end = std::min(address.find_first_of("&;", from + 1), address.size());
    const std::size_t equals = address.find('=', from);
    // Leaves a value that is masked already, even if a colon follows the mask.
    if (equals < end && !address.substr(equals + 1).starts_with("***:") &&
        is_secret_parameter(address.substr(from + 1, equals - from - 1))) {
      hide(equals + 1, end);
    }
    from = end;
  }
  std::string masked;
  for (std::size_t i = 0; i < address.size(); ++i) {
    if (!hidden[i]) {
      masked += address[i];
    } else if (i == 0 || !hidden[i - 1]) {
      masked += "***";
    }
  }
  return masked;
}

}  // namespace

bool is_address(std::string_view text) {
  const std::size_t colon = text.find(separator);
  return colon != std::string_view::npos && colon > 0 &&
         std::ranges::all_of(text.substr(0, colon), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '+' || c == '-' || c == '.';
         });
}

std::string mask_credentials(std::string_view address) {
  return mask(address, true);
}

void remember_address(std::string_view address) {
  std::string masked = mask_credentials(address);
  if (masked == address) return;
  RememberedAddresses& remembered = remembered_addresses();
  const std::lock_guard lock(remembered.mutex);
  remembered.masks.try_emplace(std::string(address), std::move(masked));
}

std::string mask_passwords(std::string_view text) {
  std::string masked_text(text);
  {
    RememberedAddresses& remembered = remembered_addresses();
    const std::lock_guard lock(remembered.mutex);
    for (const auto& [address, mask] : remembered.masks) {
      replace_all(masked_text, address, mask);
      replace_all(masked_text, to_readable_line(address), mask);
      replace_all(masked_text, replace_bad_bytes(address), mask);
      replace_all(masked_text, escape(address, {{'"', "\\\""}, {'\\', "\\\\"}, {'\t', "\\t"}}),
                  mask);
      replace_all(masked_text, escape(address, {{'\'', "'\\''"}}), mask);
    }
  }
  std::string result;
  for (std::string_view rest = masked_text; !rest.empty();) {
    const std::size_t colon = std::min(rest.find(separator), rest.size());
    const std::size_t end =
        colon == rest.size() ? colon : std::min(rest.find_first_of(" \t\n\"'", colon), rest.size());
    result += mask(rest.substr(0, end), false);
    rest.remove_prefix(end);
  }
  return result;
}

}  // namespace panonav
