#include "server/net/rights_file.h"

#include <algorithm>
#include <cctype>

#include "proto/records/sha256.h"
#include "proto/records/yaml/yaml_section.h"

namespace grouser::server {
namespace {

using records::YamlSection;

constexpr const char* kFormat = "grouser-rights/1";
constexpr std::size_t kMaxName = 128;
constexpr std::size_t kHashDigits = 64;

Role ReadRole(YamlSection& section, const std::string& key) {
  const std::string text = section.Text(key);
  const auto role = RoleNamed(text);
  if (!role) section.Fail(key, "'" + text + "'", "read, submit, promote or admin");
  return *role;
}

/// A name goes into records and logs: no blanks and brackets that could make one
/// look like another's.
std::string ReadName(YamlSection& section, const std::string& key) {
  const std::string text = section.Text(key);
  const bool good = std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("._-+@:/*").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (text.empty() || text.size() > kMaxName || !good) {
    section.Fail(key, "'" + text.substr(0, kMaxName) + "'",
                 "1 to 128 letters, digits and . _ - + @ : / *");
  }
  return text;
}

std::string ReadHash(YamlSection& section, const std::string& key) {
  std::string text = section.Text(key);
  const bool hex =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (text.size() != kHashDigits || !hex) {
    // Not shown: it may be the token itself, put here by mistake.
    section.Fail(key, "something else", "the SHA-256 of the token, 64 hex digits");
  }
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

Rights::Entry ReadEntry(YamlSection& section) {
  Rights::Entry entry;
  entry.name = ReadName(section, "name");
  entry.role = ReadRole(section, "role");
  const bool certificate = section.Has("certificate");
  const bool token = section.Has("token_sha256");
  section.Finish();
  if (certificate == token) {
    section.Fail("name", "'" + entry.name + "' with " + (token ? "both" : "neither"),
                 "either certificate or token_sha256");
  }
  if (certificate) entry.certificate = ReadName(section, "certificate");
  if (token) entry.token_sha256 = ReadHash(section, "token_sha256");
  return entry;
}

/// Without a hint, by its time, on how much of it is right.
bool EqualInConstantTime(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char differs = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    differs = static_cast<unsigned char>(
        differs | (static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i])));
  }
  return differs == 0;
}

}  // namespace

const Rights::Entry* Rights::OfCertificate(std::string_view name) const {
  for (const Entry& entry : callers) {
    if (!entry.certificate.empty() && entry.certificate == name) return &entry;
  }
  return nullptr;
}

const Rights::Entry* Rights::OfToken(const std::string& token) const {
  const std::string hash = records::Sha256OfString(token);
  const Entry* found = nullptr;
  for (const Entry& entry : callers) {  // all of them, always
    if (EqualInConstantTime(entry.token_sha256, hash)) found = &entry;
  }
  return found;
}

Rights ReadRights(const std::string& file) {
  auto section = YamlSection::Load(file);
  Rights rights;
  const std::string format = section.Text("format");
  if (format != kFormat) section.Fail("format", "'" + format + "'", kFormat);
  if (section.Has("anyone")) rights.anyone = ReadRole(section, "anyone");
  if (section.Has("callers")) {
    for (YamlSection& caller : section.Sections("callers")) {
      rights.callers.push_back(ReadEntry(caller));
      const Rights::Entry& last = rights.callers.back();
      const auto same = [&](const Rights::Entry& e) {
        return e.certificate == last.certificate && e.token_sha256 == last.token_sha256;
      };
      if (std::count_if(rights.callers.begin(), rights.callers.end(), same) > 1) {
        caller.Fail("name", "'" + last.name + "' with a certificate or token of an entry before",
                    "each once");
      }
    }
  }
  section.Finish();
  return rights;
}

}  // namespace grouser::server
