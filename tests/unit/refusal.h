#pragma once

#include <exception>
#include <functional>
#include <string>

namespace grouser {

/// What an exception of `what` says; empty: it throws none.
inline std::string Refusal(const std::function<void()>& what) {
  try {
    what();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace grouser
