#pragma once

#include "surrogate/models/bekker.h"

namespace grouser::surrogate {

struct BekkerModel::Motion {
  double p, y, q;
  double t;            // 1: entry ahead, -1: entry behind
  double peak;         // theta_m / theta_f where t = 1
  double multiplier;   // S, slip sinkage
  double front, back;  // braking slip of a wheel running forward, backward
  double w;
};

struct BekkerModel::Integrals {
  double f_x, f_y, f_z, torque, m_z;
};

}  // namespace grouser::surrogate
