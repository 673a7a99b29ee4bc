#pragma once

#include <string>

#include "surrogate/fit/form_fit.h"
#include "surrogate/fit/gate.h"
#include "surrogate/fit/json.h"
#include "surrogate/fit/measured.h"

namespace grouser::surrogate {

/// Texts for people and JSON for programs, of what grouser-fit prints.

/// The model with its digest, domain, uncertainty and error table.
std::string ModelText(const v1alpha1::Model& model, const std::string& digest);
/// {"digest", "model"}: the message without table coefficients.
std::string ModelJson(const v1alpha1::Model& model, const std::string& digest);

struct Query {
  double slip, attack_angle_rad, load_n, speed_m_per_s;
  double radius_m = 0, gravity_m_per_s2 = 0;
};
std::string AnswerText(const Query& query, const WheelAnswer& answer, const FormAnswer& form);
std::string AnswerJson(const Query& query, const WheelAnswer& answer, const FormAnswer& form,
                       const std::string& reference);

std::string MeasuredText(const std::vector<MeasuredRow>& rows);
std::string MeasuredJson(const std::vector<MeasuredRow>& rows, const std::string& reference,
                         const Json& left_out = {});

/// sd_form by region; empty where the model has none.
std::string FormText(const v1alpha1::Model& model);
/// Rows of one angle inside the intervals that the other angles give, by angle and over all.
std::string LeftOutText(const std::vector<AngleLeftOut>& each, double level);
Json LeftOutJson(const std::vector<AngleLeftOut>& each, double level);
/// Regions of states, and the groups that tables report.
std::string RegionsText(const std::vector<Query>& states);
std::string RegionsJson(const std::vector<Query>& states);

std::string GateText(const std::vector<GateResult>& checks);
std::string GateJson(const std::vector<GateResult>& checks);

}  // namespace grouser::surrogate
