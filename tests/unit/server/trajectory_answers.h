#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <vector>

#include "server/vehicle/vehicle_answer.h"
#include "server/vehicle/vehicle_check.h"

namespace grouser::server::testing {

using Request = v1alpha1::EvaluateTrajectoriesRequest;
using Response = v1alpha1::EvaluateTrajectoriesResponse;

/// `k` trajectories of `m` steps each, of 0.1 s.
inline Request Of(int k, int m) {
  Request request;
  request.set_vehicle("husky");
  v1alpha1::Trajectories& t = *request.mutable_trajectories();
  for (int i = 0; i < k; ++i) t.add_steps(static_cast<std::uint32_t>(m));
  t.add_v_x_m_per_s(0.5);
  t.add_duration_s(0.1);
  return request;
}

class TrajectoryAnswerTest : public ::testing::Test {
 protected:
  Status Ask(const Request& request, Response* response) {
    const Status checked = Check(fleet_, request);
    return checked.ok() ? Answer({fleet_, bench_, cancelled_}, request, response) : checked;
  }
  Response Good(const Request& request) {
    Response response;
    const Status status = Ask(request, &response);
    EXPECT_TRUE(status.ok()) << status.message;
    return response;
  }
  void Refuses(StatusCode code, const Request& request, const char* text) {
    Response response;
    const Status status = Ask(request, &response);
    EXPECT_EQ(status.code, code) << status.message;
    EXPECT_THAT(status.message, ::testing::HasSubstr(text));
  }
  template <class Change>
  void RefusesInput(const char* text, const Change& change) {
    Request request = Of(2, 3);
    change(request.mutable_trajectories());
    Refuses(StatusCode::kInvalidArgument, request, text);
  }

  Fleet fleet_{std::vector<std::string>{GROUSER_VEHICLE}};
  VehicleBench bench_{fleet_};
  std::atomic<bool> cancelled_{false};
};

}  // namespace grouser::server::testing
