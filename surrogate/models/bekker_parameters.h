#pragma once

#include <span>

namespace grouser::surrogate {

/// Forms of the pressure-sinkage relation (BekkerParameters::pressure_form).
inline constexpr double kBekkerForm = 0, kReeceForm = 1;

/// Parameters of the Bekker/Wong-style model. A set belongs to the model it
/// was fitted with: never mix sets of different models.
struct BekkerParameters {
  double n = 1.0;                   ///< sinkage exponent [-]
  double k_c = 0.0;                 ///< cohesive modulus [N/m^(n+1)]
  double k_phi = 6e5;               ///< frictional modulus [N/m^(n+2)]
  double cohesion = 0.0;            ///< c, of the rim-soil interface [Pa]
  double friction_angle = 0.5;      ///< phi, of the rim-soil interface [rad]
  double shear_modulus = 0.01;      ///< Janosi-Hanamoto K [m]
  double c1 = 0.3;                  ///< peak stress angle over entry angle, at slip 0 [-]
  double c2 = 0.15;                 ///< its growth with slip [-]
  double c3 = 0.3;                  ///< exit angle over entry angle [-]
  double sinkage_drive = 0.4;       ///< slip sinkage by driving slip [-]
  double sinkage_brake = 0.2;       ///< slip sinkage by braking slip [-]
  double sinkage_lateral = 0.3;     ///< slip sinkage by lateral motion [-]
  double side_passive = 4.0;        ///< passive pressure on the closed side [-]
  double front_passive = 1.0;       ///< the same ahead of a braked rim [-]
  double bulldozing_length = 0.01;  ///< K_b: travel that mobilises both [m]
  double turn_speed = 0.15;         ///< v_x/M within which entry and exit swap [-]
  double turn_spin = 0.1;           ///< weight of the rim speed in that swap [-]
  double unit_weight = 13000.0;     ///< gamma = rho g of the bed [N/m^3]
  // Absent in older files: the values here leave old answers as they were.
  double pressure_form = kBekkerForm;  ///< kBekkerForm or kReeceForm
  double reece_k_c = 0.0;              ///< Reece's cohesive modulus k_c' [-]
  double reece_k_phi = 0.0;            ///< Reece's frictional modulus k_phi' [-]
  double grouser_height = 0.0;         ///< h_g: tips above the rim [m]
  double grouser_share = 0.5;          ///< of h_g that counts in the shearing radius [-]
};

/// Name, unit and range of each parameter, in the order of v1alpha1.BekkerParameters, whose
/// fields have the unit in their name besides.
struct BekkerField {
  const char* name;
  const char* unit;
  double BekkerParameters::*member;
  double low, high;       ///< accepted range
  bool optional = false;  ///< absent in a file: the default
};
std::span<const BekkerField> BekkerFields() noexcept;

}  // namespace grouser::surrogate
