#include "panonav_server/internal/http_head.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "panonav/core/text.hpp"

namespace panonav::server {

namespace {

class HeadReader {
 public:
  HeadReader(const char* version, std::size_t max_body, HttpRequest& request)
      : max_body_(max_body), request_(request), line_end_(version + std::strlen(version)) {}

  /// Called by libmicrohttpd for each field, in their order.
  static MHD_Result read(void* self, MHD_ValueKind /*kind*/, const char* name, const char* value) {
    auto& head = *static_cast<HeadReader*>(self);
    if (value == nullptr) value = "";
    head.check_line_ends(name, value);
    head.read_field(to_lower_case(name), value);
    return MHD_YES;
  }

  /// Returns the result for a head of `bytes` bytes from `begin` on.
  HttpHead finish(const char* begin, std::size_t bytes) {
    const bool ends_there = has_whole_lines_ && line_end_ + 4 == begin + bytes;
    if (bytes > max_head_bytes) {
      result_.status = 431;
    } else if (request_.host.empty() || (is_lenient_version() && !ends_there)) {
      set_refusal(400);
    }
    return result_;
  }

 private:
  void set_refusal(int status) {
    if (result_.status == 0) result_.status = status;
  }

  /// Detects malformed lines that a lenient libmicrohttpd accepts and other programs parse
  /// differently: folded lines, and lines that end in "\n" or "\r" alone. It parses in place and
  /// replaces the end of each line by as many zeros, so the distance to the next field shows the
  /// length of that end.
  void check_line_ends(const char* name, const char* value) {
    has_whole_lines_ = has_whole_lines_ && line_end_ + 2 == name;
    line_end_ = value + std::strlen(value);
  }

  void read_field(const std::string& name, std::string_view value) {
    constexpr std::string_view others = "!#$%&'*+-.^_`|~";
    const auto is_token = [&](unsigned char c) {
      return (c < 0x80 && std::isalnum(c) != 0) || others.find(static_cast<char>(c)) != others.npos;
    };
    const auto is_text = [](unsigned char c) { return (c >= ' ' && c != 0x7F) || c == '\t'; };
    if (name.empty() || !std::ranges::all_of(name, is_token) ||
        !std::ranges::all_of(value, is_text)) {
      set_refusal(400);
    }
    if (name == "host") read_unique_field(request_.host, value);
    if (name == "origin") read_unique_field(request_.origin, value);
    if (name == "authorization") read_unique_field(request_.authorization, value);
    if (name == "content-type") read_unique_field(request_.content_type, value);
    if (name == "accept") request_.accept.append(request_.accept.empty() ? "" : ",").append(value);
    if (name == "transfer-encoding") set_refusal(501);
    if (name == "content-length") read_length(value);
  }
  void read_unique_field(std::string& field, std::string_view value) {
    if (!field.empty() || value.empty()) set_refusal(400);
    field = value;
  }
  void read_length(std::string_view value) {
    const char* const end = value.data() + value.size();
    const auto [read, error] = std::from_chars(value.data(), end, result_.body_bytes);
    if (std::exchange(has_length_, true) || error == std::errc::invalid_argument || read != end) {
      set_refusal(400);
    } else if (error != std::errc() || result_.body_bytes > max_body_) {
      set_refusal(413);
    }
  }

  std::size_t max_body_;
  HttpRequest& request_;
  HttpHead result_;
  bool has_length_ = false;
  const char* line_end_;         // end of the previous line's text
  bool has_whole_lines_ = true;  // each line so far ended in "\r\n"
};

}  // namespace

bool is_lenient_version() {
  const std::string_view version = MHD_get_version();
  return version.starts_with("0.9.") && version < "0.9.77";
}

HttpHead read_http_head(MHD_Connection* handle, const char* method, const char* version,
                        std::size_t max_body, HttpRequest& request) {
  HeadReader reader(version, max_body, request);
  MHD_get_connection_values(handle, MHD_HEADER_KIND, &HeadReader::read, &reader);
  const auto add_argument = [](void* read, MHD_ValueKind, const char* name, const char* value) {
    static_cast<HttpRequest*>(read)->arguments[name] = value == nullptr ? "" : value;
    return MHD_YES;
  };
  MHD_get_connection_values(handle, MHD_GET_ARGUMENT_KIND, add_argument, &request);
  const auto* const size = MHD_get_connection_info(handle, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
  return reader.finish(method, size->header_size);
}

}  // namespace panonav::server
