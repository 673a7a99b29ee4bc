#include "proto/records/run_file.h"

#include <charconv>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "proto/records/hdf5_file.h"
#include "proto/records/message_json.h"
#include "proto/records/model_file.h"

namespace grouser::records {
namespace {

using internal::H5Image;

constexpr char kFormat[] = "grouser-run";

// Unit of a series from the ending of its name ("f_x_n" is in N). The longest
// ending comes first: "v_x_m_per_s" is not in s, "torque_n_m" not in m.
std::string UnitOf(const std::string& name) {
  static constexpr std::pair<const char*, const char*> kEndings[] = {
      {"_m_per_s", "m/s"}, {"_n_m", "N m"}, {"_n", "N"}, {"_m", "m"}, {"_s", "s"}};
  for (const auto& [ending, unit] : kEndings) {
    const std::string text(ending);
    if (name.size() > text.size() && name.ends_with(text)) return unit;
  }
  return "1";
}

using Repeated = google::protobuf::RepeatedField<double>;

std::vector<double> ToVector(const Repeated& field) { return {field.begin(), field.end()}; }

void Restore(const H5Image& file, const std::string& name, Repeated* field) {
  std::vector<double> values;
  file.ReadArray(name, &values);
  field->Assign(values.begin(), values.end());
}

// Stress and surface arrays stand as datasets: they are large, and readable so.
void WriteProfiles(H5Image& file, const v1alpha1::RunRecord& record) {
  file.CreateGroup("/stress");
  const auto& stress = record.stress();
  file.WriteNumber("/stress", "first_angle_rad", stress.first_angle_rad());
  file.WriteNumber("/stress", "angle_step_rad", stress.angle_step_rad());
  file.WriteNumber("/stress", "width_bins", stress.width_bins());
  file.WriteArray("/stress/normal_pa", ToVector(stress.normal_pa()), "Pa");
  file.WriteArray("/stress/shear_tangential_pa", ToVector(stress.shear_tangential_pa()), "Pa");
  file.WriteArray("/stress/shear_axial_pa", ToVector(stress.shear_axial_pa()), "Pa");
  file.CreateGroup("/surface");
  const auto& surface = record.surface();
  file.WriteNumber("/surface", "x_first_m", surface.x_first_m());
  file.WriteNumber("/surface", "y_first_m", surface.y_first_m());
  file.WriteNumber("/surface", "step_m", surface.step_m());
  file.WriteNumber("/surface", "nx", surface.nx());
  file.WriteNumber("/surface", "ny", surface.ny());
  file.WriteArray("/surface/height_m", ToVector(surface.height_m()), "m");
}

void ReadProfiles(const H5Image& file, v1alpha1::RunRecord* record) {
  if (record->has_stress()) {
    auto* stress = record->mutable_stress();
    Restore(file, "/stress/normal_pa", stress->mutable_normal_pa());
    Restore(file, "/stress/shear_tangential_pa", stress->mutable_shear_tangential_pa());
    Restore(file, "/stress/shear_axial_pa", stress->mutable_shear_axial_pa());
  }
  if (record->has_surface()) {
    Restore(file, "/surface/height_m", record->mutable_surface()->mutable_height_m());
  }
}

/// Engine version 5 gave the name hertz_oden_martins to another law; the settings of
/// the former one have kept their names. Returns the note, empty where nothing changed.
std::string RenameFormerLaw(v1alpha1::RunRecord* record) {
  constexpr char kName[] = "hertz_oden_martins", kFormerIs[] = "hertz_dashpot";
  const std::string& version = record->numerics().engine_version();
  int number = 0;
  const auto [end, error] =
      std::from_chars(version.data(), version.data() + version.size(), number);
  if (error != std::errc() || end != version.data() + version.size() || number >= 5) return "";
  if (record->spec().soil().grains().contact().normal() != kName) return "";
  auto* contact = record->mutable_spec()->mutable_soil()->mutable_grains()->mutable_contact();
  contact->set_normal(kFormerIs);
  for (auto& setting : *contact->mutable_settings()) {
    if (setting.law() == kName) setting.set_law(kFormerIs);
  }
  return "run " + record->run_id() + " of engine version " + version + " names the law " + kName +
         ", which is " + kFormerIs + " since version 5, and is read so";
}

std::string RecordJson(v1alpha1::RunRecord record) {
  if (record.has_stress()) {
    record.mutable_stress()->clear_normal_pa();
    record.mutable_stress()->clear_shear_tangential_pa();
    record.mutable_stress()->clear_shear_axial_pa();
  }
  if (record.has_surface()) record.mutable_surface()->clear_height_m();
  return ToJson(record);
}

// What a person or a plotting script asks for first, without parsing JSON.
void WriteSummary(H5Image& file, const v1alpha1::RunRecord& record) {
  file.WriteText("run_id", record.run_id());
  file.WriteText("status", v1alpha1::RunStatus_Name(record.status()));
  file.WriteText("reason", record.reason());
  if (!record.has_spec()) {
    file.WriteText("experiment", record.experiment_spec().name());
    return;
  }
  file.WriteText("scene", record.spec().scene());
  file.WriteNumber("/", "slip", record.slip());
  file.WriteNumber("/", "attack_angle_rad", record.attack_angle_rad());
  file.WriteNumber("/", "load_n", record.spec().state().load_n());
  file.WriteNumber("/", "seed", static_cast<double>(record.spec().seed()));
  for (const auto& output : record.outputs()) {
    file.WriteNumber("/", output.name() + "_mean", output.mean());
    file.WriteNumber("/", output.name() + "_standard_error", output.standard_error());
  }
}

void CheckEqualLengths(const std::string& path, const DoubleArrays& series) {
  for (const auto& [name, values] : series) {
    const auto& [first, first_values] = *series.begin();
    if (values.size() != first_values.size()) {
      throw std::runtime_error(path + ": series '" + name + "' has " +
                               std::to_string(values.size()) + " entries, expected " +
                               std::to_string(first_values.size()) + " as '" + first + "'");
    }
  }
}

void Upgrade(v1alpha1::RunRecord* record) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  if (!record->has_created_unix_s()) return;
  *record->mutable_create_time() = TimestampOf(record->created_unix_s());
  record->clear_created_unix_s();
#pragma GCC diagnostic pop
}

}  // namespace

void WriteRunFile(const std::string& path, const RunFile& run) {
  CheckEqualLengths(path, run.series);
  H5Image file = H5Image::Create(path);
  file.WriteFormat(kFormat, kRunFileSchema);
  file.WriteText("record_json", RecordJson(run.record));
  WriteSummary(file, run.record);
  WriteProfiles(file, run.record);
  file.CreateGroup("/series");
  for (const auto& [name, values] : run.series) {
    file.WriteArray("/series/" + name, values, UnitOf(name));
  }
  file.Save();
}

RunFile ReadAnyRunFile(const std::string& path) {
  const H5Image file = H5Image::Open(path);
  RunFile run;
  run.schema = file.CheckFormat(kFormat, kRunFileSchema);
  FromJson(file.ReadText("record_json"), path + ": record_json", &run.record,
           run.schema < kRunFileSchema);
  try {
    Upgrade(&run.record);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path + ": record_json: " + error.what());
  }
  if (run.record.experiment_case() == v1alpha1::RunRecord::EXPERIMENT_NOT_SET) {
    throw std::runtime_error(path + ": holds no experiment that this version knows");
  }
  run.note = RenameFormerLaw(&run.record);
  ReadProfiles(file, &run.record);
  for (const std::string& name : file.List("/series")) {
    file.ReadArray("/series/" + name, &run.series[name]);
  }
  CheckEqualLengths(path, run.series);
  return run;
}

RunFile ReadRunFile(const std::string& path) {
  RunFile run = ReadAnyRunFile(path);
  if (!run.record.has_spec()) {
    throw std::runtime_error(path + ": holds the experiment '" +
                             run.record.experiment_spec().name() + "', expected a wheel test");
  }
  return run;
}

}  // namespace grouser::records
