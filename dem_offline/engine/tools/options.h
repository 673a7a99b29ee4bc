#pragma once

#include <charconv>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

// Command lines of the engine's own programs, which stand without libraries.

namespace grouser::dem {

/// Options of a program, and where each puts its value (text or a number). Throws
/// std::invalid_argument for an unknown option and for a value that is missing or none.
class Options {
 public:
  void Flag(const std::string& name, bool* set) {
    all_[name] = {false, [set](const std::string&) { *set = true; }};
  }
  template <class T>
  void Value(const std::string& name, T* to) {
    all_[name] = {true, [name, to](const std::string& text) { *to = Read<T>(name, text); }};
  }
  void Parse(int argc, char** argv, int first = 1) const {
    for (int i = first; i < argc; ++i) {
      const std::string name = argv[i];
      const auto found = all_.find(name);
      if (found == all_.end()) throw std::invalid_argument(name + ": unknown");
      if (found->second.valued && i + 1 == argc) {
        throw std::invalid_argument(name + ": expected a value");
      }
      found->second.take(found->second.valued ? argv[++i] : "");
    }
  }

 private:
  struct Option {
    bool valued;
    std::function<void(const std::string&)> take;
  };

  template <class T>
  static T Read(const std::string& name, const std::string& text) {
    if constexpr (std::is_same_v<T, std::string>) {
      return text;
    } else {
      T value{};
      const char* const end = text.data() + text.size();
      const auto [stop, error] = std::from_chars(text.data(), end, value);
      if (error == std::errc() && stop == end) return value;
      throw std::invalid_argument(name + ": " + text + ", expected a number");
    }
  }

  std::map<std::string, Option> all_;
};

/// Runs a program: --help anywhere prints the usage. Exit status 2 for bad usage (by
/// std::invalid_argument), 1 for other exceptions.
inline int RunProgram(const char* name, const char* usage, int argc, char** argv,
                      int (*program)(int, char**)) {
  try {
    for (int i = 1; i < argc; ++i) {
      if (std::string(argv[i]) == "--help") return std::fputs(usage, stdout) < 0;
    }
    return program(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "%s: %s\n%s", name, error.what(), usage);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace grouser::dem
