#pragma once

#include <istream>
#include <string>
#include <vector>

#include "surrogate/models/hard_ground.h"

namespace grouser::surrogate {

/// A published ground that does not yield, without a wheel.
struct PublishedHardGround {
  std::string name;
  /// mu, C and f with their standard deviations: middle and (high - low)/(2 * 1.645) of the table.
  HardGround ground;
  std::string source;
};

/// Reads a table such as surrogate/soils/hard_grounds.csv. Throws std::invalid_argument
/// "NAME:LINE: COLUMN: VALUE, expected ..."; `name` is for messages.
std::vector<PublishedHardGround> ReadHardGrounds(std::istream& table, const std::string& name);

/// surrogate/soils/hard_grounds.csv of the checkout, read.
std::vector<PublishedHardGround> PublishedHardGrounds();

/// By name (letters of either case). Throws std::invalid_argument that lists what there is.
const PublishedHardGround& FindHardGround(const std::vector<PublishedHardGround>& grounds,
                                          const std::string& name);

/// The contact patch of a wheel of which nothing is known: 2 a = r/2, a tyre that is pressed in by
/// 3 % of its radius (a = sqrt(2 r d)); 2 b = 0.9 of the width. Estimates.
void SetUsualContact(double radius_m, double width_m, HardGround* ground);

}  // namespace grouser::surrogate
