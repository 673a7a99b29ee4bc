#pragma once

#include <google/protobuf/repeated_field.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "surrogate/vehicle/messages.h"

// What messages.cc, motion_messages.cc and trajectory_messages.cc share. All throw
// std::invalid_argument "FIELD[INDEX]: got, expected ...".

namespace grouser::vehicle {

using Numbers = google::protobuf::RepeatedField<double>;

[[noreturn]] inline void Refuse(const std::string& field, const std::string& got,
                                const std::string& expected) {
  throw std::invalid_argument(field + ": " + got + ", expected " + expected);
}

inline std::string EntryName(const std::string& field, int i) {
  return field + "[" + std::to_string(i) + "]";
}

/// n entries, or none.
inline void CheckSize(const std::string& field, int size, int n) {
  if (size != 0 && size != n) {
    Refuse(field, std::to_string(size) + " entries", std::to_string(n) + " or none");
  }
}

inline void CheckFinite(const std::string& field, const Numbers& numbers) {
  for (int i = 0; i < numbers.size(); ++i) {
    if (!std::isfinite(numbers[i])) {
      Refuse(EntryName(field, i), std::to_string(numbers[i]), "a finite number");
    }
  }
}

inline void CheckAbove0(const std::string& field, const Numbers& numbers) {
  for (int i = 0; i < numbers.size(); ++i) {
    if (!(numbers[i] > 0) || !std::isfinite(numbers[i])) {
      Refuse(EntryName(field, i), std::to_string(numbers[i]), "a finite number above 0");
    }
  }
}

/// Entry i of an answer. Refuses one that is too short.
template <class Values>
auto Entry(const Values& values, std::size_t i) {
  if (i >= static_cast<std::size_t>(values.size())) {
    Refuse("answer", std::to_string(values.size()) + " entries", "more than " + std::to_string(i));
  }
  return values[static_cast<int>(i)];
}

inline double EntryOr0(const Numbers& numbers, int i) { return numbers.empty() ? 0.0 : numbers[i]; }

/// Soils of a message: indices into its own names, or into those of the vehicle.
class SoilTable {
 public:
  SoilTable(const std::string& at, const google::protobuf::RepeatedPtrField<std::string>& names,
            const std::vector<std::string>& soils) {
    for (int i = 0; i < names.size(); ++i) {
      table_.push_back(SoilIndexOf(EntryName(at + ".soils", i), names[i], soils));
    }
    for (std::size_t s = 0; names.empty() && s < soils.size(); ++s) {
      table_.push_back(static_cast<std::uint8_t>(s));
    }
  }

  std::uint8_t first() const { return table_.front(); }
  std::uint8_t At(const std::string& field, int i, std::uint32_t index) const {
    if (index >= table_.size()) {
      Refuse(EntryName(field, i), std::to_string(index),
             "below " + std::to_string(table_.size()) + ", the number of soils");
    }
    return table_[index];
  }

 private:
  std::vector<std::uint8_t> table_;
};

}  // namespace grouser::vehicle
