#pragma once

#include <google/protobuf/util/time_util.h>

#include <cmath>
#include <string>

#include "clients/cli/commands.h"
#include "clients/cpp/jobs_client.h"

namespace grouser::cli {

/// What commands about jobs share.
client::JobsClient MakeClient(const Common& common);
/// Follows a job until it has ended or waits for its promotion. Progress goes
/// to stderr, the last state to stdout.
int Watch(const Common& common, const std::string& job_id);
std::string NewRequestId();

/// Says what was accepted, prints it or follows it. `response`: the same as a message, for --json.
int AfterSubmission(const Common& common, const std::string& request_id,
                    const google::protobuf::Message& response, const v1alpha1::Job& job,
                    bool joined, bool watch);

/// Options of a request of any kind of job.
template <class Request>
void AddEnvelope(CLI::App* command, Request* request, const char* limit_text) {
  command
      ->add_option_function<int>(
          "--priority", [request](int v) { request->set_priority(v); },
          "-10 to 10: the higher go first among your own jobs")
      ->check(CLI::Range(-10, 10));
  command
      ->add_option_function<double>(
          "--time-limit-s",
          [request](double v) {
            *request->mutable_time_limit() =
                google::protobuf::util::TimeUtil::MillisecondsToDuration(std::llround(1e3 * v));
          },
          limit_text)
      ->check(CLI::Range(1.0, 1e7));
  command->add_option_function<std::string>(
      "--request-id", [request](const std::string& v) { request->set_request_id(v); },
      "Makes the submission idempotent");
}

}  // namespace grouser::cli
