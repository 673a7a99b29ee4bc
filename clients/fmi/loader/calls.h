#pragma once

#include <dlfcn.h>

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/fmi/loader/fmu.h"

// What fmi2_calls.cc and fmi3_calls.cc share.
namespace grouser::fmi {

/// A function of a library as a pointer of the type of `function`. Throws where there is none.
template <class F>
void Find(void* library, const char* name, F* function) {
  void* found = dlsym(library, name);
  if (found == nullptr)
    throw std::runtime_error(std::string(name) + ": the FMU has no such function");
  *function = reinterpret_cast<F>(found);
}

/// Instances of a library's FMU. They add what it says to `messages`, which has to outlive them.
/// Throw std::runtime_error.
std::unique_ptr<Calls> MakeCalls2(void* library, const Description& description,
                                  const std::filesystem::path& resources,
                                  std::vector<std::string>* messages);
std::unique_ptr<Calls> MakeCalls3(void* library, const Description& description,
                                  const std::filesystem::path& resources,
                                  std::vector<std::string>* messages);

}  // namespace grouser::fmi
