// STL (binary, ASCII) and Wavefront OBJ, from any bytes.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string_view>

#include "dem_offline/engine/bodies/mesh.h"
#include "dem_offline/engine/bodies/vertex_merge.h"

namespace grouser::dem {
namespace {

using Point = std::array<double, 3>;

constexpr std::size_t kStlHead = 84, kStlFace = 50;  // bytes
constexpr std::size_t kMostVertices = 300'000'000;   // numbers stay within int32

/// Where in which source something is wrong.
struct Source {
  const std::string& name;
  [[noreturn]] void Refuse(const std::string& where, const std::string& got,
                           const std::string& expected) const {
    throw std::invalid_argument(name + ": " + where + ": got " + got + ", expected " + expected);
  }
};

std::string Quoted(std::string_view word) {  // foreign text: short and printable
  std::string text = "'";
  for (const char c : word.substr(0, 40)) text += c >= 32 && c < 127 ? c : '?';
  return text + (word.size() > 40 ? "...'" : "'");
}

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

template <typename Number>
bool Parse(std::string_view word, Number* value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), *value);
  return error == std::errc() && stop == word.data() + word.size();
}

/// Words of a text, line by line.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  bool NextLine() {  // false at the end
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    rest_ = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    return true;
  }
  std::string_view Next() {  // of this line; empty at its end
    std::size_t i = 0;
    while (i < rest_.size() && IsSpace(rest_[i])) ++i;
    std::size_t j = i;
    while (j < rest_.size() && !IsSpace(rest_[j])) ++j;
    const std::string_view word = rest_.substr(i, j - i);
    rest_.remove_prefix(j);
    return word;
  }
  std::string Line() const { return "line " + std::to_string(number_); }

 private:
  std::string_view text_, rest_;
  std::size_t at_ = 0, number_ = 0;
};

Point ReadPoint(Words* words, const Source& source) {
  Point p;
  for (double& x : p) {
    const std::string_view word = words->Next();
    if (!Parse(word, &x) || !std::isfinite(x)) {
      source.Refuse(words->Line(), word.empty() ? "nothing" : Quoted(word), "a finite coordinate");
    }
  }
  return p;
}

TriangleSoup ReadBinaryStl(const std::string& bytes, const Source& source) {
  const std::size_t faces = (bytes.size() - kStlHead) / kStlFace;
  if (3 * faces > kMostVertices) source.Refuse("size", "over 1e8 faces", "a smaller mesh");
  TriangleSoup soup;
  soup.vertices.reserve(3 * faces);
  for (std::size_t f = 0; f < faces; ++f) {
    const char* face = bytes.data() + kStlHead + f * kStlFace + 12;  // after the normal
    for (int k = 0; k < 9; ++k) {
      unsigned char b[4];
      std::memcpy(b, face + 4 * k, 4);  // little endian, whatever this machine is
      const std::uint32_t bits = b[0] | b[1] << 8 | b[2] << 16 | std::uint32_t{b[3]} << 24;
      float x;
      std::memcpy(&x, &bits, 4);
      if (!std::isfinite(x)) {
        source.Refuse("face " + std::to_string(f), "a coordinate that is not finite",
                      "finite coordinates");
      }
      if (k % 3 == 0) soup.vertices.emplace_back();
      soup.vertices.back()[k % 3] = x;
    }
    const auto v = static_cast<std::int32_t>(3 * f);
    soup.triangles.push_back({v, v + 1, v + 2});
  }
  return soup;
}

/// Everything but the vertices is decoration; facets must hold three of them.
TriangleSoup ReadAsciiStl(std::string_view text, const Source& source) {
  TriangleSoup soup;
  Words words(text);
  int corners = -1;  // of the open facet; -1: none is open
  while (words.NextLine()) {
    const std::string_view word = words.Next();
    if (word == "facet") {
      if (corners >= 0) source.Refuse(words.Line(), "'facet'", "the end of the facet before");
      corners = 0;
    } else if (word == "vertex") {
      if (corners < 0 || corners == 3) {
        source.Refuse(words.Line(), "'vertex'", "three of them in each facet");
      }
      soup.vertices.push_back(ReadPoint(&words, source));
      ++corners;
    } else if (word == "endfacet") {
      if (corners != 3) source.Refuse(words.Line(), "'endfacet'", "three vertices before it");
      if (soup.vertices.size() > kMostVertices)
        source.Refuse(words.Line(), "over 1e8 faces", "less");
      const auto v = static_cast<std::int32_t>(soup.vertices.size());
      soup.triangles.push_back({v - 3, v - 2, v - 1});
      corners = -1;
    } else if (!word.empty() && word != "solid" && word != "outer" && word != "endloop" &&
               word != "endsolid") {
      source.Refuse(words.Line(), Quoted(word), "a word of ASCII STL");
    }
  }
  if (corners >= 0) source.Refuse(words.Line(), "the end of the file", "'endfacet'");
  return soup;
}

/// "7", "7/1", "7//3", "-2": the vertex's number from 0. Negative ones count
/// back from the last vertex so far.
std::int32_t ReadCorner(std::string_view word, std::size_t vertices, const Words& words,
                        const Source& source) {
  std::int64_t number = 0;
  if (!Parse(word.substr(0, word.find('/')), &number)) {
    source.Refuse(words.Line(), Quoted(word), "the number of a vertex");
  }
  const auto count = static_cast<std::int64_t>(vertices);
  if (number == 0 || number > count || number < -count) {
    source.Refuse(words.Line(), "vertex " + std::to_string(number),
                  "one of the " + std::to_string(count) + " above, counted from 1");
  }
  return static_cast<std::int32_t>(number > 0 ? number - 1 : count + number);
}

TriangleSoup ReadObj(std::string_view text, const Source& source) {
  TriangleSoup soup;
  Words words(text);
  while (words.NextLine()) {
    const std::string_view kind = words.Next();
    if (kind == "v") {
      soup.vertices.push_back(ReadPoint(&words, source));
      if (soup.vertices.size() > kMostVertices) {
        source.Refuse(words.Line(), "over 3e8 vertices", "less");
      }
    } else if (kind == "f") {
      std::int32_t corner[3];
      int corners = 0;
      for (auto word = words.Next(); !word.empty() && word[0] != '#'; word = words.Next()) {
        const std::int32_t v = ReadCorner(word, soup.vertices.size(), words, source);
        if (corners < 3) {
          corner[corners++] = v;
        } else {
          corner[1] = corner[2];
          corner[2] = v;
        }
        if (corners == 3) soup.triangles.push_back({corner[0], corner[1], corner[2]});
      }
      if (corners < 3) {
        source.Refuse(words.Line(), "a face of " + std::to_string(corners) + " vertices",
                      "at least 3");
      }
    }
  }
  return soup;
}

bool StartsWith(std::string_view text, std::string_view word) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text.substr(first, word.size()) == word;
}

}  // namespace

TriangleSoup ReadMesh(const std::string& bytes, const std::string& source_name) {
  const Source source{source_name};
  const auto byte = [&](std::size_t i) {
    return static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[i]));
  };
  // Some binary files begin with "solid" too: their size tells them first.
  std::uint64_t faces = 0;
  if (bytes.size() >= kStlHead) {
    faces = byte(80) | byte(81) << 8 | byte(82) << 16 | byte(83) << 24;
  }
  const bool text = bytes.find('\0') == std::string::npos;
  TriangleSoup soup;
  if (bytes.size() >= kStlHead && bytes.size() == kStlHead + kStlFace * faces) {
    soup = ReadBinaryStl(bytes, source);
  } else if (text && StartsWith(bytes, "solid")) {
    soup = ReadAsciiStl(bytes, source);
  } else if (text) {
    soup = ReadObj(bytes, source);
  } else {
    source.Refuse("size", std::to_string(bytes.size()) + " bytes",
                  "text (ASCII STL, OBJ), or a binary STL of 84 + 50 x " + std::to_string(faces) +
                      " bytes for the number of faces in its header");
  }
  if (soup.triangles.empty()) source.Refuse("faces", "none", "an STL or OBJ file with triangles");
  MergeVertices(&soup, source_name);
  return soup;
}

}  // namespace grouser::dem
