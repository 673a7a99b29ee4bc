#include "proto/records/message_json.h"

#include <google/protobuf/util/json_util.h>

#include <stdexcept>
#include <string_view>

namespace grouser::records {

std::string ToJson(const google::protobuf::Message& message, bool indented) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  options.add_whitespace = indented;
  std::string json;
  const auto status = google::protobuf::util::MessageToJsonString(message, &json, options);
  if (!status.ok()) throw std::runtime_error(message.GetTypeName() + ": " + status.ToString());
  return json;
}

void FromJson(const std::string& json, const std::string& where, google::protobuf::Message* message,
              bool earlier) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = earlier;
  const auto status = google::protobuf::util::JsonStringToMessage(json, message, options);
  if (!status.ok()) {
    throw std::runtime_error(where + ": not a " + message->GetTypeName() +
                             " in JSON: " + status.ToString());
  }
}

std::string ShortName(const google::protobuf::EnumDescriptor& type, int value) {
  const auto* known = type.FindValueByNumber(value);
  if (known == nullptr) return std::to_string(value);
  const std::string& none = type.value(0)->name();  // ..._UNSPECIFIED
  return known->name().substr(none.size() - std::string_view("UNSPECIFIED").size());
}

}  // namespace grouser::records
