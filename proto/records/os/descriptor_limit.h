#pragma once

#include <cstddef>

namespace grouser::os {

/// Raises the soft limit of open descriptors to the hard one and returns it.
std::size_t RaiseDescriptorLimit();

/// Sets the soft limit that was there before, where it was raised: for a child
/// between fork and exec, since programs that call select() or loop over all
/// descriptors are not made for a high one. Async-signal-safe.
void RestoreDescriptorLimit() noexcept;

}  // namespace grouser::os
