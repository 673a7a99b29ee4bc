#pragma once

#include <span>
#include <string>
#include <string_view>

#include "server/net/http/http_message.h"

namespace grouser::server {

/// A file of clients/web, built into the program.
struct WebFile {
  std::string_view name, content_type, content;
};
std::span<const WebFile> WebFiles();

/// Whether a path is of the web page: "/", and "/ui" with all below it.
bool IsOfWebPage(std::string_view path);

/// GET of such a path: the file "/ui/NAME", for "/ui/" index.html, from "/" and "/ui" a redirect to
/// it. NOT_FOUND for all else: names are compared as they are, no path reaches the file system. The
/// page may load and call what comes from this address alone; it tells nothing of the server before
/// it calls.
HttpAnswer WebPage(std::string_view path);

}  // namespace grouser::server
