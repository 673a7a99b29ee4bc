#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace grouser::server {

/// The alias that a bare model name means.
inline constexpr std::string_view kDefaultAlias = "stable";
/// Moves to every job's candidate by itself.
inline constexpr std::string_view kCandidateAlias = "candidate";
/// What stable was before its last move; moves with it.
inline constexpr std::string_view kPreviousAlias = "previous";
/// What some clients try before it becomes stable.
inline constexpr std::string_view kCanaryAlias = "canary";
/// Fewest hex digits that may stand for a digest.
inline constexpr std::size_t kMinDigestDigits = 12;

/// A parsed model reference: "name", "name@alias" or "name@sha256:HEX".
/// Views into the text it was parsed from.
struct ModelReference {
  std::string_view name;
  std::string_view alias;          ///< empty when a digest is given
  std::string_view digest_prefix;  ///< empty when an alias is given
};

/// Empty text gives an empty reference ("the only model"). On a malformed
/// reference returns nothing and says why in `problem`.
std::optional<ModelReference> ParseModelReference(std::string_view text, std::string* problem);

/// A digest, or so many of its first digits that it may stand for it: kMinDigestDigits to 64
/// lower-case hex digits.
bool IsDigestPrefix(std::string_view text);

/// Lower-case letter first, then letters, digits, '_' or '-'; at most 64
/// characters; not "sha256".
bool IsAliasName(std::string_view text);

/// `text` in quotes, cut to 100 characters: it ends up in status messages,
/// whose size gRPC limits.
std::string Quote(std::string_view text);

}  // namespace grouser::server
