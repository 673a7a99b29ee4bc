#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "grouser/v1alpha1/jobs_service.pb.h"
#include "grouser/v1alpha1/model.pb.h"

namespace grouser::server::testing {

/// A folder that is removed with its contents.
class TempDir {
 public:
  TempDir() {
    std::string pattern = (std::filesystem::temp_directory_path() / "grouser-jobs-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
    path_ = pattern;
  }
  ~TempDir() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TempDir(const TempDir&) = delete;
  TempDir& operator=(const TempDir&) = delete;

  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

inline std::string ReadText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

inline void WriteText(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error(path + ": cannot be written");
}

inline void WriteScript(const std::string& path, const std::string& text) {
  WriteText(path, text);
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
}

/// Waits for a condition; a minute stands for "never", so that a slow machine
/// does not fail a test.
template <typename Condition>
bool Eventually(Condition condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

/// A model that can be refined: grains, wheel and rig are there.
inline v1alpha1::Model BaseModel() {
  v1alpha1::Model model;
  model.set_name("cmu-smooth-62.5");
  auto* grains = model.mutable_soil()->mutable_grains();
  grains->set_grain_density_kg_per_m3(2290);
  grains->set_youngs_modulus_pa(1e7);
  grains->set_friction(0.5);
  auto* size = grains->add_sizes();
  size->set_diameter_m(0.008);
  size->set_mass_fraction(1);
  model.mutable_soil()->set_name("sand");
  model.mutable_soil()->set_gravity_m_per_s2(9.81);
  model.mutable_wheel()->set_radius_m(0.0625);
  model.mutable_wheel()->set_width_m(0.05);
  model.mutable_rig()->set_bed_length_m(0.3);
  model.mutable_rig()->set_bed_width_m(0.22);
  model.mutable_rig()->set_bed_depth_m(0.11);
  model.mutable_rig()->set_speed_m_per_s(0.1);
  model.mutable_rig()->set_max_time_s(3);
  for (const std::uint64_t seed : {7, 7, 3}) {
    auto* run = model.mutable_provenance()->add_runs();
    run->set_role(v1alpha1::RUN_ROLE_TRAIN);
    run->set_seed(seed);
  }
  return model;
}

inline v1alpha1::SubmitRefinementRequest Request(const std::string& request_id,
                                                 double slip = 0.35) {
  v1alpha1::SubmitRefinementRequest request;
  request.set_request_id(request_id);
  request.set_model("cmu-smooth-62.5");
  request.mutable_state()->set_slip(slip);
  request.mutable_state()->set_attack_angle_rad(0.3);
  request.mutable_state()->set_load_n(24);
  return request;
}

}  // namespace grouser::server::testing
