#include "dem_offline/scenes/engine_convert.h"

namespace grouser::campaign {

namespace {

template <class Message>
std::vector<dem::NamedSetting> ConvertSettings(const Message& from) {
  std::vector<dem::NamedSetting> out;
  for (const auto& s : from.settings()) out.push_back({s.law(), s.name(), s.value()});
  return out;
}

dem::InterfaceChoice ConvertInterface(const v1alpha1::InterfaceLaws& from) {
  dem::InterfaceChoice out;
  if (from.has_rolling_damping()) out.rolling_damping = from.rolling_damping();
  if (from.has_surface_energy_j_per_m2()) {
    out.surface_energy_j_per_m2 = from.surface_energy_j_per_m2();
  }
  out.settings = ConvertSettings(from);
  return out;
}

}  // namespace

void ConvertContact(const v1alpha1::ContactLaws& laws, dem::ContactChoice* out) {
  out->normal = laws.normal();
  out->tangential = laws.tangential();
  out->rolling = laws.rolling();
  out->cohesion = laws.cohesion();
  out->rolling_damping = laws.rolling_damping();
  out->surface_energy_j_per_m2 = laws.surface_energy_j_per_m2();
  out->settings = ConvertSettings(laws);
  out->wheel = ConvertInterface(laws.wheel());
  out->floor = ConvertInterface(laws.floor());
}

namespace {

dem::BedPreparation Converted(const v1alpha1::BedPreparation& preparation) {
  dem::BedPreparation out;
  if (preparation.has_friction()) out.friction = preparation.friction();
  if (preparation.has_rolling_friction()) out.rolling_friction = preparation.rolling_friction();
  return out;
}

void ConvertSoil(const v1alpha1::Soil& soil, dem::GrainSoil* out) {
  const auto& grains = soil.grains();
  out->density_kg_per_m3 = grains.grain_density_kg_per_m3();
  out->youngs_modulus_pa = grains.youngs_modulus_pa();
  out->poisson_ratio = grains.poisson_ratio();
  out->restitution = grains.restitution();
  out->friction = grains.friction();
  out->rolling_friction = grains.rolling_friction();
  out->solid_fraction = grains.solid_fraction();
  out->preparation = Converted(grains.preparation());
  const auto& top = grains.top_layer();
  out->top = {top.thickness_m(), top.solid_fraction(), Converted(top.preparation())};
  out->gravity_m_per_s2 = soil.gravity_m_per_s2();
  if (grains.has_contact()) ConvertContact(grains.contact(), &out->contact);
  out->sizes.clear();
  for (const auto& bin : grains.sizes()) {
    out->sizes.push_back({bin.diameter_m(), bin.mass_fraction()});
  }
}

void ConvertWheel(const v1alpha1::Wheel& wheel, dem::WheelShape* out) {
  out->radius_m = wheel.radius_m();
  out->width_m = wheel.width_m();
  out->restitution = wheel.restitution();
  out->friction = wheel.friction();
  out->rolling_friction = wheel.rolling_friction();
  out->treads.clear();
  for (const auto& t : wheel.treads()) {
    out->treads.push_back({static_cast<int>(t.count()), t.height_m(), t.root_thickness_m(),
                           t.tip_thickness_m(), t.width_m(), t.offset_m(), t.lean_rad()});
  }
}

dem::SceneBed ConvertBed(v1alpha1::SceneBed bed) {
  switch (bed) {
    case v1alpha1::SCENE_BED_FULL:
      return dem::SceneBed::kFull;
    case v1alpha1::SCENE_BED_WINDOW:
      return dem::SceneBed::kWindow;
    default:
      return dem::SceneBed::kPeriodic;
  }
}

void ConvertScene(const v1alpha1::SceneChoice& scene, dem::SceneSettings* out) {
  out->bed = ConvertBed(scene.bed());
  out->window_length_m = scene.window_length_m();
  out->window_ahead = scene.window_ahead();
  out->freeze = scene.freeze();
  out->freeze_box = scene.freeze_box();
  out->freeze_speed = scene.freeze_speed();
  out->look_steps = static_cast<int>(scene.look_steps());
  out->largest_step = scene.largest_step();
}

void ConvertRig(const v1alpha1::RigSettings& rig, dem::RigSettings* out) {
  out->bed_length_m = rig.bed_length_m();
  out->bed_width_m = rig.bed_width_m();
  out->bed_depth_m = rig.bed_depth_m();
  out->speed_m_per_s = rig.speed_m_per_s();
  out->max_time_s = rig.max_time_s();
  out->rayleigh_fraction = rig.rayleigh_fraction();
  out->target_relative_error = rig.target_relative_error();
  out->stress_bin_rad = rig.stress_bin_rad();
  out->width_bins = static_cast<int>(rig.width_bins());
  out->most_sinkage_m = rig.most_sinkage_m();
  out->travel = {rig.travel().least_hub_m(), rig.travel().compare_from_hub_m(),
                 rig.travel().compare_to_hub_m()};
  if (rig.has_scene()) ConvertScene(rig.scene(), &out->scene);
}

dem::RigMode ConvertMode(v1alpha1::RigMode mode) {
  switch (mode) {
    case v1alpha1::RIG_MODE_TOWED:
      return dem::RigMode::kTowed;
    case v1alpha1::RIG_MODE_FREE_SLIP:
      return dem::RigMode::kFreeSlip;
    default:
      return dem::RigMode::kRimSpeed;
  }
}

v1alpha1::RunStatus ConvertStatus(dem::RunStatus status) {
  switch (status) {
    case dem::RunStatus::kSteady:
      return v1alpha1::RUN_STATUS_STEADY;
    case dem::RunStatus::kUnsteady:
      return v1alpha1::RUN_STATUS_UNSTEADY;
    case dem::RunStatus::kOverload:
      return v1alpha1::RUN_STATUS_OVERLOAD;
    case dem::RunStatus::kLost:
      return v1alpha1::RUN_STATUS_LOST;
    case dem::RunStatus::kFailed:
      break;
  }
  return v1alpha1::RUN_STATUS_FAILED;
}

using Repeated = google::protobuf::RepeatedField<double>;

void Copy(const std::vector<double>& from, Repeated* to) { to->Assign(from.begin(), from.end()); }

void RecordOutputs(const std::vector<dem::OutputMean>& means,
                   google::protobuf::RepeatedPtrField<v1alpha1::OutputMean>* to) {
  for (const dem::OutputMean& mean : means) {
    auto* out = to->Add();
    out->set_name(mean.name);
    out->set_mean(mean.mean);
    out->set_standard_error(mean.standard_error);
    out->set_drift(mean.drift);
    out->set_fluctuation(mean.fluctuation);
  }
}

void RecordMeans(const dem::WheelTestResult& result, v1alpha1::RunRecord* record) {
  RecordOutputs(result.outputs, record->mutable_outputs());
  if (const dem::EqualTravel& equal = result.equal_travel; !equal.outputs.empty()) {
    auto* out = record->mutable_equal_travel();
    out->set_from_hub_m(equal.from_hub_m);
    out->set_to_hub_m(equal.to_hub_m);
    RecordOutputs(equal.outputs, out->mutable_outputs());
  }
  for (const dem::RuleCheck& rule : result.rules) {
    auto* out = record->add_rules();
    out->set_name(rule.name);
    out->set_value(rule.value);
    out->set_limit(rule.limit);
    out->set_kept(rule.kept);
  }
}

void RecordEnergy(const dem::EnergyLedger& energy, v1alpha1::EnergyLedger* out) {
  out->set_input_j(energy.input_j);
  out->set_kinetic_j(energy.kinetic_j);
  out->set_potential_j(energy.potential_j);
  out->set_elastic_j(energy.elastic_j);
  out->set_normal_damping_j(energy.normal_damping_j);
  out->set_tangential_damping_j(energy.tangential_damping_j);
  out->set_slip_j(energy.slip_j);
  out->set_rolling_j(energy.rolling_j);
  out->set_plastic_j(energy.plastic_j);
  out->set_cohesion_j(energy.cohesion_j);
  out->set_frozen_j(energy.frozen_j);
  out->set_residual_j(energy.residual_j);
}

void RecordBed(const dem::WheelTestResult& result, const dem::Tile& tile,
               v1alpha1::BedReport* bed) {
  bed->set_solid_fraction(tile.solid_fraction);
  bed->set_coordination(tile.coordination);
  bed->set_bulk_density_kg_per_m3(result.bulk_density_kg_per_m3);
  bed->set_mean_diameter_m(result.mean_diameter_m);
  bed->set_grains(result.grains);
  bed->set_surface_m(tile.surface_m);
  bed->set_top_solid_fraction(tile.top_solid_fraction);
  bed->set_preparation_friction(tile.preparation_friction[0]);
  bed->set_preparation_rolling_friction(tile.preparation_rolling_friction[0]);
  bed->set_top_preparation_friction(tile.preparation_friction[1]);
  bed->set_top_preparation_rolling_friction(tile.preparation_rolling_friction[1]);
}

void RecordNumerics(const dem::WheelTestResult& result, v1alpha1::NumericsReport* numerics) {
  numerics->set_dt_s(result.dt_s);
  numerics->set_steps(result.steps);
  numerics->set_rayleigh_time_s(result.rayleigh_time_s);
  numerics->set_particle_steps(result.particle_steps);
  numerics->set_awake_particle_steps(result.use.active_particle_steps);
  numerics->set_deep_particle_steps(result.use.deep_particle_steps);
  numerics->set_wall_s(result.wall_s);
  numerics->set_quantum_m(result.quantum_m);
  numerics->set_list_rebuilds(result.list_rebuilds);
  numerics->set_overlap_mean_over_radius(result.overlap_mean_over_radius);
  numerics->set_overlap_p99_over_radius(result.overlap_p99_over_radius);
  numerics->set_overlap_max_over_radius(result.overlap_max_over_radius);
  numerics->set_inertial_number(result.inertial_number);
}

void RecordProfiles(const dem::WheelTestResult& result, v1alpha1::RunRecord* record) {
  auto* stress = record->mutable_stress();
  stress->set_first_angle_rad(result.stress.first_angle_rad);
  stress->set_angle_step_rad(result.stress.angle_step_rad);
  stress->set_width_bins(static_cast<std::uint32_t>(result.stress.width_bins));
  Copy(result.stress.normal_pa, stress->mutable_normal_pa());
  Copy(result.stress.shear_tangential_pa, stress->mutable_shear_tangential_pa());
  Copy(result.stress.shear_axial_pa, stress->mutable_shear_axial_pa());
  stress->set_entry_angle_rad(result.stress.entry_angle_rad);
  stress->set_exit_angle_rad(result.stress.exit_angle_rad);
  auto* surface = record->mutable_surface();
  surface->set_x_first_m(result.surface.x_first_m);
  surface->set_y_first_m(result.surface.y_first_m);
  surface->set_step_m(result.surface.step_m);
  surface->set_nx(static_cast<std::uint32_t>(result.surface.nx));
  surface->set_ny(static_cast<std::uint32_t>(result.surface.ny));
  Copy(result.surface.height_m, surface->mutable_height_m());
}

void RecordSeries(const dem::Series& series, records::DoubleArrays* out) {
  *out = {{"time_s", series.time_s},
          {"f_x_n", series.f_x_n},
          {"f_y_n", series.f_y_n},
          {"f_z_n", series.f_z_n},
          {"torque_n_m", series.torque_n_m},
          {"m_z_n_m", series.m_z_n_m},
          {"sinkage_m", series.sinkage_m},
          {"v_x_m_per_s", series.v_x_m_per_s},
          {"rim_speed_m_per_s", series.rim_speed_m_per_s},
          {"travel_m", series.travel_m},
          {"hub_travel_m", series.hub_travel_m}};
}

}  // namespace

dem::WheelTestSpec ToEngine(const v1alpha1::WheelTestSpec& spec) {
  dem::WheelTestSpec out;
  ConvertSoil(spec.soil(), &out.soil);
  ConvertWheel(spec.wheel(), &out.wheel);
  ConvertRig(spec.rig(), &out.rig);
  out.state.mode = ConvertMode(spec.state().mode());
  out.state.slip = spec.state().slip();
  out.state.attack_angle_rad = spec.state().attack_angle_rad();
  out.state.load_n = spec.state().load_n();
  out.state.drawbar_n = spec.state().drawbar_n();
  out.seed = spec.seed();
  return out;
}

records::RunFile ToRunFile(const RunContext& context, const dem::Tile& tile,
                           const dem::WheelTestResult& result) {
  records::RunFile file;
  v1alpha1::RunRecord& record = file.record;
  record.set_run_id(context.run_id);
  *record.mutable_spec() = context.spec;
  record.set_status(ConvertStatus(result.status));
  record.set_reason(result.reason);
  record.set_means_of_no_state(result.means_of_no_state);
  record.set_slip(result.slip);
  record.set_attack_angle_rad(result.attack_angle_rad);
  record.set_v_x_m_per_s(result.v_x_m_per_s);
  record.set_v_y_m_per_s(result.v_y_m_per_s);
  record.set_rim_speed_m_per_s(result.rim_speed_m_per_s);
  record.set_window_start_s(result.window_start_s);
  record.set_window_end_s(result.window_end_s);
  record.set_blocks(static_cast<std::uint32_t>(result.blocks));
  record.set_travel_m(result.travel_m);
  record.set_hub_travel_m(result.hub_travel_m);
  record.set_contact_length_m(result.contact_length_m);
  record.set_stopped_by(dem::Explain(result.stopped));
  *record.mutable_create_time() = context.created;
  RecordMeans(result, &record);
  RecordEnergy(result.energy, record.mutable_energy());
  RecordBed(result, tile, record.mutable_bed());
  record.mutable_bed()->set_tile_sha256(context.tile_sha256);
  RecordNumerics(result, record.mutable_numerics());
  record.mutable_numerics()->set_engine_version(context.engine_version);
  record.mutable_numerics()->set_isa(context.isa);
  RecordProfiles(result, &record);
  RecordSeries(result.series, &file.series);
  return file;
}

}  // namespace grouser::campaign
