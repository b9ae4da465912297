#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "panonav_server/http_server.hpp"

namespace panonav::server {

/// A memory that users of the page can choose.
struct PageMemory {
  std::string name;
  std::size_t views = 0;
};

/// The content of a form that a browser sent.
struct UploadForm {
  std::string memory;
  std::string picture;  ///< bytes of the file; empty: none was chosen
};

/// Policy that lets the page load only its style and thumbnails from this server, without scripts.
inline constexpr std::string_view page_policy =
    "default-src 'none'; img-src 'self'; style-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'";

/// Reads a form of type multipart/form-data with the fields `memory` and `image`; of several files
/// the first one that is not empty. Returns nullopt if the content is no such form.
[[nodiscard]] std::optional<UploadForm> read_upload_form(std::string_view content_type,
                                                         std::string_view body);

/// Returns the page with the form. `selected`: memory that the form shows; `answer`: JSON of
/// /v1/memories/NAME/localise, shown above the form in words with the thumbnail of the most similar
/// view; empty: none.
[[nodiscard]] std::string make_upload_page(std::span<const PageMemory> memories,
                                           std::string_view selected, std::string_view answer);
/// Returns the style of the page, which it loads from /page.css.
[[nodiscard]] std::string_view upload_page_style();

/// True if the client accepts pages, as browsers do.
[[nodiscard]] bool accepts_html(const HttpRequest& request);

}  // namespace panonav::server
