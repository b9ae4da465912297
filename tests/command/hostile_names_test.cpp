// Names of pictures and folders come from strangers: they are shown as they are and mean nothing
// to SVG, to HTML or to a script.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/command_runner.hpp"
#include "support/landmark_pictures.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

/// A data set with names that try to be more, in a folder of such a name.
class HostileNames : public ::testing::Test {
 protected:
  HostileNames() : before_(fs::current_path()) {
    fs::current_path(folder.path());
    names = {"v`touch run`.png",
             "a\"q\" 'r' \\.png",
             "<img src=x onerror=alert(1)>.png",
             "</script><script>alert(1)</script>.png",
             "{{run}} &lt;&amp; %s @x {bold}_^.png",
             "n\xC3\xA4me \xE2\x82\xAC.png"};
    std::string longest;
    while (longest.size() < 3994) longest += "./";
    names.push_back(longest + "l.png");
    std::string csv = "file,stamp_s,x_m,y_m,heading_deg,odom_x_m,odom_y_m,odom_heading_deg\n";
    const auto poses = grid_poses(5);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (i >= names.size()) names.push_back(view_name(i));
      const Pose2 pose{0.2 * poses[i].x_m, 0.2 * poses[i].y_m, 0.3};
      fs::create_directories((run / names[i]).parent_path());
      write_picture(run / names[i], world, pose);
      std::string field;
      for (const char c : names[i]) field += c == '"' ? "\"\"" : std::string(1, c);
      const std::string place = "," + to_text(pose.x_m) + "," + to_text(pose.y_m) + ",17.2";
      csv += "\"" + field + "\"," + std::to_string(i) + place + place + "\n";
    }
    write_file(run / "poses.csv", std::string_view(csv));
    write_dataset_toml(run);
  }
  ~HostileNames() override {
    EXPECT_FALSE(fs::exists("run")) << "a name was run as a command";
    fs::current_path(before_);
  }

  /// The page holds its own elements alone. Gives its text as a browser shows it.
  static std::string text_of(const fs::path& file) {
    const std::string page = bytes_of(file);
    static const std::set<std::string> own{
        "!doctype",    "html",     "head",        "meta",   "title",    "style",
        "body",        "h1",       "h2",          "p",      "div",      "b",
        "a",           "figure",   "figcaption",  "img",    "table",    "tr",
        "th",          "td",       "nav",         "small",  "pre",      "script",
        "canvas",      "button",   "input",       "label",  "select",   "option",
        "span",        "svg",      "circle",      "rect",   "path",     "link",
        "header",      "main",     "footer",      "output", "noscript", "pn-map",
        "pn-pictures", "pn-facts", "pn-timeline", "pn-run", "pn-plan",  "pn-chart",
        "h3",          "i"};
    std::string body = page;
    for (const std::string raw : {"script", "style"}) {
      for (std::size_t begin = 0; (begin = body.find("<" + raw, begin)) != std::string::npos;) {
        const std::size_t end = body.find("</", begin);
        EXPECT_EQ(body.substr(end, raw.size() + 3), "</" + raw + ">");
        body.erase(begin, end - begin);
      }
    }
    const std::regex element("<(/?)([^ >/]*)");
    for (std::sregex_iterator i(body.begin(), body.end(), element), end; i != end; ++i) {
      EXPECT_TRUE(own.contains((*i)[2].str())) << i->str();
    }
    EXPECT_FALSE(contains(page, "<img src=x"));
    std::string text = body;
    for (const auto& [code, character] : std::vector<std::pair<std::string, std::string>>{
             {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&#39;", "'"}, {"&amp;", "&"}}) {
      for (std::size_t at = 0; (at = text.find(code, at)) != std::string::npos; ++at) {
        text.replace(at, code.size(), character);
      }
    }
    return text;
  }

  TemporaryFolder folder;
  ToyWorld world = landmark_world(11);
  fs::path run = folder / "r`touch run` '\"<b>\n&";
  std::vector<std::string> names;

 private:
  fs::path before_;
};

TEST_F(HostileNames, HomeReportShowsThem) {
  const fs::path report = folder / "h`touch run`\n'\"<i>";
  run_well({"home", run / names[0], run, "--report", report});
  const std::string text = text_of(report / "index.html");
  for (const std::string& name : names) EXPECT_TRUE(contains(text, ">" + name + "</td>"));
  EXPECT_TRUE(contains(text, "Direction home"));
}

TEST_F(HostileNames, CatchmentReportShowsThem) {
  const fs::path report = folder / "c`touch run`\n'\"<i>";
  run_well({"catchment", run, "--report", report});
  EXPECT_TRUE(contains(text_of(report / "index.html"), "Home vectors from above"));
}

TEST_F(HostileNames, GalleryExportAndAnswersShowThem) {
  const fs::path memory = folder / "m`touch run`<b>.panonav";
  run_well({"memorise", memory, run});
  run_well({"rename", memory, "25", "../../outside.png"});
  const fs::path gallery = folder / "g`touch run`";
  run_well({"gallery", memory, "-o", gallery});
  const std::string text = text_of(gallery / "gallery.html");
  for (std::size_t i = 0; i < 24; ++i) EXPECT_TRUE(contains(text, ": " + names[i] + ", x "));

  const fs::path out = folder / "e`touch run`\n'\"<i>";
  const auto said = answer_of({"export", memory, "-o", out, "--json"});
  EXPECT_EQ(said["images"], 25);
  EXPECT_FALSE(fs::exists(folder / "outside.png"));
  EXPECT_FALSE(fs::exists(out.parent_path().parent_path() / "outside.png"));
  EXPECT_EQ(said["renamed"], 2) << "the long name and the one that leads outside";
  const fs::path again = folder / "again.panonav";
  run_well({"memorise", again, out, "--config", out / "memorise.toml"});
  const auto list = answer_of({"list", again, "--json"})["views"];
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(list[i]["name"], names[i]);

  const fs::path report = folder / "l`touch run`";
  run_well({"localise", memory, run, "--report", report, "-o", folder / "answers.csv"});
  const std::string page = text_of(report / "index.html");
  for (std::size_t i = 0; i < 6; ++i) EXPECT_TRUE(contains(page, ">" + names[i] + "</td>"));
}

TEST_F(HostileNames, PicturesAndTheTrackedRunOfThem) {
  const fs::path memory = folder / "m`touch run`.panonav";
  run_well({"memorise", memory, run});
  const fs::path picture = folder / "p`touch run`\n'\".png";
  run_well({"arrange", memory, "--picture", picture});
  EXPECT_GT(fs::file_size(picture), 2000U);
  const fs::path report = folder / "t`touch run`";
  const auto tracked = run_panonav({"track", memory, run, "--report", report});
  ASSERT_TRUE(tracked.exit_code == 0 || tracked.exit_code == 1) << tracked.err;
  const std::string text = text_of(report / "index.html");
  EXPECT_FALSE(contains(text, "alert(1)")) << "outside of the script element";
  const std::string page = bytes_of(report / "index.html");
  EXPECT_TRUE(contains(page, "\\u003c/script>\\u003cscript>alert(1)"));
}

}  // namespace
}  // namespace panonav::testing
