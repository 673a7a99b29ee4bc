#include "server/net/descriptor_limit.h"

#include <pthread.h>
#include <sys/resource.h>

namespace grouser::server {
namespace {

struct rlimit former {};  // read by children, which share no other state

void RestoreInChild() { ::setrlimit(RLIMIT_NOFILE, &former); }

std::size_t Raise() {
  ::getrlimit(RLIMIT_NOFILE, &former);
  struct rlimit raised = former;
  raised.rlim_cur = raised.rlim_max;
  if (::setrlimit(RLIMIT_NOFILE, &raised) != 0) return former.rlim_cur;
  ::pthread_atfork(nullptr, nullptr, RestoreInChild);
  return raised.rlim_cur;
}

}  // namespace

std::size_t RaiseDescriptorLimit() {
  static const std::size_t limit = Raise();
  return limit;
}

}  // namespace grouser::server
