// grouser-fit: run files to model files, and what a model says.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "proto/records/command_line.h"
#include "proto/records/durable_file.h"
#include "proto/records/message_json.h"
#include "proto/records/yaml/message_yaml.h"
#include "surrogate/fit/compare.h"
#include "surrogate/fit/fit_model.h"
#include "surrogate/fit/gate.h"
#include "surrogate/fit/hard_model.h"
#include "surrogate/fit/measured.h"
#include "surrogate/fit/migrate.h"
#include "surrogate/fit/numerics_command.h"
#include "surrogate/fit/plausible.h"
#include "surrogate/fit/print.h"
#include "surrogate/fit/profile_report.h"
#include "surrogate/fit/soil_card.h"
#include "surrogate/fit/untuned_model.h"
#include "surrogate/model_io/explain.h"
#include "surrogate/model_io/explanation_text.h"
#include "surrogate/model_io/form_message.h"
#include "surrogate/model_io/load_model.h"
#include "surrogate/model_io/self_test.h"
#include "surrogate/model_io/similar_wheel.h"
#include "surrogate/model_io/upgrade.h"
#include "surrogate/model_io/write_model.h"
#include "surrogate/soils/soil_library.h"

namespace {

using namespace grouser;
using namespace grouser::surrogate;

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kOk = 0, kFailed = 1, kUsage = 2, kGateFailed = 3;

struct Arguments {
  std::vector<std::string> run_dirs, files;
  std::string name, out, measured, base, run, candidate, model, kind = "hybrid", reason,
                                                                role = "test";
  std::string wheel, soil, ground;
  double load = 0, speed = 0, gravity = 9.81;
  std::optional<double> load_min, load_max, similar_radius, similar_gravity;
  std::array<std::optional<double>, 8> hard;  // by HardGroundFields
  std::optional<double> profile_weight;
  std::vector<double> weights = {0, 0.03, 0.1, 0.3, 1};
  std::vector<double> slips, angles_deg, loads;
  // Of a state to be explained, by CLI::App's options; what is not given is not asked.
  std::optional<double> at_slip, at_angle_deg, at_speed, v_x, v_y, rim, pitch_deg, roll_deg, yaw;
  std::optional<std::uint32_t> pass;
  int runs = kUsualRuns;
  bool json = false, accept_unusual = false, leave_angles_out = false;
  GateLimits limits;
  std::vector<std::string> with, cones, bevameters;
  NumericsArguments numerics;
  std::string command;  // as typed
};

void Print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  if (!text.empty() && text.back() != '\n') std::fputc('\n', stdout);
}

void Say(const std::string& text) { fmt::print(stderr, "grouser-fit: {}\n", text); }

std::string Reference(const records::LoadedModel& loaded) {
  return loaded.model.name() + "@sha256:" + loaded.digest;
}

// A signal ends the program at any moment but this one, so that no file is
// left aside.
std::string WriteUninterrupted(const std::string& path, const v1alpha1::Model& model) {
  records::MakeFolderFor(path);
  sigset_t stops, before;
  sigemptyset(&stops);
  sigaddset(&stops, SIGINT);
  sigaddset(&stops, SIGTERM);
  sigprocmask(SIG_BLOCK, &stops, &before);
  const auto unblock = [](const sigset_t* set) { sigprocmask(SIG_SETMASK, set, nullptr); };
  const std::unique_ptr<const sigset_t, decltype(unblock)> guard(&before, unblock);
  return WriteTestedModel(path, model);
}

void LogNotes(const std::vector<std::string>& notes) {
  constexpr std::size_t kShown = 3;
  for (std::size_t i = 0; i < notes.size() && i < kShown; ++i) Say(notes[i]);
  if (notes.size() > kShown) Say(fmt::format("and {} more such", notes.size() - kShown));
}

int Write(const Arguments& a, const v1alpha1::Model& model) {
  const std::string digest = WriteUninterrupted(a.out, model);
  Say("wrote " + a.out);
  Print(a.json ? ModelJson(model, digest) : ModelText(model, digest));
  return kOk;
}

int FitAndWrite(FitRequest request, const Arguments& a) {
  LogNotes(request.set.notes);
  records::MakeFolderFor(a.out);  // what cannot be made is known before the fit
  request.progress = Say;
  request.command = a.command;
  return Write(a, FitModel(request));
}

TrainingSet ReadAll(const std::vector<std::string>& paths) {
  TrainingSet set = ReadRuns(paths.front());
  for (std::size_t i = 1; i < paths.size(); ++i) Merge(ReadRuns(paths[i]), &set);
  return set;
}

int Fit(const Arguments& a) {
  FitRequest request;
  request.name = a.name;
  request.kind = a.kind == "bekker"   ? v1alpha1::MODEL_KIND_BEKKER
                 : a.kind == "lookup" ? v1alpha1::MODEL_KIND_LOOKUP
                                      : v1alpha1::MODEL_KIND_HYBRID;
  request.reason = a.reason.empty() ? "campaign" : a.reason;
  request.profile_weight = a.profile_weight;
  request.set = ReadAll(a.run_dirs);
  if (!a.measured.empty()) {
    request.measured = ReadMeasured(a.measured, LimitsOf(request.set.scene), a.accept_unusual);
  }
  return FitAndWrite(std::move(request), a);
}

int Summarise(const Arguments& a) {
  const TrainingSet set = ReadAll(a.run_dirs);
  LogNotes(set.notes);
  records::MakeFolderFor(a.out);
  WriteSummary(a.out, set);
  Say(fmt::format("wrote {}: {} runs, {} planned and not there", a.out, set.runs.size(),
                  set.notes.size()));
  return kOk;
}

int Profiles(const Arguments& a) {
  const records::LoadedModel loaded = ReadModel(a.model);
  const BekkerModel physics = MakeHybrid(loaded.model).physics();
  const TrainingSet set = ReadAll(a.run_dirs);
  const std::vector<Sample> rows =
      SamplesOf(set.runs, a.role == "test" ? v1alpha1::RUN_ROLE_TEST : v1alpha1::RUN_ROLE_TRAIN);
  const std::vector<ProfileRow> profiles = CompareProfiles(rows, physics, GrainAngle(set.scene));
  if (profiles.empty()) throw std::runtime_error("no " + a.role + " run has a stress profile");
  const ProfileMisfit repeats = RepeatMisfit(ReplicateSamples(set.runs), physics.wheel());
  Print(a.json ? ProfilesJson(profiles, repeats, Reference(loaded))
               : ProfilesText(profiles, repeats));
  return kOk;
}

int Weigh(const Arguments& a) {
  const TrainingSet set = ReadAll(a.run_dirs);
  const std::vector<WeightTrial> trials = TryWeights(set, a.weights);
  Print(a.json ? WeightsJson(trials, PatchOf(set)) : WeightsText(trials, PatchOf(set)));
  return kOk;
}

// "My rover", "LETE sand" -> "my-rover-lete-sand".
std::string NameOf(const v1alpha1::Wheel& wheel, const std::string& soil) {
  std::string name;
  for (const char c : wheel.name() + " " + soil) {
    const bool kept = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_';
    if (kept) name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (!kept && !name.empty() && name.back() != '-') name += '-';
  }
  while (name.ends_with('-')) name.pop_back();
  return name.substr(0, 100);
}

int MakeHard(const Arguments& a) {
  HardModelRequest request;
  request.name = a.name;
  request.wheel = records::LoadWheel(a.wheel);
  request.gravity_m_per_s2 = a.gravity;
  request.load_min_n = a.load_min;
  request.load_max_n = a.load_max;
  request.command = a.command;
  SetGround(a.ground, a.hard, &request);
  if (request.name.empty()) request.name = NameOf(request.wheel, request.ground);
  return Write(a, MakeHardModel(request));
}

int Make(const Arguments& a) {
  const bool numbers = std::ranges::any_of(a.hard, [](const auto& n) { return n.has_value(); });
  const bool hard = numbers || !a.ground.empty();
  if (hard == !a.soil.empty()) {
    throw CLI::ValidationError("--soil", hard ? "not with --ground or numbers of hard ground"
                                              : "or --ground or --friction: expected one of them");
  }
  if (hard && !a.files.empty()) {
    throw CLI::ValidationError("--soils", "tables of soils, not of hard ground: goes with --soil");
  }
  if (hard) return MakeHard(a);
  SoilLibrary library;
  library.Add(PublishedSoilsFile());
  for (const std::string& file : a.files) library.Add(file);
  const SoilLibrary::Entry soil = library.Find(a.soil);
  if (!soil.unusual.empty()) {
    Say(soil.soil.name + ": outside of what published soils have: " + soil.unusual);
  }
  UntunedRequest request{
      a.name, records::LoadWheel(a.wheel), soil.soil, a.gravity, a.load_min, a.load_max, a.command};
  if (request.name.empty()) request.name = NameOf(request.wheel, soil.soil.name);
  const v1alpha1::Model model = MakeUntuned(
      request, ErrorsOfUntuned(FindPairs(SurrogateFile("pairs"), PublishedSoilsFile())));
  return Write(a, model);
}

int Refit(const Arguments& a) {
  const records::LoadedModel base = ReadModel(a.base);
  std::vector<v1alpha1::Model> with;
  for (const std::string& file : a.with) with.push_back(ReadModel(file).model);
  FitRequest request = RefitRequest(base.model, base.digest, a.run, with);
  request.reason = a.reason.empty() ? "refinement" : a.reason;
  return FitAndWrite(std::move(request), a);
}

int Show(const Arguments& a) {
  const records::LoadedModel loaded = ReadModel(a.model);
  MakeTestedModel(loaded.model);  // says what is wrong with a bad one
  const SoilCard soil = SoilCardOf(loaded.model, a.bevameters, a.cones);
  if (a.json) {
    Json shown = Json::parse(ModelJson(loaded.model, loaded.digest));
    shown.update(SoilCardJson(soil));
    Print(Text(shown));
    return kOk;
  }
  const bool hard = loaded.model.kind() == v1alpha1::MODEL_KIND_HARD;
  Print(ModelText(loaded.model, loaded.digest) + (hard ? "" : "\n" + SoilCardText(soil)));
  return kOk;
}

int Numerics(const Arguments& a) {
  Print(NumericsOf(a.numerics, a.json));
  return kOk;
}

constexpr std::size_t kMostStates = 100'000;

/// Every combination of the slips, angles and loads that `eval` was given, slips last; the rest as
/// in `like`.
std::vector<Query> GridOf(const Arguments& a, Query like) {
  const std::vector<double> angles = a.angles_deg.empty() ? std::vector<double>{0} : a.angles_deg;
  const std::size_t count = a.slips.size() * angles.size() * a.loads.size();
  if (count > kMostStates) {
    throw CLI::ValidationError(
        "eval", fmt::format("got {} states, expected {} at most", count, kMostStates));
  }
  std::vector<Query> states;
  for (const double load : a.loads) {
    for (const double angle : angles) {
      for (const double slip : a.slips) {
        like.slip = slip, like.attack_angle_rad = angle * kRadPerDeg, like.load_n = load;
        states.push_back(like);
      }
    }
  }
  return states;
}

int Eval(const Arguments& a) {
  const records::LoadedModel loaded = ReadModel(a.model);
  std::shared_ptr<const WheelModel> model = MakeLaw(loaded.model);
  FormErrors errors = FormErrorsOf(loaded.model);
  double trained = loaded.model.domain().speed_m_per_s();
  const double radius = a.similar_radius.value_or(loaded.model.wheel().radius_m());
  const double gravity = a.similar_gravity.value_or(loaded.model.soil().gravity_m_per_s2());
  if (a.similar_radius || a.similar_gravity) {
    const Similarity by = SimilarityTo(loaded.model, radius, gravity);
    model = MakeScaled(loaded.model, model, by);
    errors = Scaled(errors, by);
    trained *= by.Speed();
  }
  const std::vector<Query> states =
      GridOf(a, {0, 0, 0, a.speed > 0 ? a.speed : trained, radius, gravity});
  for (const Query& query : states) {
    const VelocityState v = FromSlip(query.slip, query.attack_angle_rad, query.speed_m_per_s);
    if (!(v.v_x == v.v_x)) {
      throw CLI::ValidationError(
          "--slip", fmt::format("no motion has slip {:.6g} at {:.6g} degrees", query.slip,
                                query.attack_angle_rad / kRadPerDeg));
    }
  }
  for (const Query& query : states) {
    const VelocityState v = FromSlip(query.slip, query.attack_angle_rad, query.speed_m_per_s);
    WheelAnswer answer = AnswerOf(*model, v, query.load_n);
    const FormAnswer form = FormOf(errors, v, query.load_n, &answer);
    Print(a.json ? AnswerJson(query, answer, form, Reference(loaded))
                 : AnswerText(query, answer, form));
  }
  return kOk;
}

v1alpha1::WheelStates StateOf(const Arguments& a) {
  const bool by_slip = a.at_slip || a.at_angle_deg || a.at_speed;
  if (by_slip == (a.v_x || a.v_y || a.rim)) {
    throw CLI::ValidationError("state",
                               "expected either --slip/--angle-deg/--speed or --vx/--vy/--rim");
  }
  v1alpha1::WheelStates state;
  state.add_load_n(a.load);
  if (by_slip) {
    state.mutable_slip()->add_slip(a.at_slip.value_or(0));
    state.mutable_slip()->add_attack_angle_rad(a.at_angle_deg.value_or(0) * kRadPerDeg);
    if (a.at_speed) state.mutable_slip()->add_speed_m_per_s(*a.at_speed);
  } else {
    state.mutable_velocity()->add_v_x_m_per_s(a.v_x.value_or(0));
    state.mutable_velocity()->add_v_y_m_per_s(a.v_y.value_or(0));
    state.mutable_velocity()->add_rim_speed_m_per_s(a.rim.value_or(0));
  }
  if (a.pass) state.add_pass_number(*a.pass);
  if (a.pitch_deg) state.add_slope_pitch_rad(*a.pitch_deg * kRadPerDeg);
  if (a.roll_deg) state.add_slope_roll_rad(*a.roll_deg * kRadPerDeg);
  if (a.yaw) state.add_yaw_rate_rad_per_s(*a.yaw);
  return state;
}

int ExplainOne(const Arguments& a) {
  const v1alpha1::WheelStates state = StateOf(a);
  const records::LoadedModel loaded = ReadModel(a.model);
  const auto model = MakeTestedModel(loaded.model);
  const v1alpha1::Explanation e = Explain({loaded.model, Reference(loaded), *model}, state, a.runs);
  Print(a.json ? records::ToJson(e) : ExplanationText(e));
  return (e.flags() & kInvalid) != 0 ? kUsage : kOk;
}

int Compare(const Arguments& a) {
  const CompareRequest asked{a.model,          a.measured,         a.run_dirs,
                             a.accept_unusual, a.leave_angles_out, !a.out.empty(),
                             a.command};
  const MeasuredComparison found = CompareMeasured(asked);
  LogNotes(found.notes);
  if (!a.out.empty()) {
    WriteUninterrupted(a.out, found.with_form);
    Say("wrote " + a.out);
  }
  Print(a.json ? found.json : found.text);
  return kOk;
}

int Regions(const Arguments& a) {
  const std::vector<Query> states = StatesOf(a.slips, a.angles_deg);
  Print(a.json ? RegionsJson(states) : RegionsText(states));
  return kOk;
}

int Gate(const Arguments& a) {
  const records::LoadedModel base = ReadModel(a.base);
  const records::LoadedModel candidate = ReadModel(a.candidate);
  const std::vector<GateResult> checks = GateChecks(base.model, candidate.model, a.limits);
  Print(a.json ? GateJson(checks) : GateText(checks));
  return std::ranges::all_of(checks, &GateResult::passed) ? kOk : kGateFailed;
}

int MigrateAll(const Arguments& a) {
  std::vector<Migration> done;
  bool failed = false;
  for (const std::string& file : a.files) {
    failed |= done.emplace_back(Migrate(file, a.out)).result == "failed";
  }
  Print(a.json ? MigrationJson(done) : MigrationText(done));
  return failed ? kUsage : kOk;
}

void AddExplain(CLI::App* sub, Arguments* a) {
  sub->add_option("model", a->model, "model file")->required();
  sub->add_option("--slip", a->at_slip, "(r w - v_x)/max(|r w|, V)");
  sub->add_option("--angle-deg", a->at_angle_deg, "attack angle [deg]");
  sub->add_option("--speed", a->at_speed, "max(|r w|, V) [m/s]; the training speed if not given");
  sub->add_option("--vx", a->v_x, "instead: hub velocity forward [m/s]");
  sub->add_option("--vy", a->v_y, "hub velocity to the left [m/s]");
  sub->add_option("--rim", a->rim, "rim speed r w [m/s]");
  sub->add_option("--load", a->load, "vertical load [N]")->required();
  sub->add_option("--pass", a->pass, "pass number, 1 on virgin ground");
  sub->add_option("--pitch-deg", a->pitch_deg, "ground slope along x, nose up [deg]");
  sub->add_option("--roll-deg", a->roll_deg, "ground slope along y [deg]");
  sub->add_option("--yaw-rate", a->yaw, "[rad/s]");
  sub->add_option("--runs", a->runs, "runs of each kind")
      ->check(CLI::Range(0, kMostRuns))
      ->capture_default_str();
}

void AddCommands(CLI::App* app, Arguments* a, int (**chosen)(const Arguments&)) {
  const auto add = [&](const char* name, const char* text, int (*run)(const Arguments&)) {
    CLI::App* sub = app->add_subcommand(name, text);
    sub->add_flag("--json", a->json, "machine-readable output on stdout");
    sub->callback([chosen, run] { *chosen = run; });
    return sub;
  };
  const auto runs = [a](CLI::App* sub) {
    sub->add_option("--runs", a->run_dirs, "campaign folders, or summary files")->required();
  };
  const auto model = [a](CLI::App* sub) {
    sub->add_option("model", a->model, "model file")->required();
  };
  CLI::App* fit = add("fit", "Fit a model to the runs of one or more campaigns", Fit);
  runs(fit);
  fit->add_option("--name", a->name, "name of the model")->required();
  fit->add_option("--out", a->out, "model file to write")->required();
  auto* measured =
      fit->add_option("--measured", a->measured, "CSV of measured tests, kept in the model");
  fit->add_option("--kind", a->kind, "hybrid; bekker: physics alone; lookup: table alone")
      ->check(CLI::IsMember({"hybrid", "bekker", "lookup"}))
      ->capture_default_str();
  fit->add_option("--reason", a->reason, "kept in the provenance");
  const auto accept = [a](CLI::App* sub) {
    return sub->add_flag("--accept-unusual", a->accept_unusual,
                         "take measured angles that read like radians");
  };
  accept(fit)->needs(measured);
  fit->add_option("--profile-weight", a->profile_weight,
                  fmt::format("of a run's stress profile beside its totals; 0: totals alone "
                              "(default: {:g} for bekker, else 0)",
                              kProfileWeight))
      ->check(CLI::NonNegativeNumber);
  CLI::App* summarise =
      add("summarise", "Keep of campaigns what fits need, in one file", Summarise);
  summarise->remove_option(summarise->get_option("--json"));  // it has no output but its file
  runs(summarise);
  summarise->add_option("--out", a->out, "summary file to write (*.runs.json)")->required();
  CLI::App* profiles = add("profiles", "Stresses on the rim, DEM beside physics", Profiles);
  runs(profiles);
  profiles->add_option("--model", a->model, "model file with physics")->required();
  profiles->add_option("--role", a->role, "which runs")
      ->check(CLI::IsMember({"test", "train"}))
      ->capture_default_str();
  CLI::App* weigh = add("weigh", "What a weight of the stress profiles does to the physics", Weigh);
  runs(weigh);
  weigh->add_option("--weights", a->weights, "weights to try")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  CLI::App* make =
      add("make", "A model of a wheel on a known soil or hard ground, nothing fitted", Make);
  make->add_option("--wheel", a->wheel, "wheel file (.yaml), or a scene that has one")->required();
  make->add_option("--soil", a->soil, "name (grouser soil list), or a file with one (soil.csv)");
  make->add_option("--ground", a->ground,
                   "instead: hard ground, such as asphalt, concrete, floor, ice "
                   "(surrogate/soils/hard_grounds.csv)");
  const auto hard_fields = HardGroundFields();
  for (std::size_t i = 0; i < hard_fields.size(); ++i) {
    make->add_option(OptionOf(hard_fields[i]), a->hard[i],
                     std::string("of hard ground: ") + hard_fields[i].what)
        ->group("Hard ground, alone or instead of the table's");
  }
  make->add_option("--soils", a->files, "further tables of soils")->delimiter(',');
  make->add_option("--name", a->name, "name of the model (default: of wheel and soil)");
  make->add_option("--out", a->out, "model file to write")->required();
  make->add_option("--load-min", a->load_min, "least load of the domain [N]");
  make->add_option("--load-max", a->load_max, "largest load of the domain [N]");
  make->add_option("--gravity", a->gravity, "[m/s^2]")
      ->check(CLI::Range(0.05, 50.0))
      ->capture_default_str();
  CLI::App* refit = add("refit", "Fit a model's own runs and a new one", Refit);
  refit->add_option("--base", a->base, "model file")->required();
  refit->add_option("--run", a->run, "run file (*.run.h5)")->required();
  refit->add_option("--with", a->with,
                    "further refits of this model: what they were fitted to and it was not, too");
  refit->add_option("--out", a->out, "model file to write")->required();
  refit->add_option("--reason", a->reason, "kept in the provenance");
  CLI::App* show =
      add("show", "Say what a model file holds, and what a bevameter and a cone find of its soil",
          Show);
  model(show);
  show->add_option("--bevameters", a->bevameters,
                   "further soils by bevameters (a bevameter's bevameter_soil.csv)")
      ->delimiter(',')
      ->allow_extra_args(false);
  show->add_option("--cones", a->cones, "further cone indices (a bevameter's cone_index.csv)")
      ->delimiter(',')
      ->allow_extra_args(false);
  AddNumericsOptions(
      add("numerics", "Traction beside published numeric laws at the soil's cone index", Numerics),
      &a->numerics);
  CLI::App* eval =
      add("eval", "Answer wheel states: all combinations of slips, angles and loads", Eval);
  model(eval);
  eval->add_option("--slip", a->slips, "(r w - v_x)/max(|r w|, V); several: 0.1,0.2")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false);
  eval->add_option("--angle-deg", a->angles_deg, "attack angles [deg]; 0 if not given")
      ->delimiter(',')
      ->allow_extra_args(false);
  eval->add_option("--load", a->loads, "vertical loads [N]")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::NonNegativeNumber);
  eval->add_option("--speed", a->speed, "max(|r w|, V) [m/s]; the training speed if not given")
      ->check(CLI::PositiveNumber);
  eval->add_option("--radius", a->similar_radius,
                   "of a geometrically similar wheel in likewise larger grains [m]");
  eval->add_option("--gravity", a->similar_gravity, "another one [m/s^2]");
  AddExplain(add("explain", "Say why a model answers one wheel state as it does", ExplainOne), a);
  CLI::App* compare = add("compare", "DEM, surrogate and measurement side by side", Compare);
  model(compare);
  compare
      ->add_option("--measured", a->measured,
                   "CSV of measured tests, or rows.json of grouser validate")
      ->required();
  compare->add_option("--out", a->out, "model file to write: this one with sd_form by region");
  compare->add_flag("--leave-angles-out", a->leave_angles_out,
                    "how many rows of each angle the other angles' intervals hold");
  compare->add_option("--runs", a->run_dirs, "campaign folder; else the model's own runs");
  accept(compare);
  CLI::App* regions = add("regions", "Regions in which DEM is compared with measurements", Regions);
  regions->add_option("--slip", a->slips, "slips of states")->delimiter(',');
  regions->add_option("--angle-deg", a->angles_deg, "their attack angles [deg]")->delimiter(',');
  CLI::App* gate = add("gate", "Check whether a candidate may replace its base", Gate);
  gate->add_option("--base", a->base, "model file")->required();
  gate->add_option("--candidate", a->candidate, "model file")->required();
  for (const GateLimitField& field : kGateLimits) {
    gate->add_option(std::string("--") + field.option, a->limits.*field.value, field.text)
        ->check(CLI::Range(0.0, field.most))
        ->capture_default_str();
  }
  CLI::App* migrate =
      add("migrate", "Convert files of earlier versions to today's form", MigrateAll);
  migrate->add_option("files", a->files, "model files, run files, campaign.json, *.runs.json")
      ->required();
  migrate->add_option("--out", a->out,
                      "folder to write to; else in place, the originals kept as FILE.before");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fits surrogate models to DEM wheel tests, and shows what they say.");
  app.name("grouser-fit");
  app.set_version_flag("--version", "grouser-fit " GROUSER_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  grouser-fit fit --runs campaign/ --name cmu-smooth --out cmu.model\n"
      "  grouser-fit eval cmu.model --slip 0.3 --angle-deg 30 --load 24 --json\n"
      "  grouser-fit eval cmu.model --slip=-0.2,0.2 --angle-deg 0,30 --load 24 --json  # a line "
      "each\n"
      "  grouser-fit eval cmu.model --slip 0.3 --load 70 --radius 0.125 --gravity 1.62\n"
      "  grouser-fit explain cmu.model --slip 0.3 --angle-deg 30 --load 24 --runs 10\n"
      "  grouser-fit make --wheel my-wheel.yaml --soil 'LETE sand' --out my.model\n"
      "  grouser-fit numerics tyre.model --load 600 --deflection 0.2\n"
      "  grouser-fit compare cmu.model --measured cmu.csv --runs campaign/\n"
      "  grouser-fit profiles --runs campaign/ --model cmu.model\n"
      "  grouser-fit refit --base cmu.model --run new.run.h5 --out cmu-2.model\n"
      "  grouser-fit gate --base cmu.model --candidate cmu-2.model\n"
      "  grouser-fit migrate old/*.model --out new\n"
      "Exit codes: 0 ok, 1 failed, 2 usage or bad input, 3 a gate check failed.");
  Arguments arguments;
  arguments.command = "grouser-fit";
  for (int i = 1; i < argc; ++i) arguments.command += std::string(" ") + argv[i];
  int (*chosen)(const Arguments&) = nullptr;
  AddCommands(&app, &arguments, &chosen);
  grouser::records::RefuseNaN(app);
  grouser::records::DescribeOnDemand(app);
  try {
    app.parse(argc, argv);
    return chosen(arguments);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  } catch (const std::invalid_argument& error) {
    Say(error.what());
    return kUsage;
  } catch (const records::InputError& error) {
    Say(error.what());
    return kUsage;
  } catch (const std::exception& error) {
    Say(error.what());
    return kFailed;
  }
}
