#pragma once

#include <string>

#include "grouser/v1alpha1/operator_service.pb.h"
#include "server/core/metric_page.h"

namespace grouser::server {

/// What this program is, and that it starts now. `program`: its name. Its own formats are to be
/// added; those of model and alias files are there.
v1alpha1::GetBuildInfoResponse MakeBuildInfo(const std::string& program);

/// As labels of a gauge that is 1, as Prometheus's programs do it.
void AddBuildInfo(const v1alpha1::GetBuildInfoResponse& build, MetricPage* page);

}  // namespace grouser::server
