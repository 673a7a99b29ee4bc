#include "server/core/model_reference.h"

#include <algorithm>

namespace grouser::server {
namespace {

constexpr std::string_view kDigestMark = "sha256:";
constexpr std::size_t kDigestDigits = 64;
constexpr std::size_t kMaxAliasLength = 64;
constexpr std::size_t kMaxQuoted = 100;

bool IsLowerHex(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }
bool IsLower(char c) { return c >= 'a' && c <= 'z'; }
bool IsAliasCharacter(char c) {
  return IsLower(c) || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

}  // namespace

std::string Quote(std::string_view text) {
  std::size_t end = std::min(text.size(), kMaxQuoted);
  // Not inside a UTF-8 character: protobuf would refuse the text.
  while (end > 0 && end < text.size() && (text[end] & 0xc0) == 0x80) --end;
  std::string quoted = "'";
  quoted.append(text.substr(0, end));
  quoted.append(end < text.size() ? "...'" : "'");
  return quoted;
}

bool IsDigestPrefix(std::string_view text) {
  return text.size() >= kMinDigestDigits && text.size() <= kDigestDigits &&
         std::all_of(text.begin(), text.end(), IsLowerHex);
}

bool IsAliasName(std::string_view text) {
  return !text.empty() && text.size() <= kMaxAliasLength && text != "sha256" &&
         IsLower(text.front()) && std::all_of(text.begin(), text.end(), IsAliasCharacter);
}

std::optional<ModelReference> ParseModelReference(std::string_view text, std::string* problem) {
  ModelReference reference;
  if (text.empty()) return reference;
  const std::size_t at = text.find('@');
  reference.name = text.substr(0, at);
  if (reference.name.empty()) {
    *problem = Quote(text) + " has no name before '@'";
    return std::nullopt;
  }
  if (at == std::string_view::npos) {
    reference.alias = kDefaultAlias;
    return reference;
  }
  const std::string_view rest = text.substr(at + 1);
  if (!rest.starts_with(kDigestMark)) {
    if (!IsAliasName(rest)) {
      *problem = Quote(text) + ": expected an alias or sha256:HEX after '@'";
      return std::nullopt;
    }
    reference.alias = rest;
    return reference;
  }
  reference.digest_prefix = rest.substr(kDigestMark.size());
  if (!IsDigestPrefix(reference.digest_prefix)) {
    *problem = Quote(text) + ": expected 12 to 64 lower-case hex digits after sha256:";
    return std::nullopt;
  }
  return reference;
}

}  // namespace grouser::server
