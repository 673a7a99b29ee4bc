#pragma once

#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

namespace grouser::surrogate {

inline constexpr double kDegPerRad = 180 / std::numbers::pi;  ///< angles are printed in degrees

/// Keys keep the order in which they come.
using Json = nlohmann::ordered_json;

/// One line. NaN and infinity become the strings "NaN", "Infinity", "-Infinity", as protobuf's
/// JSON writes them; bytes that are no UTF-8 are replaced.
std::string Text(Json json);

}  // namespace grouser::surrogate
