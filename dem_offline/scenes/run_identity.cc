#include "dem_offline/scenes/run_identity.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "proto/records/sha256.h"

namespace grouser::campaign {
namespace {

std::string Hash(const google::protobuf::Message& message, const std::string& engine_version) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return records::Sha256OfString("engine " + engine_version + "\n" + bytes);
}

}  // namespace

std::string RunId(const v1alpha1::WheelTestSpec& spec, const std::string& engine_version) {
  v1alpha1::WheelTestSpec bare = spec;
  bare.clear_scene();
  bare.mutable_soil()->clear_name();
  bare.mutable_soil()->clear_source();
  bare.mutable_wheel()->clear_name();
  bare.mutable_wheel()->clear_source();
  auto* state = bare.mutable_state();
  if (state->mode() == v1alpha1::RIG_MODE_UNSPECIFIED) {
    state->set_mode(v1alpha1::RIG_MODE_RIM_SPEED);
  }
  if (state->mode() != v1alpha1::RIG_MODE_RIM_SPEED) state->clear_slip();
  if (state->mode() != v1alpha1::RIG_MODE_FREE_SLIP) state->clear_drawbar_n();
  return Hash(bare, engine_version).substr(0, 16);
}

std::string TileKey(const v1alpha1::WheelTestSpec& spec, const std::string& engine_version) {
  v1alpha1::WheelTestSpec bare;
  *bare.mutable_soil()->mutable_grains() = spec.soil().grains();
  bare.mutable_soil()->set_gravity_m_per_s2(spec.soil().gravity_m_per_s2());
  bare.mutable_rig()->set_bed_length_m(spec.rig().bed_length_m());
  bare.mutable_rig()->set_bed_width_m(spec.rig().bed_width_m());
  bare.mutable_rig()->set_bed_depth_m(spec.rig().bed_depth_m());
  bare.mutable_rig()->set_rayleigh_fraction(spec.rig().rayleigh_fraction());
  bare.set_seed(spec.seed());
  return Hash(bare, engine_version);
}

}  // namespace grouser::campaign
