#pragma once

#include <string>

#include "surrogate/fit/gate.h"
#include "surrogate/fit/measured.h"

namespace grouser::surrogate {

/// Texts for people and JSON for programs, of what grouser-fit prints.

/// The model with its digest, domain, uncertainty and error table.
std::string ModelText(const v1alpha1::Model& model, const std::string& digest);
/// {"digest", "model"}: the message without table coefficients.
std::string ModelJson(const v1alpha1::Model& model, const std::string& digest);

struct Query {
  double slip, attack_angle_rad, load_n, speed_m_per_s;
};
std::string AnswerText(const Query& query, const WheelAnswer& answer);
std::string AnswerJson(const Query& query, const WheelAnswer& answer, const std::string& reference);

std::string MeasuredText(const std::vector<MeasuredRow>& rows);
std::string MeasuredJson(const std::vector<MeasuredRow>& rows, const std::string& reference);

std::string GateText(const std::vector<GateResult>& checks);
std::string GateJson(const std::vector<GateResult>& checks);

}  // namespace grouser::surrogate
