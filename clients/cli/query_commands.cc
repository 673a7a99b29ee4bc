#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <stdexcept>

#include "clients/cli/accuracy_options.h"
#include "clients/cli/commands.h"
#include "clients/cli/print.h"
#include "clients/cli/state_options.h"
#include "clients/cpp/lcm_client.h"
#include "clients/cpp/terrain_client.h"
#include "surrogate/model_io/explanation_text.h"

namespace grouser::cli {
namespace {

using client::Milliseconds;

struct QueryOptions {
  std::string model;
  StateOptions states;
  AccuracyOptions accuracy;
  bool values_only = false, gradients = false, explain = false;
  std::uint32_t runs = 0;
  std::vector<std::string> fields;
};

struct LcmOptions {
  std::string model, url, interface = "lo";
  StateOptions states;
};

/// Why a state is INVALID, from what was asked.
std::string WhyInvalid(const v1alpha1::WheelStates& states, int i) {
  const double load = states.load_n(i);
  if (!std::isfinite(load) || load < 0) {
    return fmt::format("load {:.4g} N, expected a finite one, 0 or more", load);
  }
  if (!states.has_slip()) return "expected finite velocities";
  return fmt::format("slip {:.4g} at attack angle {:.4g} deg, which no velocities have",
                     states.slip().slip(i),
                     states.slip().attack_angle_rad(i) * 180.0 / std::numbers::pi);
}

/// kExitOk where at least one state was answered; else says on stderr why not.
int ExitCodeOf(const v1alpha1::EvaluateWheelsResponse& response,
               const v1alpha1::WheelStates& states) {
  const auto& flags = response.responses().flags();
  const auto invalid = [](std::uint32_t f) { return (f & v1alpha1::STATE_FLAG_INVALID) != 0; };
  if (!std::all_of(flags.begin(), flags.end(), invalid)) return kExitOk;
  for (int i = 0; i < flags.size(); ++i) {
    fmt::print(stderr, "grouser-client: state {} is INVALID: {}\n", i, WhyInvalid(states, i));
  }
  return kExitUsage;
}

int RunExplain(const client::TerrainClient& client, const Common& common,
               const QueryOptions& options) {
  v1alpha1::ExplainRequest request;
  request.set_model(options.model);
  request.set_max_runs(options.runs);
  *request.mutable_state() = options.states.Build();
  const int states = request.state().load_n_size();
  if (states != 1) {
    throw CLI::ValidationError("--explain", fmt::format("{} states, expected one", states));
  }
  const auto response = client.Explain(request);
  if (common.json) {
    PrintJson(response);
  } else {
    fmt::print("{}", surrogate::ExplanationText(response.explanation()));
  }
  const bool invalid = (response.explanation().flags() & v1alpha1::STATE_FLAG_INVALID) != 0;
  return invalid ? kExitUsage : kExitOk;
}

int RunQuery(const Common& common, const QueryOptions& options) {
  const client::TerrainClient client(client::Server{common.server, common.access},
                                     Milliseconds(common.deadline_ms));
  if (options.explain) return RunExplain(client, common, options);
  v1alpha1::EvaluateWheelsRequest request;
  request.set_model(options.model);
  request.set_values_only(options.values_only);
  request.set_with_gradients(options.gradients);
  request.mutable_fields()->Assign(options.fields.begin(), options.fields.end());
  *request.mutable_states() = options.states.Build();
  options.accuracy.Apply(&request);
  const auto response = client.Evaluate(request);
  if (common.json) {
    PrintJson(response);
  } else {
    const auto& loads = request.states().load_n();
    PrintResponses(response, {loads.begin(), loads.end()});
    PrintAccuracyOutcome(response, common.jobs == Common().jobs ? "" : common.jobs);
  }
  return ExitCodeOf(response, request.states());
}

int RunModels(const Common& common) {
  const client::TerrainClient client(client::Server{common.server, common.access},
                                     Milliseconds(common.deadline_ms));
  const auto response = client.ListModels();
  common.json ? PrintJson(response) : PrintModels(response);
  return kExitOk;
}

int RunModel(const Common& common, const std::string& model) {
  const client::TerrainClient client(client::Server{common.server, common.access},
                                     Milliseconds(common.deadline_ms));
  const auto response = client.GetModel(model);
  common.json ? PrintJson(response) : PrintModel(response);
  return kExitOk;
}

int RunHealth(const Common& common, const std::string& service) {
  const bool of_jobs = service == "jobs";
  const bool serving =
      client::IsServing({of_jobs ? JobsAddress(common) : common.server, common.access}, "",
                        Milliseconds(common.deadline_ms));
  if (common.json) {
    fmt::print("{{\"serving\": {}}}\n", serving);
  } else {
    fmt::print("{}\n", serving ? "SERVING" : "NOT_SERVING");
  }
  return serving ? kExitOk : kExitFailed;
}

int RunVersion(const Common& common, const std::string& program) {
  const client::Server server{program == "jobs" ? JobsAddress(common) : common.server,
                              common.access};
  const auto build = client::GetBuildInfo(server, Milliseconds(common.deadline_ms));
  if (common.json) {
    PrintJson(build);
    return kExitOk;
  }
  fmt::print("{} {}\ncommit {}\n{}, {}\ninstruction set {}\n", build.program(), build.version(),
             build.commit(), build.compiler(), build.build_type(), build.instruction_set());
  for (const auto& format : build.formats()) {
    fmt::print("{} version {}\n", format.name(), format.version());
  }
  return kExitOk;
}

grouser_lcm::wheel_query_t ToLcm(const std::string& model, const v1alpha1::WheelStates& states) {
  if (!states.has_velocity()) {
    throw CLI::ValidationError("state", "LCM takes velocities: expected --vx, --vy and --rim");
  }
  const auto copy = [](const auto& field) {
    return std::vector<double>(field.begin(), field.end());
  };
  grouser_lcm::wheel_query_t query;
  query.model = model;
  query.n = states.load_n_size();
  query.v_x = copy(states.velocity().v_x_m_per_s());
  query.v_y = copy(states.velocity().v_y_m_per_s());
  query.rim_speed = copy(states.velocity().rim_speed_m_per_s());
  query.load = copy(states.load_n());
  return query;
}

/// The LCM answer in the words of the gRPC one, so that both print alike. What
/// LCM does not carry stays empty.
v1alpha1::EvaluateWheelsResponse FromLcm(const grouser_lcm::wheel_response_t& in,
                                         const grouser_lcm::wheel_measured_t& measured,
                                         const v1alpha1::WheelStates& states) {
  v1alpha1::EvaluateWheelsResponse out;
  out.set_sequence(in.sequence);
  out.set_model(in.model);
  auto* r = out.mutable_responses();
  *r->mutable_velocity() = states.velocity();
  *r->mutable_flags() = {in.flags.begin(), in.flags.end()};
  *r->mutable_slip()->mutable_slip() = {in.slip.begin(), in.slip.end()};
  *r->mutable_slip()->mutable_attack_angle_rad() = {in.attack_angle.begin(), in.attack_angle.end()};
  const auto copy = [](const grouser_lcm::wheel_output_t& from, v1alpha1::OutputArray* to) {
    *to->mutable_value() = {from.value.begin(), from.value.end()};
    *to->mutable_sd_fit() = {from.sd_fit.begin(), from.sd_fit.end()};
    *to->mutable_sd_patch() = {from.sd_patch.begin(), from.sd_patch.end()};
    *to->mutable_low() = {from.low.begin(), from.low.end()};
    *to->mutable_high() = {from.high.begin(), from.high.end()};
  };
  copy(in.f_x, r->mutable_f_x());
  copy(in.f_y, r->mutable_f_y());
  copy(in.f_z, r->mutable_f_z());
  copy(in.torque, r->mutable_torque());
  copy(in.m_z, r->mutable_m_z());
  copy(in.sinkage, r->mutable_sinkage());
  if (measured.n != in.n) return out;
  const auto add = [](const grouser_lcm::measured_output_t& from, v1alpha1::OutputArray* to) {
    *to->mutable_sd_form() = {from.sd_form.begin(), from.sd_form.end()};
    *to->mutable_measured_low() = {from.low.begin(), from.low.end()};
    *to->mutable_measured_high() = {from.high.begin(), from.high.end()};
  };
  add(measured.f_x, r->mutable_f_x());
  add(measured.f_y, r->mutable_f_y());
  add(measured.f_z, r->mutable_f_z());
  add(measured.torque, r->mutable_torque());
  add(measured.m_z, r->mutable_m_z());
  add(measured.sinkage, r->mutable_sinkage());
  return out;
}

void PrintLcm(const v1alpha1::EvaluateWheelsResponse& response) {
  const auto& r = response.responses();
  fmt::print("model {}\n{:>5}", response.model(), "state");
  for (const auto& field : surrogate::kOutputFields) {
    fmt::print(" {:>10}", fmt::format("{} {}", field.name, field.unit));
  }
  fmt::print("  flags\n");
  const auto outputs = OutputsOf(r);
  for (int i = 0; i < r.flags_size(); ++i) {
    using Values =
        const google::protobuf::RepeatedField<double>& (v1alpha1::OutputArray::*)() const;
    const auto line = [&](const std::string& head, Values values, const std::string& end) {
      fmt::print("{:>5}", head);
      for (const auto* output : outputs) {
        const auto& field = (output->*values)();
        fmt::print(" {:>10}", i < field.size() ? fmt::format("{:.4g}", field.Get(i)) : "-");
      }
      fmt::print("{}\n", end);
    };
    line(std::to_string(i), &v1alpha1::OutputArray::value, "  " + FlagNames(r.flags(i)));
    line("low", &v1alpha1::OutputArray::low, "");
    line("high", &v1alpha1::OutputArray::high, "");
    const bool measured = std::ranges::any_of(
        outputs, [](const v1alpha1::OutputArray* o) { return o->measured_low_size() > 0; });
    if (!measured) continue;
    line("low", &v1alpha1::OutputArray::measured_low, "  for a measurement");
    line("high", &v1alpha1::OutputArray::measured_high, "  for a measurement");
  }
}

int RunLcmQuery(const Common& common, const LcmOptions& options) {
  const auto states = options.states.Build();
  auto query = ToLcm(options.model, states);
  client::LcmClient client(options.url, options.interface);
  grouser_lcm::wheel_measured_t measured;
  const auto answer = client.Query(&query, Milliseconds(common.deadline_ms), &measured);
  if (!answer) {
    throw std::runtime_error(
        fmt::format("lcm: no answer within {} ms; is grouser-server running "
                    "with LCM on this URL?",
                    common.deadline_ms));
  }
  const auto response = FromLcm(*answer, measured, states);
  common.json ? PrintJson(response) : PrintLcm(response);
  return ExitCodeOf(response, states);
}

}  // namespace

void AddQueryCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  const char* model_text = "NAME, NAME@ALIAS or NAME@sha256:HEX; default: the only model";
  auto* query = app.add_subcommand("query", "Forces, torque and sinkage of wheel states (gRPC)");
  auto query_options = std::make_shared<QueryOptions>();
  query->add_option("--model", query_options->model, model_text);
  query->add_flag("--values-only", query_options->values_only, "Leave the uncertainty out");
  query->add_flag("--gradients", query_options->gradients,
                  "Derivatives by v_x, v_y, rim speed and load as well");
  query
      ->add_option("--fields", query_options->fields,
                   "What is answered, as f_x,sinkage.value,slip: outputs, parts of them, velocity, "
                   "slip; default: all")
      ->delimiter(',');
  auto* explain = query->add_flag("--explain", query_options->explain,
                                  "Why one state is answered so: flags, parts of the interval, the "
                                  "nearest runs with their hashes and stresses");
  query->add_option("--runs", query_options->runs, "Runs of each kind that --explain names (5)")
      ->needs(explain)
      ->check(CLI::Range(1, 20));
  query_options->states.AddTo(*query);
  query_options->accuracy.AddTo(*query);
  for (const char* other : {"--values-only", "--gradients", "--fields", "--tolerance", "--share",
                            "--against", "--budget-us"}) {
    explain->excludes(query->get_option(other));
  }
  query->callback([=] { *action = [=] { return RunQuery(*common, *query_options); }; });

  auto* lcm = app.add_subcommand("lcm-query", "The same over LCM (velocities, up to 64 states)");
  auto lcm_options = std::make_shared<LcmOptions>();
  lcm->add_option("--model", lcm_options->model, model_text);
  lcm->add_option("--lcm-url", lcm_options->url, "LCM URL (default: $LCM_DEFAULT_URL)");
  lcm->add_option("--lcm-interface", lcm_options->interface,
                  "Network interface that answers are received on, such as eth0; lo: from this "
                  "machine")
      ->capture_default_str();
  lcm_options->states.AddTo(*lcm);
  lcm->callback([=] { *action = [=] { return RunLcmQuery(*common, *lcm_options); }; });

  auto* models = app.add_subcommand("models", "Models that are served");
  models->callback([=] { *action = [=] { return RunModels(*common); }; });

  auto* one = app.add_subcommand("model", "One model with its error table and provenance");
  auto name = std::make_shared<std::string>();
  one->add_option("model", *name, model_text);
  one->callback([=] {
    if (!one->get_subcommands().empty()) return;  // AddAliasCommands
    *action = [=] { return RunModel(*common, *name); };
  });

  auto* health = app.add_subcommand("health", "Whether a program serves (exit 0) or not (1)");
  auto service = std::make_shared<std::string>("server");
  health->add_option("program", *service, "server or jobs")
      ->check(CLI::IsMember({"server", "jobs"}))
      ->capture_default_str();
  health->callback([=] { *action = [=] { return RunHealth(*common, *service); }; });

  auto* version = app.add_subcommand("version", "What a program was built from, and its formats");
  auto program = std::make_shared<std::string>("server");
  version->add_option("program", *program, "server or jobs")
      ->check(CLI::IsMember({"server", "jobs"}))
      ->capture_default_str();
  version->callback([=] { *action = [=] { return RunVersion(*common, *program); }; });
}

}  // namespace grouser::cli
