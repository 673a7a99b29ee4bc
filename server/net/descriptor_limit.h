#pragma once

#include <cstddef>

namespace grouser::server {

/// Raises the soft limit of open descriptors to the hard one and returns it;
/// children made by fork() from then on get the former soft limit back,
/// for programs that call select() or loop over all descriptors.
std::size_t RaiseDescriptorLimit();

}  // namespace grouser::server
