#pragma once

#include "server/core/status.h"

namespace grouser::server {

/// What everything that judges a request about jobs throws.
using RequestCode = StatusCode;
using RequestError = StatusError;

}  // namespace grouser::server
