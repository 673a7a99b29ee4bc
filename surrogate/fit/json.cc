#include "surrogate/fit/json.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace grouser::surrogate {

void Json::Separate() {
  if (!fresh_) text_ += ',';
  fresh_ = false;
}

Json& Json::Open(char bracket) {
  Separate();
  text_ += bracket;
  fresh_ = true;
  return *this;
}

Json& Json::Close(char bracket) {
  text_ += bracket;
  fresh_ = false;
  return *this;
}

Json& Json::Key(const std::string& name) {
  Value(name);
  text_ += ':';
  fresh_ = true;
  return *this;
}

Json& Json::Value(double value) {
  if (std::isnan(value)) return Value("NaN");
  if (std::isinf(value)) return Value(value > 0 ? "Infinity" : "-Infinity");
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.17g", value);
  return Raw(buffer);
}

Json& Json::Value(int value) { return Raw(std::to_string(value)); }

Json& Json::Value(bool value) { return Raw(value ? "true" : "false"); }

Json& Json::Value(const std::string& value) {
  // Bytes that are no UTF-8 are replaced: the text stays JSON.
  const nlohmann::json text = value;
  return Raw(text.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

Json& Json::Raw(const std::string& json) {
  Separate();
  text_ += json;
  return *this;
}

}  // namespace grouser::surrogate
