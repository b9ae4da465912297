#pragma once

#include <string>
#include <string_view>

namespace panonav {

/// True if the text has the form of an address, "SCHEME://...", and is therefore not a path.
[[nodiscard]] bool is_address(std::string_view text);

/// Replaces the password of an address, and the values of parameters such as `password` and
/// `token`, by "***"; returns any other text unchanged. The whole text is taken as one address,
/// even if it has unescaped characters, so that rather too much is hidden than too little.
[[nodiscard]] std::string mask_credentials(std::string_view address);

/// Makes `mask_passwords` recognise this address in texts, even if it contains blanks and quotes.
/// Addresses without secrets are not stored. Thread-safe. Memory: each address once.
void remember_address(std::string_view address);

/// Replaces the passwords of all addresses in a text by "***": of remembered addresses, plain or
/// escaped for JSON or a shell, and of other addresses, which end at a blank or quote.
[[nodiscard]] std::string mask_passwords(std::string_view text);

}  // namespace panonav
