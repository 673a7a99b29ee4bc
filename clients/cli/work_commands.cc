#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "clients/cli/file_bundle.h"
#include "clients/cli/job_options.h"
#include "clients/cli/print.h"
#include "proto/records/message_json.h"

namespace grouser::cli {
namespace {

namespace fs = std::filesystem;
using v1alpha1::CalibrationWork;

constexpr int kCheckMs = 120000;  // the server's programs read the files before it answers
constexpr char kLimitText[] = "Longest time by the clock [s]; default: the program's";

template <class Request>
struct Submission {
  Request request;
  std::string file, soil, scene, vary;
  std::vector<std::string> more;
  bool watch = false;
};
using CampaignSubmission = Submission<v1alpha1::SubmitCampaignRequest>;
using CalibrationSubmission = Submission<v1alpha1::SubmitCalibrationRequest>;

template <class Request>
int Send(Common common, const Request& request, bool watch) {
  common.deadline_ms = std::max(common.deadline_ms, kCheckMs);
  const auto response = MakeClient(common).Submit(request);
  return AfterSubmission(common, request.request_id(), response, response.job(), response.joined(),
                         watch);
}

int SubmitCampaign(const Common& common, CampaignSubmission asked) {
  auto& request = asked.request;
  if (request.request_id().empty()) request.set_request_id(NewRequestId());
  auto* campaign = request.mutable_campaign();
  if (campaign->from_server()) {
    campaign->set_file(asked.file);
  } else {
    FileBundle files;
    files.Add(asked.file);
    for (const std::string& file : asked.more) files.Add(file);
    campaign->set_file(files.NameOf(asked.file));
    files.FillInto(request.mutable_files());
  }
  return Send(common, request, asked.watch);
}

int SubmitCalibration(const Common& common, CalibrationSubmission asked) {
  auto& request = asked.request;
  if (request.request_id().empty()) request.set_request_id(NewRequestId());
  FileBundle files;
  for (const std::string& file : {asked.file, asked.soil, asked.scene, asked.vary}) {
    if (!file.empty()) files.Add(file);
  }
  for (const std::string& file : asked.more) files.Add(file);
  CalibrationWork* work = request.mutable_calibration();
  work->set_data(files.NameOf(asked.file));
  if (!asked.soil.empty()) work->set_soil(files.NameOf(asked.soil));
  if (!asked.scene.empty()) work->set_scene(files.NameOf(asked.scene));
  if (!asked.vary.empty()) work->set_vary(files.NameOf(asked.vary));
  files.FillInto(request.mutable_files());
  return Send(common, request, asked.watch);
}

int Fetch(const Common& common, const std::string& job_id, std::string out) {
  const auto client = MakeClient(common);
  const v1alpha1::Job job = client.Get(job_id);
  if (job.results().empty()) {
    throw std::runtime_error(fmt::format("job {} is {} and has no results", job_id,
                                         records::ShortName(job.job_state())));
  }
  if (out.empty()) out = "out/" + job_id;
  fs::create_directories(out);
  for (const auto& result : job.results()) {
    // A server that is not what it claims must not write elsewhere.
    if (result.name() != fs::path(result.name()).filename() || result.name().starts_with('.')) {
      throw std::runtime_error("result '" + result.name() + "': expected a plain file name");
    }
    const std::string path = out + "/" + result.name(), part = path + ".part";
    std::ofstream file(part, std::ios::binary);
    client.ReadFile(job_id, result.name(), [&](const std::string& bytes) { file << bytes; });
    file.close();
    if (!file || fs::file_size(part) != result.bytes()) {
      throw std::runtime_error(
          fmt::format("{}: not whole, expected {} bytes", part, result.bytes()));
    }
    fs::rename(part, path);
    fmt::print("{}\n", path);
  }
  return kExitOk;
}

template <class Request>
void AddShared(CLI::App* command, Submission<Request>* asked) {
  AddEnvelope(command, &asked->request, kLimitText);
  command->add_option("--with", asked->more,
                      "Further files to send; .yaml and .csv files that others name come along by "
                      "themselves");
  command->add_flag("--watch", asked->watch, "Follow the job to its end");
}

void AddCampaign(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  auto* command =
      app.add_subcommand("submit-campaign", "Runs a campaign of DEM wheel tests as a job");
  auto asked = std::make_shared<CampaignSubmission>();
  command->add_option("file", asked->file, "Campaign file (*.campaign.yaml)")->required();
  auto* from_server = command->add_flag_callback(
      "--from-server", [asked] { asked->request.mutable_campaign()->set_from_server(true); },
      "The file is one of the folder that the operator allows");
  command
      ->add_option_function<std::vector<std::string>>(
          "--server-file",
          [asked](const auto& names) {
            for (const auto& name : names) {
              asked->request.mutable_campaign()->add_server_files(name);
            }
          },
          "Scene or soil of that folder which the campaign names")
      ->excludes(from_server);
  AddShared(command, asked.get());
  command->footer(
      "Examples:\n"
      "  grouser-client submit-campaign dem_offline/campaigns/smoke.campaign.yaml --watch\n"
      "  grouser-client submit-campaign demo.campaign.yaml --from-server --time-limit-s 7200");
  command->callback([=] { *action = [=] { return SubmitCampaign(*common, *asked); }; });
}

void AddCalibrate(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  auto* calibrate = app.add_subcommand("calibrate", "Calibrates a soil or its DEM grains as a job");
  calibrate->require_subcommand(1);
  auto* soil =
      calibrate->add_subcommand("soil", "Parameters of a soil from measured tests: seconds");
  auto asked = std::make_shared<CalibrationSubmission>();
  asked->request.mutable_calibration()->set_kind(v1alpha1::CALIBRATION_KIND_SOIL);
  soil->add_option("data", asked->file, "Measurement file (docs/calibration.md)")->required();
  soil->add_flag_callback(
      "--report", [asked] { asked->request.mutable_calibration()->set_report(true); },
      "report.html as well, which needs Python on the server");
  AddShared(soil, asked.get());
  soil->footer("Example:\n  grouser-client calibrate soil my-sand.yaml --watch");
  soil->callback([=] { *action = [=] { return SubmitCalibration(*common, *asked); }; });

  auto* grains = calibrate->add_subcommand("grains", "DEM grains from measured tests: hours");
  auto of_grains = std::make_shared<CalibrationSubmission>();
  auto* work = of_grains->request.mutable_calibration();
  work->set_kind(v1alpha1::CALIBRATION_KIND_GRAINS);
  grains->add_option("data", of_grains->file, "Measurement file (docs/calibration.md)")->required();
  grains->add_option("--soil", of_grains->soil, "Soil file of grains to begin with")->required();
  grains->add_option("--scene", of_grains->scene, "Scene of the measured wheel")->required();
  grains->add_option("--vary", of_grains->vary, "Parameters and their ranges");
  grains
      ->add_option_function<double>(
          "--budget", [work](double v) { work->set_budget_hours(v); }, "Wall time for its runs [h]")
      ->required();
  grains->add_option_function<std::uint32_t>(
      "--points", [work](std::uint32_t v) { work->set_points(v); },
      "Points that fill the space; default: ten for each parameter that is varied");
  AddShared(grains, of_grains.get());
  grains->footer(
      "Example:\n"
      "  grouser-client calibrate grains my-sand.yaml --soil my.soil.yaml --scene my.scene.yaml "
      "--budget 8");
  grains->callback([=] { *action = [=] { return SubmitCalibration(*common, *of_grains); }; });
}

}  // namespace

void AddWorkCommands(CLI::App& app, std::shared_ptr<Common> common, Action* action) {
  AddCampaign(app, common, action);
  AddCalibrate(app, common, action);
  auto id = std::make_shared<std::string>(), out = std::make_shared<std::string>();
  auto* fetch = app.add_subcommand("fetch", "Copies the result files of a job");
  fetch->add_option("job", *id, "Job")->required();
  fetch->add_option("--out", *out, "Folder for them; default: out/JOB");
  fetch->footer("Example:\n  grouser-client fetch JOB --out out/my-sand");
  fetch->callback([=] { *action = [=] { return Fetch(*common, *id, *out); }; });
}

}  // namespace grouser::cli
