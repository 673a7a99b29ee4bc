#include <fmt/format.h>
#include <unistd.h>

#include <iostream>
#include <numbers>
#include <random>
#include <stdexcept>

#include "clients/cli/job_options.h"
#include "clients/cli/print.h"
#include "clients/cli/watch_jobs.h"
#include "proto/records/message_json.h"

namespace grouser::cli {
namespace {

using client::JobsClient;
using v1alpha1::Job;

int Print(const Common& common, const Job& job) {
  common.json ? PrintJson(job) : PrintJob(job);
  return kExitOk;
}

bool WaitsForAPerson(const Job& job) {
  return job.job_state() == v1alpha1::JOB_STATE_AWAITING_PROMOTION;
}

}  // namespace

const std::string& JobsAddress(const Common& common) {
  if (!common.server_alone) return common.jobs;
  throw std::invalid_argument("--server " + common.server +
                              ": the address of grouser-server, expected --jobs with that of "
                              "grouser-jobs, which this command asks");
}

JobsClient MakeClient(const Common& common) {
  return JobsClient(client::Server{JobsAddress(common), common.access},
                    client::Milliseconds(common.deadline_ms));
}

int Watch(const Common& common, const std::string& job_id) {
  const Job job = MakeClient(common).Watch(job_id, [](const Job& now) {
    std::cerr << fmt::format("{} {} {:.0f} % {}{}\n", now.job_id(),
                             records::ShortName(now.job_state()), 100 * now.progress(),
                             now.message(),
                             now.has_eta() ? fmt::format(", ETA {} s", now.eta().seconds()) : "");
    return !WaitsForAPerson(now);
  });
  Print(common, job);
  const bool good = WaitsForAPerson(job) || job.job_state() == v1alpha1::JOB_STATE_DONE;
  return good ? kExitOk : kExitFailed;
}

std::string NewRequestId() {
  std::random_device random;
  return fmt::format("cli-{}-{:08x}{:08x}", ::getpid(), random(), random());
}

int AfterSubmission(const Common& common, const std::string& request_id,
                    const google::protobuf::Message& response, const Job& job, bool joined,
                    bool watch) {
  std::cerr << fmt::format("request {}: job {}{}\n", request_id, job.job_id(),
                           joined ? " (joined)" : "");
  if (watch) return Watch(common, job.job_id());
  if (!common.json) return Print(common, job);
  PrintJson(response);
  return kExitOk;
}

namespace {

struct SubmitOptions {
  v1alpha1::SubmitRefinementRequest request;
  std::string mode = "rim";
  double angle_deg = 0;
  bool watch = false;
};

v1alpha1::RigMode ModeFrom(const std::string& mode) {
  if (mode == "towed") return v1alpha1::RIG_MODE_TOWED;
  if (mode == "free") return v1alpha1::RIG_MODE_FREE_SLIP;
  return v1alpha1::RIG_MODE_RIM_SPEED;
}

int Submit(const Common& common, SubmitOptions options) {
  auto& request = options.request;
  if (request.request_id().empty()) request.set_request_id(NewRequestId());
  request.mutable_state()->set_mode(ModeFrom(options.mode));
  request.mutable_state()->set_attack_angle_rad(options.angle_deg * std::numbers::pi / 180.0);
  const auto response = MakeClient(common).Submit(request);
  return AfterSubmission(common, request.request_id(), response, response.job(), response.joined(),
                         options.watch);
}

int ListJobs(const Common& common, int limit) {
  const auto response = MakeClient(common).List(limit);
  if (common.json) {
    PrintJson(response);
  } else {
    for (const Job& job : response.jobs()) PrintJob(job);
  }
  return kExitOk;
}

int Promote(const Common& common, const v1alpha1::PromoteRequest& request) {
  const auto response = MakeClient(common).Promote(request);
  if (common.json) {
    PrintJson(response);
    return kExitOk;
  }
  std::cerr << fmt::format("promoted; generation {}{}\n", response.generation(),
                           request.candidate_digest().empty()
                               ? "; whichever candidate the job had: --candidate names the one "
                                 "that you looked at"
                               : "");
  return Print(common, response.job());
}

/// Binds a command-line option to a field through its setter.
template <class T, class Setter>
CLI::Option* AddField(CLI::App* command, const char* name, const char* text, Setter set) {
  return command->add_option_function<T>(
      name, [set](const T& value) { set(value); }, text);
}

void AddSubmit(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  auto* submit = app.add_subcommand("submit", "Asks for a fresh DEM run at a state and a refit");
  auto options = std::make_shared<SubmitOptions>();
  auto* request = &options->request;
  AddField<std::string>(submit, "--model", "Model to refine; default: the only one",
                        [request](const auto& v) { request->set_model(v); });
  submit->add_option("--mode", options->mode, "rim, towed or free")
      ->check(CLI::IsMember({"rim", "towed", "free"}))
      ->capture_default_str();
  AddField<double>(submit, "--slip", "Slip [-]",
                   [request](double v) { request->mutable_state()->set_slip(v); });
  submit->add_option("--angle-deg", options->angle_deg, "Attack angle [deg]");
  AddField<double>(submit, "--load", "Vertical load [N]", [request](double v) {
    request->mutable_state()->set_load_n(v);
  })->required();
  AddField<double>(submit, "--speed", "max(|r w|, V) [m/s]; default: the model's",
                   [request](double v) { request->mutable_state()->set_speed_m_per_s(v); });
  AddField<double>(submit, "--drawbar", "Pull to overcome, mode free [N]",
                   [request](double v) { request->mutable_state()->set_drawbar_n(v); });
  AddField<std::uint64_t>(submit, "--seed", "Tile seed; 0: the model's own",
                          [request](std::uint64_t v) { request->set_seed(v); });
  AddField<double>(submit, "--max-time", "Simulated limit [s]; 0: as the model's rig",
                   [request](double v) { request->set_max_time_s(v); });
  AddEnvelope(submit, request, "Longest DEM run by the clock [s]; default: the program's");
  submit->add_flag("--watch", options->watch, "Follow the job to its end");
  submit->footer(
      "Examples:\n"
      "  grouser-client submit --slip 0.3 --angle-deg 20 --load 24 --watch\n"
      "  grouser-client submit --mode towed --load 24 --priority 5 --time-limit-s 3600");
  submit->callback([=] { *action = [=] { return Submit(*common, *options); }; });
}

void AddPromote(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  auto* promote = app.add_subcommand("promote", "Moves an alias to a job's candidate");
  auto request = std::make_shared<v1alpha1::PromoteRequest>();
  request->set_alias("stable");
  AddField<std::string>(promote, "job", "Job", [request](const auto& v) {
    request->set_job_id(v);
  })->required();
  AddField<std::string>(promote, "--alias", "Alias to move; default: stable",
                        [request](const auto& v) { request->set_alias(v); });
  AddField<std::string>(promote, "--candidate",
                        "Digest of the candidate that you looked at (12 hex digits or more, as "
                        "'job' prints it): refused where the job has another by now",
                        [request](const auto& v) { request->set_candidate_digest(v); });
  AddField<std::string>(promote, "--who", "Who decided, recorded as what the caller says",
                        [request](const auto& v) { request->set_who(v); })
      ->required();
  AddField<std::string>(promote, "--why", "Why", [request](const auto& v) {
    request->set_why(v);
  })->required();
  promote->add_flag_callback(
      "--override-gate", [request] { request->set_override_gate(true); },
      "Promote although a gate check failed");
  promote->footer(
      "Examples:\n"
      "  grouser-client promote JOB --candidate DIGEST --who me --why 'held-out error fell'\n"
      "  grouser-client promote JOB --candidate DIGEST --alias canary --who me --why 'to be "
      "tried'");
  promote->callback([=] { *action = [=] { return Promote(*common, *request); }; });
}

}  // namespace

void AddJobCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  AddSubmit(app, common, action);
  AddPromote(app, common, action);

  auto id = std::make_shared<std::string>();
  auto* job = app.add_subcommand("job", "One job");
  job->add_option("job", *id, "Job")->required();
  job->footer("Examples:\n  grouser-client job JOB\n  grouser-client job JOB --json");
  job->callback([=] { *action = [=] { return Print(*common, MakeClient(*common).Get(*id)); }; });

  auto limit = std::make_shared<int>(20);
  auto* watch = app.add_subcommand(
      "watch",
      "Follows a job until it ends or awaits promotion; without one, the latest jobs as a "
      "table until none is at work (exit code 0, however they ended)");
  auto* one = watch->add_option("job", *id, "Job");
  watch->add_option("--limit", *limit, "How many jobs")
      ->excludes(one)
      ->check(CLI::Range(1, 500))
      ->capture_default_str();
  watch->footer("Examples:\n  grouser-client watch\n  grouser-client watch JOB");
  watch->callback([=] {
    *action = [=] { return id->empty() ? WatchAll(*common, *limit) : Watch(*common, *id); };
  });

  auto* jobs = app.add_subcommand("jobs", "The latest jobs");
  jobs->add_option("--limit", *limit, "How many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  jobs->footer("Examples:\n  grouser-client jobs\n  grouser-client jobs --limit 100 --json");
  jobs->callback([=] { *action = [=] { return ListJobs(*common, *limit); }; });

  auto request_id = std::make_shared<std::string>();
  auto* cancel = app.add_subcommand("cancel", "Withdraws one request; work stops at the last");
  cancel->add_option("job", *id, "Job")->required();
  cancel->add_option("--request-id", *request_id, "As printed by submit")->required();
  cancel->footer("Example:\n  grouser-client cancel JOB --request-id cli-4711-0123456789abcdef");
  cancel->callback([=] {
    *action = [=] { return Print(*common, MakeClient(*common).Cancel(*id, *request_id)); };
  });
}

}  // namespace grouser::cli
