#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

// The engine's JSON: it stands without libraries.

namespace grouser::dem {

inline std::string JsonText(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    char escaped[8];
    if (c == '"' || c == '\\') out += '\\';
    std::snprintf(escaped, sizeof(escaped), "\\u%04x", c);
    out += static_cast<unsigned char>(c) < 0x20 ? std::string(escaped) : std::string(1, c);
  }
  return out + "\"";
}

/// null where it is not finite: JSON has no word for it.
inline std::string JsonNumber(double value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%.10g", value);
  return std::isfinite(value) ? text : "null";
}

/// One object; its fields in the order of the calls.
class JsonObject {
 public:
  JsonObject& Text(const std::string& key, const std::string& value) {
    return Raw(key, JsonText(value));
  }
  JsonObject& Number(const std::string& key, double value) { return Raw(key, JsonNumber(value)); }
  JsonObject& Flag(const std::string& key, bool value) {
    return Raw(key, value ? "true" : "false");
  }
  JsonObject& Numbers(const std::string& key, const std::vector<double>& values) {
    std::string list;
    for (const double v : values) list += (list.empty() ? "" : ", ") + JsonNumber(v);
    return Raw(key, "[" + list + "]");
  }
  JsonObject& Raw(const std::string& key, const std::string& json) {
    fields_ += (fields_.empty() ? "" : ", ") + JsonText(key) + ": " + json;
    return *this;
  }
  std::string Done() const { return "{" + fields_ + "}"; }

 private:
  std::string fields_;
};

}  // namespace grouser::dem
