#include "proto/records/yaml/message_yaml.h"

#include <filesystem>
#include <numbers>

namespace grouser::records {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::uint64_t kMostCount = 1000000000;
// Wide: what lies outside is in another unit.
constexpr Range kRadius{0.005, 5}, kWidth{0.002, 5};

void ReadTread(YamlSection& tread, v1alpha1::Tread* out) {
  out->set_count(static_cast<std::uint32_t>(tread.Count("count", 0, kMostCount)));
  ReadNumbers(tread, {"height_m", "root_thickness_m"}, out);
  ReadOptional(tread, {"tip_thickness_m", "width_m", "offset_m"}, out);
  out->set_lean_rad(tread.NumberOr("lean_deg", 0) * kDegree);
  tread.Finish();
}

}  // namespace

void ReadNumbers(YamlSection& section, Keys keys, google::protobuf::Message* out) {
  for (const char* key : keys) {
    const auto* field = out->GetDescriptor()->FindFieldByName(key);
    out->GetReflection()->SetDouble(out, field, section.Number(key));
  }
}

void ReadOptional(YamlSection& section, Keys keys, google::protobuf::Message* out) {
  for (const char* key : keys) {
    if (section.Has(key)) ReadNumbers(section, {key}, out);
  }
}

void ReadWheel(YamlSection wheel, bool with_contact, v1alpha1::Wheel* out) {
  const Keys contact = {"restitution", "friction", "rolling_friction"};
  ReadNumbers(wheel, {"radius_m", "width_m"}, out);
  if (with_contact) {
    out->set_name(wheel.Text("name"));
    out->set_source(wheel.Text("source"));
    ReadNumbers(wheel, contact, out);
  } else {
    out->set_name(wheel.TextOr("name", ""));
    out->set_source(wheel.TextOr("source", ""));
    ReadOptional(wheel, contact, out);
  }
  if (wheel.Has("treads")) {
    for (YamlSection& tread : wheel.Sections("treads")) ReadTread(tread, out->add_treads());
  }
  wheel.Finish();
}

v1alpha1::Wheel LoadWheel(const std::string& file) {
  YamlSection top = YamlSection::Load(file);
  YamlSection section = top.Has("wheel") ? top.Section("wheel") : top;
  section.Number("radius_m", kRadius);
  section.Number("width_m", kWidth);
  v1alpha1::Wheel wheel;
  ReadWheel(section, /*with_contact=*/false, &wheel);
  if (wheel.name().empty()) wheel.set_name(std::filesystem::path(file).stem().string());
  return wheel;
}

}  // namespace grouser::records
