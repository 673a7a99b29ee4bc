#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include "server/core/model_reference.h"
#include "server/core/status.h"

namespace grouser::server {

/// Pages of lists, as https://google.aip.dev/158 has them.
inline constexpr int kDefaultPageSize = 100;
/// A page ends before its entries take more, whatever its size; a whole answer stays
/// below 1 MB, a quarter of what clients take unless told otherwise.
inline constexpr std::size_t kMaxPageBytes = 900'000;

/// How many entries a page may have: `asked`, the default for 0, at most `most`.
/// INVALID_ARGUMENT for a negative number.
inline Status ReadPageSize(int asked, int most, int* size) {
  if (asked < 0) {
    return Status::InvalidArgument(fmt::format("page_size: {}, expected 0 or more", asked));
  }
  *size = std::min(asked == 0 ? kDefaultPageSize : asked, most);
  return Status::Ok();
}

/// For a token that no page gave.
inline Status BadPageToken(std::string_view token) {
  return Status::InvalidArgument(fmt::format(
      "page_token: {}, expected the next_page_token of the page before, or none", Quote(token)));
}

/// Adds `entry` to a page unless that would make it too long. The first always fits: no single
/// entry is that long.
template <class Entry, class Entries>
bool AddToPage(Entry entry, std::size_t* bytes, Entries* page) {
  *bytes += entry.ByteSizeLong();
  if (*bytes > kMaxPageBytes && !page->empty()) return false;
  *page->Add() = std::move(entry);
  return true;
}

}  // namespace grouser::server
