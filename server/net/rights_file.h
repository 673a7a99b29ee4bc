#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/net/method_rights.h"

namespace grouser::server {

/// Who may do what, from a file:
///   format: grouser-rights/1
///   anyone: read               # without certificate or token; absent: nothing
///   callers:
///     - name: planner          # what records and refusals say
///       role: submit
///       certificate: planner.example      # its subject's CN, or a SAN
///     - name: release
///       role: promote
///       token_sha256: 64 hex digits       # of the token, which stands nowhere
struct Rights {
  struct Entry {
    std::string name;
    Role role = Role::kRead;
    std::string certificate;   ///< empty: a token
    std::string token_sha256;  ///< lower-case hex; empty: a certificate
  };
  std::optional<Role> anyone;
  std::vector<Entry> callers;

  /// The entry of a certificate's name; null: none.
  const Entry* OfCertificate(std::string_view name) const;
  /// The entry of a token; null: none. Takes the same time for every token of a
  /// length.
  const Entry* OfToken(const std::string& token) const;
};

/// Throws records::InputError "FILE:LINE: key ...: got X, expected Y".
Rights ReadRights(const std::string& file);

}  // namespace grouser::server
