#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace panonav::command {

class Session;

/// A picture of a report: a file in the folder of the page, and what a person should see in it.
struct ReportPicture {
  std::string file;
  std::string caption;
};

/// Makes the folder of a report. Throws FileError when something is there that is neither empty nor
/// an earlier report of the same verb, which holds `own_file`.
void prepare_report_folder(const std::filesystem::path& folder, std::string_view own_file,
                           std::string_view verb);

/// Tells people to open the report in `folder`; says nothing to machines.
void tell_report(const std::filesystem::path& folder, Session& session);

/// One HTML page that needs nothing but the pictures beside it: no scripts, nothing from the
/// network.
class ReportPage {
 public:
  ReportPage(std::string title, std::string lead);

  void section(std::string_view title);
  /// A numbered section. Its main figure stands at the top of the page, too, and leads here.
  void part(std::string_view title, const std::pair<std::string, std::string>& value_and_meaning);
  void text(std::string_view paragraph);
  /// Numbers that matter most, large: "0.09 m" "median error".
  void figures(const std::vector<std::pair<std::string, std::string>>& value_and_meaning);
  /// Throws ContractError when a row has another number of cells than the header.
  void table(const std::vector<std::string>& header,
             const std::vector<std::vector<std::string>>& rows);
  /// Side by side where the window is wide enough.
  void pictures(const std::vector<ReportPicture>& pictures);
  /// The same, small and with pictures in the page itself ("data:image/png;base64,..."); those
  /// without a picture have their caption alone.
  void thumbnails(const std::vector<ReportPicture>& pictures);
  /// A file beside the page to open: "track.html" "Play the run".
  void link(std::string_view file, std::string_view text);
  /// Command lines as typed.
  void commands(const std::vector<std::string>& command_lines);

  /// Writes the page into `folder`, whole or not at all. Throws FileError.
  void write(const std::filesystem::path& folder, std::string_view file = "index.html") const;

 private:
  std::string title_;
  std::string lead_;
  std::string overview_;  // a link for each part
  std::string body_;
  int parts_ = 0;
};

}  // namespace panonav::command
