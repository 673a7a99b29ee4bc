// In place of answers_of_server.cc where there is no gRPC.
#include <stdexcept>

#include "clients/vehicle/answers.h"

namespace grouser::cli {

std::unique_ptr<VehicleAnswers> AnswersOfServer(const VehicleServer&, const std::string&) {
  throw std::runtime_error("--server: this program was built without gRPC (GROUSER_SERVICES)");
}
std::string ListVehicles(const VehicleServer& server) {
  AnswersOfServer(server, "");
  return "";
}

}  // namespace grouser::cli
