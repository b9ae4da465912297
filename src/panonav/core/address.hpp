#pragma once

#include <string>
#include <string_view>

namespace panonav {

/// True if the text has the form of an address, "SCHEME://...", after which nothing is a path.
[[nodiscard]] bool is_address(std::string_view text);

/// Returns an address with "***" for its password, and for the values of parameters such as
/// `password` and `token`; other texts as they are. The whole text is the address, whatever
/// characters were forgotten to be escaped: rather too much is hidden than too little.
[[nodiscard]] std::string mask_credentials(std::string_view address);

/// Makes `mask_passwords` recognise this address in texts, also with blanks and quotes in it.
/// Texts that need no mask are not kept. Any thread may call. Memory: each address once.
void remember_address(std::string_view address);

/// Returns a text for printing with "***" for the passwords in addresses: in those that were
/// remembered, as they stand or escaped for JSON or a shell, and in others up to a blank or quote.
[[nodiscard]] std::string mask_passwords(std::string_view text);

}  // namespace panonav
