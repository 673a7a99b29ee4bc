#pragma once

#include <gtest/gtest.h>

#include <string>

#include "grouser/model.h"
#include "proto/records/model_file.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/write_model.h"

namespace grouser {

/// The small model's wheel on hard ground under loads from `least` to `most`, and slips.
inline Model OnFloor(double least, double most, double slip_min, double slip_max) {
  const v1alpha1::Model own = records::ReadModelFile(GROUSER_SMALL_MODEL).model;
  v1alpha1::Model hard;
  hard.set_name("floor");
  hard.set_kind(v1alpha1::MODEL_KIND_HARD);
  *hard.mutable_wheel() = own.wheel();
  hard.mutable_soil()->set_gravity_m_per_s2(own.soil().gravity_m_per_s2());
  hard.set_interval_level(own.interval_level());
  *hard.mutable_domain() = own.domain();
  hard.mutable_domain()->set_load_min_n(least);
  hard.mutable_domain()->set_load_max_n(most);
  hard.mutable_domain()->set_slip_min(slip_min);
  hard.mutable_domain()->set_slip_max(slip_max);
  surrogate::SetHard({.friction = 0.6,
                      .slip_stiffness = 9,
                      .rolling_resistance = 0.02,
                      .contact_length_m = 0.02,
                      .contact_width_m = 0.04},
                     &hard);
  surrogate::SetGoldenVectors(&hard);
  const std::string file = ::testing::TempDir() + "/grouser_mixture_floor.model";
  surrogate::WriteTestedModel(file, hard);
  return Model::Open(file);
}

}  // namespace grouser
