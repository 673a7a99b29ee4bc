#include "proto/records/os/descriptor_limit.h"

#include <sys/resource.h>

#include <atomic>

namespace grouser::os {
namespace {

struct rlimit former {};
std::atomic<bool> raised{false};  // `former` is set

std::size_t Raise() {
  ::getrlimit(RLIMIT_NOFILE, &former);
  const struct rlimit wanted { former.rlim_max, former.rlim_max };
  if (::setrlimit(RLIMIT_NOFILE, &wanted) != 0) return former.rlim_cur;
  raised = true;
  return wanted.rlim_cur;
}

}  // namespace

std::size_t RaiseDescriptorLimit() {
  static const std::size_t limit = Raise();
  return limit;
}

void RestoreDescriptorLimit() noexcept {
  if (raised) ::setrlimit(RLIMIT_NOFILE, &former);
}

}  // namespace grouser::os
