#pragma once

#include <optional>
#include <span>
#include <string>

#include "grouser/v1alpha1/model.pb.h"
#include "surrogate/models/hard_ground.h"

namespace grouser::surrogate {

struct HardModelRequest {
  std::string name;    ///< of the model
  std::string ground;  ///< "asphalt": the soil's name
  std::string source;  ///< of the parameters
  v1alpha1::Wheel wheel;
  HardGround parameters;
  double gravity_m_per_s2 = 9.81;
  std::optional<double> load_min_n, load_max_n;  ///< of the domain; none: 0.01 to 100 kN
  std::string command;                           ///< for the provenance
};

/// Ground and parameters of a request whose wheel is known: a published ground (`ground`, a name of
/// hard_grounds.csv; empty: none) of which numbers may be `given` otherwise, in the order of
/// HardGroundFields, or numbers alone; the contact patch is the usual one where not given. Throws
/// std::invalid_argument for an unknown ground and for numbers that lack.
void SetGround(const std::string& ground, std::span<const std::optional<double>> given,
               HardModelRequest* request);

/// "friction_sd" -> "--friction-sd": a field on the command line.
std::string OptionOf(const HardGroundField& field);

/// A `hard` model. Nothing is fitted: `untuned` is set and sd_form unknown, so that every answer
/// has the flags UNTUNED and FORM_UNKNOWN. The law holds for every slip, attack angle, load and
/// speed; the domain says so: loads as asked for, no end of the speeds (froude_max is 0: no
/// quasi-static range to leave). speed_m_per_s, that of questions by slip, is 0.5 m/s: forces do
/// not depend on it. Throws std::invalid_argument as HardGroundModel, and for loads that are none.
v1alpha1::Model MakeHardModel(const HardModelRequest& request);

}  // namespace grouser::surrogate
