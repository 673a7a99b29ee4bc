#include "server/vehicle/fleet.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <utility>

#include "server/core/page.h"

namespace grouser::server {
namespace {

constexpr std::string_view kSuffix = ".vehicle.yaml";
// In front of a token, so that one of another list is told apart.
constexpr std::string_view kTokenMark = "vehicle:";

}  // namespace

Fleet::Fleet(const std::vector<std::string>& files_and_folders) {
  for (const std::string& path : files_and_folders) {
    std::error_code error;
    std::filesystem::is_directory(path, error) ? AddFolder(path) : Add(path);
  }
  std::sort(vehicles_.begin(), vehicles_.end(), [](const auto& a, const auto& b) {
    return a->described.vehicle.name < b->described.vehicle.name;
  });
  std::size_t index = 0;
  for (auto& v : vehicles_) v->index = index++;
}

void Fleet::AddFolder(const std::string& folder) {
  std::vector<std::string> files;
  try {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().string().ends_with(kSuffix)) files.push_back(entry.path().string());
    }
  } catch (const std::exception& error) {
    problems_.push_back(folder + ": " + error.what());
  }
  if (files.empty()) {
    problems_.push_back(fmt::format("{}: no file *{}, expected one or more", folder, kSuffix));
  }
  std::sort(files.begin(), files.end());
  for (const std::string& file : files) Add(file);
}

void Fleet::Add(const std::string& file) {
  try {
    auto served = std::make_unique<ServedVehicle>();
    served->file = vehicle::ReadVehicle(file);
    served->described = {served->file.vehicle, served->file.grounds.soils, served->file.sources};
    const std::string& name = served->described.vehicle.name;
    vehicle::Solver(served->file.vehicle, served->file.grounds);  // throws where it has no model
    const ServedVehicle* other = nullptr;
    if (name.empty()) {
      problems_.push_back(file + ": name: empty, expected one to be asked by");
    } else if (Find(name, &other).ok()) {
      problems_.push_back(
          fmt::format("{}: name: {}, expected one that no other vehicle has", file, Quote(name)));
    } else {
      vehicles_.push_back(std::move(served));
    }
  } catch (const std::exception& error) {
    const std::string what = error.what();
    problems_.push_back(what.starts_with(file) ? what : file + ": " + what);
  }
}

Status Fleet::Find(const std::string& name, const ServedVehicle** vehicle) const {
  if (name.empty()) {
    if (vehicles_.size() != 1) {
      return Status::InvalidArgument(fmt::format(
          "vehicle: empty, expected a name, as there are {} vehicles", vehicles_.size()));
    }
    *vehicle = vehicles_.front().get();
    return Status::Ok();
  }
  for (const auto& v : vehicles_) {
    if (v->described.vehicle.name != name) continue;
    *vehicle = v.get();
    return Status::Ok();
  }
  return Status::NotFound(
      fmt::format("vehicle: {}, expected one that ListVehicles names", Quote(name)));
}

Status Fleet::List(const v1alpha1::ListVehiclesRequest& request,
                   v1alpha1::ListVehiclesResponse* response) const {
  int size = 0;
  if (Status status = ReadPageSize(request.page_size(), kMaxVehiclesPageSize, &size); !status.ok())
    return status;
  std::string after = request.page_token();
  if (!after.empty()) {
    if (!after.starts_with(kTokenMark)) return BadPageToken(after);
    after.erase(0, kTokenMark.size());
  }
  std::size_t next = 0, bytes = 0;
  while (next < vehicles_.size() && vehicles_[next]->described.vehicle.name <= after) ++next;
  for (; next < vehicles_.size() && response->vehicles_size() < size; ++next) {
    const vehicle::DescribedVehicle& from = vehicles_[next]->described;
    v1alpha1::VehicleInfo info;
    info.set_name(from.vehicle.name);
    info.set_mass_kg(from.vehicle.mass_kg);
    info.set_wheels(static_cast<std::uint32_t>(from.vehicle.wheels.size()));
    info.set_steered(from.vehicle.steered());
    *info.mutable_soils() = {from.soils.begin(), from.soils.end()};
    if (!AddToPage(std::move(info), &bytes, response->mutable_vehicles())) break;
  }
  if (next < vehicles_.size()) {
    response->set_next_page_token(std::string(kTokenMark) +
                                  vehicles_[next - 1]->described.vehicle.name);
  }
  return Status::Ok();
}

}  // namespace grouser::server
