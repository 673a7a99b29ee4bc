#include "server/net/http/web_page.h"

#include <grpcpp/support/status_code_enum.h>

#include <algorithm>

namespace grouser::server {
namespace {

constexpr std::string_view kWebFolder = "/ui/";
// Scripts and styles of files alone: text of a model or a job that is put into the page runs
// nothing.
constexpr const char* kContentSecurityPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

}  // namespace

bool IsOfWebPage(std::string_view path) {
  return path == "/" || path == "/ui" || path.starts_with(kWebFolder);
}

HttpAnswer WebPage(std::string_view path) {
  HttpAnswer answer;
  if (path == "/" || path == "/ui") {
    answer.status = 302;
    answer.content_type = "text/plain";
    answer.headers = {{"Location", "ui/"}};  // relative: a proxy may have put it into a folder
    return answer;
  }
  path.remove_prefix(kWebFolder.size());
  const std::string_view name = path.empty() ? "index.html" : path;
  const auto files = WebFiles();
  const auto file = std::ranges::find(files, name, &WebFile::name);
  if (file == files.end()) {
    return HttpError(grpc::StatusCode::NOT_FOUND, "path: no such file of the web page, see /ui/");
  }
  answer.content_type = file->content_type;
  answer.body = file->content;
  answer.headers = {{"Content-Security-Policy", kContentSecurityPolicy},
                    {"Referrer-Policy", "no-referrer"},
                    {"Cross-Origin-Resource-Policy", "same-origin"}};
  return answer;
}

}  // namespace grouser::server
