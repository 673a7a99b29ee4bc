#include "surrogate/model_io/form_message.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace grouser::surrogate {
namespace {

static_assert(v1alpha1::MEASURED_REGION_STRAIGHT ==
                  1 + static_cast<int>(MeasuredRegion::kStraight) &&
              v1alpha1::MEASURED_REGION_ANGLED == 1 + static_cast<int>(MeasuredRegion::kAngled) &&
              v1alpha1::MEASURED_REGION_BRAKING == 1 + static_cast<int>(MeasuredRegion::kBraking) &&
              v1alpha1::MEASURED_REGION_LOCKED == 1 + static_cast<int>(MeasuredRegion::kLocked) &&
              v1alpha1::MeasuredRegion_MAX == kMeasuredRegions);

[[noreturn]] void FailForm(const v1alpha1::Model& message, const std::string& what) {
  throw std::runtime_error("model " + message.name().substr(0, 128) + ": " + what);
}

std::array<double, kOutputs> FormNumbers(const v1alpha1::Model& message, const std::string& field,
                                         const google::protobuf::RepeatedField<double>& values) {
  if (values.size() != kOutputs) {
    FailForm(message, field + ": " + std::to_string(values.size()) + " numbers, expected 6");
  }
  for (int o = 0; o < kOutputs; ++o) {
    if (values[o] < 0 || std::isinf(values[o])) {
      FailForm(message, field + "[" + std::to_string(o) +
                            "]: expected a finite number, not negative, "
                            "or NaN");
    }
  }
  std::array<double, kOutputs> six;
  std::ranges::copy(values, six.begin());
  return six;
}

}  // namespace

v1alpha1::MeasuredRegion ToMessage(MeasuredRegion region) {
  return static_cast<v1alpha1::MeasuredRegion>(static_cast<int>(region) + 1);
}

FormErrors FormErrorsOf(const v1alpha1::Model& message) {
  FormErrors form;
  if (message.form_by_region().empty()) {
    if (message.sd_form().empty()) return form;
    for (auto& region : form.region) region.sd = FormNumbers(message, "sd_form", message.sd_form());
    return form;
  }
  form.middle_load_n = std::sqrt(message.domain().load_min_n() * message.domain().load_max_n());
  bool seen[kMeasuredRegions] = {};
  for (int k = 0; k < message.form_by_region_size(); ++k) {
    const v1alpha1::FormError& from = message.form_by_region(k);
    const std::string at = "form_by_region[" + std::to_string(k) + "].";
    const int region = from.region() - 1;
    if (region < 0 || region >= static_cast<int>(kMeasuredRegions) || seen[region]) {
      FailForm(message, at + "region: expected one that is known, each once");
    }
    seen[region] = true;
    if (from.rows_size() != kOutputs) {
      FailForm(message, at + "rows: " + std::to_string(from.rows_size()) + " numbers, expected 6");
    }
    form.region[region] = {FormNumbers(message, at + "sd", from.sd()),
                           FormNumbers(message, at + "factor", from.factor())};
  }
  return form;
}

}  // namespace grouser::surrogate
