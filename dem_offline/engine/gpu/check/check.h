#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dem_offline/engine/gpu/ensemble.h"

// A device against the CPU's engine, and against itself. The same on a card and
// in the emulation; docs/engine.md, "Many worlds at once".

namespace grouser::dem::gpu::check {

struct Row {
  std::string name;
  double value = 0, limit = 0;  ///< kept where value <= limit
  std::string note;
  bool Kept() const { return value <= limit; }
};

using Worlds = std::vector<std::unique_ptr<World>>;

/// Grains that jostle between two glued layers that slide past each other.
std::unique_ptr<World> Jostling(std::uint64_t seed, const ContactModel& contacts, int layers);
/// A bed on a floor, under a treaded wheel that rolls at slip.
std::unique_ptr<World> UnderWheel(std::uint64_t seed, int layers);
/// The same bed under falling clumps of three spheres.
std::unique_ptr<World> UnderRubble(std::uint64_t seed, int layers);
/// Two grains that meet head on (at = 0), or glancing.
std::unique_ptr<World> TwoGrains(double at, const ContactModel& contacts);

/// Every compiled law combination, and some laws on the generic path, with
/// numbers that let them all act.
struct NamedContacts {
  std::string name;
  ContactModel contacts;
};
std::vector<NamedContacts> AllContacts();

/// quick: small worlds, for every machine.
std::vector<Row> RunChecks(Device& device, bool quick);
std::string ToJson(const std::vector<Row>& rows, const std::string& device);

}  // namespace grouser::dem::gpu::check
