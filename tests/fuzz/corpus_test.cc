// What the fuzz target of this program has found and its examples, whole, cut off and with
// changed bytes (from a fixed seed): each input is read or refused, under g++ and its sanitizers.
// The search for new inputs needs clang: fuzz_NAME, with ./grouser test --full.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "gtest/gtest.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLongest = 4096;  // as the fuzzers' -max_len
constexpr int kChanged = 40;            // of each file

void Take(const std::string& bytes) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

std::string Changed(std::string bytes, std::mt19937* random) {
  const auto below = [&](std::size_t n) { return (*random)() % n; };
  for (std::size_t k = 0; k <= below(4); ++k) {
    const std::size_t at = below(bytes.size());
    switch (below(4)) {
      case 0:
        bytes[at] = static_cast<char>(below(256));
        break;
      case 1:
        bytes[at] = "0-9.:{[]}\n"[below(10)];
        break;
      case 2:
        bytes.erase(at, 1 + below(8));
        break;
      default:
        bytes.insert(at, bytes.substr(below(bytes.size()), 1 + below(8)));
    }
    if (bytes.empty()) break;
  }
  return bytes;
}

TEST(Corpus, IsReadOrRefused) {
  std::mt19937 random(1);
  std::size_t files = 0;
  for (const char* folder : {GROUSER_CORPUS}) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      std::fprintf(stderr, "%s\n",
                   entry.path().c_str());  // the last one, where it ends the program
      std::ifstream file(entry.path(), std::ios::binary);
      std::string bytes(std::istreambuf_iterator<char>(file), {});
      ++files;
      Take(bytes);
      bytes.resize(std::min(bytes.size(), kLongest));
      for (int k = 0; k < kChanged && !bytes.empty(); ++k) {
        Take(bytes.substr(0, bytes.size() * k / kChanged));
        Take(Changed(bytes, &random));
      }
    }
  }
  EXPECT_GT(files, 1u);
}

}  // namespace
