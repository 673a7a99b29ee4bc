#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace grouser::server {

/// What a caller may do. Each role may do all that those before it may: one
/// question decides a call, and who may put a model live can always also read
/// and ask for the run that leads to it.
enum class Role {
  kNone,     ///< what needs no rights at all: health
  kRead,     ///< queries, lists, watching
  kSubmit,   ///< asking for DEM runs and withdrawing that
  kPromote,  ///< moving an alias to a candidate that passed its gate
  kAdmin,    ///< the same against the gate
};

/// "read", "submit", "promote", "admin"; "none".
const char* NameOf(Role role);
/// Of one of the four that can be given; nothing for other words.
std::optional<Role> RoleNamed(std::string_view name);

/// The role that a method needs.
struct MethodRight {
  std::string_view service, method;
  Role role;
};

/// The one table of all methods of both programs.
std::span<const MethodRight> MethodRights();

/// The role for "/SERVICE/METHOD"; nothing where the table has no such method,
/// which nobody may call then.
std::optional<Role> RoleNeeded(std::string_view path);

/// Throws std::logic_error naming the methods of a service that the table lacks.
void CheckTableCovers(const std::string& service);

}  // namespace grouser::server
