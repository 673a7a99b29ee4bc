// The web page's files: what the programs serve below /ui/, and that nothing else is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "proto/records/sha256.h"
#include "tests/integration/http_wire.h"
#include "tests/integration/query_fixture.h"
#include "tests/unit/server/temp_dir.h"

namespace grouser {
namespace {

using testing::Exchange;
using testing::Get;
using ::testing::HasSubstr;
using ::testing::Not;

std::string FileText(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(std::string(GROUSER_CLIENTS) + name).rdbuf();
  return text.str();
}

TEST(WebPage, BothProgramsServeEveryFileThatThePageNames) {
  testing::TempDir dir;
  for (const std::string program : {"grouser-server", "grouser-jobs"}) {
    std::vector<std::string> options = {"--http", "127.0.0.1:0"};
    if (program == "grouser-server") options.push_back("--no-lcm");
    testing::ServerProcess server(dir.path(), options, program);
    const auto root = Get(server.http(), "/");
    EXPECT_EQ(root.status, 302);
    EXPECT_THAT(root.head, HasSubstr("Location: ui/\r\n"));
    const auto page = Get(server.http(), "/ui/?model=sand");
    EXPECT_EQ(page.body, FileText("/web/index.html"));
    EXPECT_THAT(page.head, HasSubstr("Content-Type: text/html; charset=utf-8\r\n"));

    // From the page on, all that it and its modules load.
    static const std::regex kLoaded(R"((?:src=|href=|from )["']([^"']+)["'])");
    std::set<std::string> known;
    std::vector<std::string> texts = {page.body};
    for (std::size_t i = 0; i < texts.size(); ++i) {
      const std::string text = texts[i];
      for (std::sregex_iterator at(text.begin(), text.end(), kLoaded), end; at != end; ++at) {
        std::string name = (*at)[1];
        if (name.starts_with("data:")) continue;
        if (name.starts_with("./")) name.erase(0, 2);
        if (!known.insert(name).second) continue;
        const auto file = Get(server.http(), "/ui/" + name);
        EXPECT_EQ(file.status, 200) << name;
        EXPECT_EQ(file.body, FileText((name == "page.css" ? "/common/" : "/web/") + name)) << name;
        const std::string type = name.ends_with(".js") ? "text/javascript" : "text/css";
        EXPECT_THAT(file.head, HasSubstr("Content-Type: " + type + "; charset=utf-8\r\n"));
        EXPECT_THAT(file.head, HasSubstr("X-Content-Type-Options: nosniff\r\n"));
        EXPECT_THAT(file.head, HasSubstr("script-src 'self'; style-src 'self'"));
        EXPECT_THAT(file.head, HasSubstr("frame-ancestors 'none'"));
        texts.push_back(file.body);
      }
    }
    EXPECT_GE(known.size(), 10u);
  }
}

TEST(WebPage, NoPathLeadsOutOfItsFiles) {
  testing::TempDir dir;
  testing::ServerProcess server(dir.path(), {"--no-lcm", "--http", "127.0.0.1:0"});
  for (const std::string path :
       {"/ui/../ui/main.js", "/ui/..", "/ui//main.js", "/ui/./main.js", "/ui/%2e%2e/etc/passwd",
        "/ui/..%2f..%2fetc/passwd", "/ui/../../../../etc/passwd", "/ui/\\..\\main.js",
        "/ui//etc/passwd", "/ui/main.js/", "/ui/main.js%00.css", "/ui/MAIN.JS", "/uix", "/main.js",
        "/ui/web", "/ui/.", "/ui/main"}) {
    const auto answer = Get(server.http(), path);
    EXPECT_EQ(answer.status, 404) << path;
    EXPECT_THAT(answer.body, HasSubstr("NOT_FOUND")) << path;
  }
  EXPECT_EQ(Get(server.http(), "/ui/" + std::string(7000, 'a')).status, 404);
  EXPECT_EQ(Get(server.http(), "/ui/" + std::string(9000, 'a')).status, 431);
  EXPECT_EQ(Get(server.http(), "/ui/main.js", "Host: evil.example\r\n").status, 403);
  for (const std::string method : {"POST", "PUT", "DELETE", "OPTIONS"}) {
    const auto refused =
        Exchange(server.http(), method + " /ui/main.js HTTP/1.1\r\nHost: localhost\r\n" +
                                    "Content-Length: 2\r\nConnection: close\r\n\r\n{}");
    EXPECT_EQ(refused.status, 405) << method;
    EXPECT_THAT(refused.head, HasSubstr("Allow: GET, HEAD\r\n"));
  }
  EXPECT_EQ(Exchange(server.http(),
                     "POST /ui/ HTTP/1.1\r\nHost: localhost\r\n"
                     "Content-Length: 9999999999\r\n\r\n")
                .status,
            413);
  const auto head = Exchange(server.http(),
                             "HEAD /ui/main.js HTTP/1.1\r\nHost: localhost\r\n"
                             "Connection: close\r\n\r\n");
  EXPECT_EQ(head.status, 200);
  EXPECT_THAT(
      head.head,
      HasSubstr("Content-Length: " + std::to_string(FileText("/web/main.js").size()) + "\r\n"));
  EXPECT_EQ(head.body, "");
  EXPECT_EQ(Get(server.http(), "/healthz").body, "ok\n");
}

TEST(WebPage, ItIsOpenWhereCallsNeedATokenAndClosedWhereOthersReachIt) {
  testing::TempDir dir;
  std::ofstream(dir / "rights.yaml")
      << "format: grouser-rights/1\ncallers:\n  - {name: a, role: read, token_sha256: "
      << records::Sha256OfString("secret") << "}\n";
  testing::ServerProcess server(
      dir.path(), {"--no-lcm", "--http", "127.0.0.1:0", "--rights", dir / "rights.yaml"});
  EXPECT_EQ(Get(server.http(), "/ui/").status, 200);  // it has to ask for the token
  EXPECT_EQ(Get(server.http(), "/buildinfo").status, 401);

  testing::ServerProcess open(dir.path(), {"--no-lcm", "--http", "0.0.0.0:0", "--http-insecure"});
  for (const std::string path : {"/", "/ui/", "/ui/main.js"}) {
    const auto refused = Get(open.http(), path);
    EXPECT_EQ(refused.status, 403) << path;
    EXPECT_THAT(refused.body, HasSubstr("an address of this machine alone"));
    EXPECT_THAT(refused.body, Not(HasSubstr("<html")));
  }
}

}  // namespace
}  // namespace grouser
