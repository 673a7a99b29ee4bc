#pragma once

#include <numbers>
#include <string>

namespace grouser::surrogate {

inline constexpr double kDegPerRad = 180 / std::numbers::pi;  ///< angles are printed in degrees

/// A JSON text that grows in order; NaN and infinity become the strings "NaN",
/// "Infinity", "-Infinity", as protobuf's JSON writes them.
class Json {
 public:
  Json& Open(char bracket);   ///< '{' or '['
  Json& Close(char bracket);  ///< '}' or ']'
  Json& Key(const std::string& name);
  Json& Value(double value);
  Json& Value(int value);
  Json& Value(bool value);
  Json& Value(const std::string& value);
  Json& Value(const char* value) { return Value(std::string(value)); }
  Json& Raw(const std::string& json);
  const std::string& text() const { return text_; }

 private:
  void Separate();
  std::string text_;
  bool fresh_ = true;
};

}  // namespace grouser::surrogate
