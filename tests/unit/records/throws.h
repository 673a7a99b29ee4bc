#pragma once

#include <gmock/gmock.h>

#include <exception>
#include <string>

namespace grouser {

/// The message of the exception that `action` throws; empty when it throws none.
template <typename Action>
std::string MessageOf(Action action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

}  // namespace grouser
