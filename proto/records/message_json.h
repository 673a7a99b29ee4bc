#pragma once

#include <google/protobuf/generated_enum_reflection.h>
#include <google/protobuf/message.h>

#include <string>

namespace grouser::records {

/// A message as JSON: field names as in the .proto file, all primitive fields,
/// NaN as "NaN". `indented`: over several lines. Throws std::runtime_error (a
/// text that is not UTF-8).
std::string ToJson(const google::protobuf::Message& message, bool indented = false);

/// Reads what ToJson writes. `where` names the source in the error:
/// std::runtime_error "WHERE: not a TYPE in JSON: cause". Unknown keys are errors
/// unless `earlier`: files of earlier versions hold fields that are gone.
void FromJson(const std::string& json, const std::string& where, google::protobuf::Message* message,
              bool earlier = false);

/// "RUNNING" of JOB_STATE_RUNNING: an enumerator without the name of its enum, for people;
/// the number of one that is not known.
std::string ShortName(const google::protobuf::EnumDescriptor& type, int value);
template <class Enum>
std::string ShortName(Enum value) {
  return ShortName(*google::protobuf::GetEnumDescriptor<Enum>(), value);
}

}  // namespace grouser::records
