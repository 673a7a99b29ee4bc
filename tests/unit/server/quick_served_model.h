#pragma once

#include <memory>
#include <string>
#include <utility>

#include "server/core/snapshot.h"
#include "tests/unit/server/fake_model.h"

namespace grouser::testing {

/// A served model without the measurements of MakeServedModel, which take time.
inline std::shared_ptr<server::ServedModel> QuickServedModel(v1alpha1::Model message,
                                                             const std::string& digest) {
  auto served = std::make_shared<server::ServedModel>();
  served->message = std::move(message);
  served->digest = digest;
  served->reference = served->message.name() + "@sha256:" + digest;
  served->evaluator = MakeFakeModel(served->message);
  served->choice.model = served->evaluator.get();
  served->choice.cost_ns = 1;
  served->choice.radius_m = 0.1;
  served->choice.hull = {-1, 1, 1, 10, 40, 0, 9.81};
  served->pair = served->message.name();
  return served;
}

}  // namespace grouser::testing
