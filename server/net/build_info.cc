#include "server/net/build_info.h"

#include <google/protobuf/util/time_util.h>

#include "proto/records/model_file.h"
#include "server/net/source_commit.h"
#include "surrogate/models/isa.h"

namespace grouser::server {

v1alpha1::GetBuildInfoResponse MakeBuildInfo(const std::string& program) {
  v1alpha1::GetBuildInfoResponse build;
  build.set_program(program);
  build.set_version(GROUSER_VERSION);
  build.set_commit(SourceCommit());
  build.set_compiler(GROUSER_COMPILER);
  build.set_build_type(GROUSER_BUILD_TYPE);
  build.set_instruction_set(surrogate::BestIsa());
  auto* models = build.add_formats();
  models->set_name("model file");
  models->set_version(records::kModelFileVersion);
  *build.mutable_start_time() = google::protobuf::util::TimeUtil::GetCurrentTime();
  return build;
}

void AddBuildInfo(const v1alpha1::GetBuildInfoResponse& build, MetricPage* page) {
  page->AddGauge("grouser_build_info", "What runs here, as labels; always 1.", 1,
                 {{"program", build.program()},
                  {"version", build.version()},
                  {"commit", build.commit()},
                  {"compiler", build.compiler()},
                  {"instruction_set", build.instruction_set()}});
}

}  // namespace grouser::server
