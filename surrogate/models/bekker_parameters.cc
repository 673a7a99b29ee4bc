#include "surrogate/models/bekker_parameters.h"

#include <array>

namespace grouser::surrogate {
namespace {

using P = BekkerParameters;
constexpr std::array kFields = {
    BekkerField{"n", "-", &P::n, 0.05, 2.5},
    BekkerField{"k_c", "N/m^(n+1)", &P::k_c, -1e9, 1e9},
    BekkerField{"k_phi", "N/m^(n+2)", &P::k_phi, -1e9, 1e12},
    BekkerField{"cohesion", "Pa", &P::cohesion, 0, 1e7},
    BekkerField{"friction_angle", "rad", &P::friction_angle, 0, 1.3},
    BekkerField{"shear_modulus", "m", &P::shear_modulus, 1e-6, 10},
    BekkerField{"c1", "-", &P::c1, 0, 0.9},
    BekkerField{"c2", "-", &P::c2, -0.9, 0.9},
    BekkerField{"c3", "-", &P::c3, 0, 1},
    BekkerField{"sinkage_drive", "-", &P::sinkage_drive, 0, 3},
    BekkerField{"sinkage_brake", "-", &P::sinkage_brake, 0, 3},
    BekkerField{"sinkage_lateral", "-", &P::sinkage_lateral, 0, 3},
    BekkerField{"side_passive", "-", &P::side_passive, 0, 100},
    BekkerField{"front_passive", "-", &P::front_passive, 0, 100},
    BekkerField{"bulldozing_length", "m", &P::bulldozing_length, 1e-6, 10},
    BekkerField{"turn_speed", "-", &P::turn_speed, 0.01, 1},
    BekkerField{"turn_spin", "-", &P::turn_spin, 0, 1},
    BekkerField{"unit_weight", "N/m^3", &P::unit_weight, 0, 1e5},
    BekkerField{"pressure_form", "-", &P::pressure_form, kBekkerForm, kReeceForm, true},
    BekkerField{"reece_k_c", "-", &P::reece_k_c, -1e9, 1e9, true},
    BekkerField{"reece_k_phi", "-", &P::reece_k_phi, -1e9, 1e9, true},
    BekkerField{"grouser_height", "m", &P::grouser_height, 0, 1, true},
    BekkerField{"grouser_share", "-", &P::grouser_share, 0, 1, true},
};

}  // namespace

std::span<const BekkerField> BekkerFields() noexcept { return kFields; }

}  // namespace grouser::surrogate
