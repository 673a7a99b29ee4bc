#include "clients/replay/compare_bits.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/reflection.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace grouser::replay {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using google::protobuf::RepeatedFieldRef;

std::string Text(double value) {
  return fmt::format("{} (0x{:016x})", value, std::bit_cast<std::uint64_t>(value));
}
std::string Text(std::uint32_t value) { return fmt::format("0x{:x}", value); }

/// Arrays that an answer over LCM need not have: datagrams have no room for the first, the others
/// come only where the model knows them.
bool MayLack(const std::string& name) {
  return name.starts_with("velocity.") || name == "slip.speed_m_per_s" ||
         name.ends_with(".sd_form") || name.find(".measured_") != std::string::npos;
}

class Walk {
 public:
  Walk(const Comparison& comparison, const std::function<void(Difference)>& tell)
      : comparison_(comparison), tell_(tell) {}

  void Messages(const Message& logged, const Message& now, const std::string& name) {
    for (int i = 0; i < logged.GetDescriptor()->field_count(); ++i) {
      const FieldDescriptor& field = *logged.GetDescriptor()->field(i);
      const std::string whole = name.empty() ? field.name() : name + "." + field.name();
      const Reflection &a = *logged.GetReflection(), &b = *now.GetReflection();
      if (!field.is_repeated() && field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        Messages(a.GetMessage(logged, &field), b.GetMessage(now, &field), whole);
      } else if (field.is_repeated() && field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
        Arrays(a.GetRepeatedFieldRef<double>(logged, &field),
               b.GetRepeatedFieldRef<double>(now, &field), whole,
               std::numeric_limits<double>::quiet_NaN(), SameBits);
      } else if (field.is_repeated() && field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32) {
        Arrays(a.GetRepeatedFieldRef<std::uint32_t>(logged, &field),
               b.GetRepeatedFieldRef<std::uint32_t>(now, &field), whole, std::uint32_t{0},
               [this](std::uint32_t x, std::uint32_t y) {
                 return ((x ^ y) & ~comparison_.ignored_flags) == 0;
               });
      } else if (comparison_.whole_message) {
        Scalars(logged, now, field, whole);
      }
    }
  }

 private:
  template <class T, class Same>
  void Arrays(const RepeatedFieldRef<T>& logged, const RepeatedFieldRef<T>& now,
              const std::string& name, T absent, Same same) {
    const auto n = static_cast<int>(comparison_.states.size());
    const auto is_odd = [n](int size) { return size != 0 && size != n; };
    if (is_odd(logged.size()) || is_odd(now.size())) {
      tell_({name, -1, fmt::format("{} entries", logged.size()),
             fmt::format("{} entries", now.size())});
      return;
    }
    if (logged.empty() && (now.empty() || (comparison_.of_lcm && MayLack(name)))) return;
    for (int i = 0; i < n; ++i) {
      if (!comparison_.states[i]) continue;
      const T a = logged.empty() ? absent : logged.Get(i), b = now.empty() ? absent : now.Get(i);
      if (!same(a, b)) tell_({name, i, Text(a), Text(b)});
    }
  }

  void Scalars(const Message& logged, const Message& now, const FieldDescriptor& field,
               const std::string& name) {
    const Reflection &a = *logged.GetReflection(), &b = *now.GetReflection();
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE) {
      const double x = a.GetDouble(logged, &field), y = b.GetDouble(now, &field);
      if (!SameBits(x, y)) tell_({name, -1, Text(x), Text(y)});
    } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
      const int x = a.GetEnumValue(logged, &field), y = b.GetEnumValue(now, &field);
      if (x != y) tell_({name, -1, std::to_string(x), std::to_string(y)});
    }
  }

  const Comparison& comparison_;
  const std::function<void(Difference)>& tell_;
};

}  // namespace

bool SameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

void CompareBits(const v1alpha1::WheelResponses& logged, const v1alpha1::WheelResponses& now,
                 const Comparison& comparison, const std::function<void(Difference)>& tell) {
  Walk(comparison, tell).Messages(logged, now, "");
}

}  // namespace grouser::replay
