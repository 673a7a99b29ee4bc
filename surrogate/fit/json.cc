#include "surrogate/fit/json.h"

#include <cmath>

namespace grouser::surrogate {
namespace {

void NameNonFinite(Json* json) {
  if (json->is_structured()) {
    for (Json& value : *json) NameNonFinite(&value);
  } else if (json->is_number_float() && !std::isfinite(json->get<double>())) {
    const double x = json->get<double>();
    *json = std::isnan(x) ? "NaN" : x > 0 ? "Infinity" : "-Infinity";
  }
}

}  // namespace

std::string Text(Json json) {
  NameNonFinite(&json);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace grouser::surrogate
