// Mesh files: what is read, and how the rest is refused.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "tests/unit/engine/bodies_testing.h"

namespace grouser::dem {
namespace {

std::string BinaryStl(const TriangleSoup& s, const std::string& head = "binary") {
  std::string bytes = head;
  bytes.resize(80, ' ');
  const auto put = [&bytes](const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  const auto count = static_cast<std::uint32_t>(s.triangles.size());
  put(&count, 4);
  for (const auto& t : s.triangles) {
    float numbers[12] = {};
    for (int k = 0; k < 9; ++k) numbers[3 + k] = static_cast<float>(s.vertices[t[k / 3]][k % 3]);
    put(numbers, 48);
    put("\0\0", 2);
  }
  return bytes;
}

std::string AsciiStl(const TriangleSoup& s) {
  std::string text = "solid box\n";
  for (const auto& t : s.triangles) {
    text += " facet normal 0 0 0\r\n  outer loop\n";
    for (const std::int32_t v : t) {
      text += "    vertex";
      for (const double x : s.vertices[v]) text += " " + std::to_string(x);
      text += "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid box\n";
}

std::string Obj(const TriangleSoup& s) {
  std::string text = "# a box\nmtllib none.mtl\no box\n";
  for (const auto& v : s.vertices) {
    text += "v " + std::to_string(v[0]) + " +" + std::to_string(v[1] + 5) + "\t" +
            std::to_string(v[2]) + "\r\n";
  }
  for (const auto& t : s.triangles) {
    text += "f " + std::to_string(t[0] + 1) + "/1/1 " + std::to_string(t[1] + 1) + "//2 " +
            std::to_string(t[2] - static_cast<int>(s.vertices.size())) + "\n";
  }
  return text;
}

TEST(ReadMesh, AllFormsOfABoxAreOneBox) {
  const TriangleSoup box = BoxSoup(0.25, 0.5, 0.125);
  for (const std::string& bytes :
       {BinaryStl(box), BinaryStl(box, "solid, says this binary file"), AsciiStl(box), Obj(box)}) {
    const TriangleSoup got = ReadMesh(bytes, "box");
    EXPECT_EQ(got.vertices.size(), 8u);  // merged
    EXPECT_EQ(got.triangles.size(), 12u);
    EXPECT_NEAR(Volume(got), 8 * 0.25 * 0.5 * 0.125, 1e-12);
    const Mesh mesh(got);
    EXPECT_TRUE(mesh.closed());
    EXPECT_EQ(mesh.surfaces(), 6);
  }
}

TEST(ReadMesh, PolygonsAreFanned) {
  const TriangleSoup got =
      ReadMesh("v 0 0 0\nv 1 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5 # five\n", "x.obj");
  ASSERT_EQ(got.triangles.size(), 3u);
  EXPECT_EQ(got.triangles[2], (std::array<std::int32_t, 3>{0, 3, 4}));
}

TEST(ReadMesh, MergesWhatIsNearerThanOneInABillion) {
  const auto vertices = [](const char* x) {
    return ReadMesh(std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nv ") + x +
                        " 0 0\nv 0 -1 0\nf 1 2 3\nf 1 5 4\n",
                    "x.obj")
        .vertices.size();
  };
  EXPECT_EQ(vertices("1.0000000005"), 4u);
  EXPECT_EQ(vertices("0.9999999995"), 4u);
  EXPECT_EQ(vertices("1.000000005"), 5u);
  // The same against every pair: random clouds with near copies.
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1), tiny(-5e-10, 5e-10);
  std::string text;
  for (int i = 0; i < 500; ++i) {
    const double p[3] = {unit(random), unit(random), unit(random)};
    for (int copy = 0; copy < 2; ++copy) {
      text += "v";
      for (const double x : p) {
        char word[40];
        std::snprintf(word, sizeof word, " %.17g", x + copy * tiny(random));
        text += word;
      }
      text += "\n";
    }
  }
  EXPECT_EQ(ReadMesh(text + "f 1 3 5\n", "x.obj").vertices.size(), 500u);
}

std::string ErrorOf(const std::string& bytes) {
  try {
    ReadMesh(bytes, "file.stl");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(ReadMesh, RefusesByLineOrFace) {
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.rfind("file.stl: ", 0), 0u) << text;
  };
  has(ErrorOf(""), "none");
  has(ErrorOf("hello\n"), "none");
  has(ErrorOf("v 0 0 0\nv 1 x 0\n"), "line 2: got 'x'");
  has(ErrorOf("v 0 0 0\nv 1 0\n"), "line 2: got nothing");
  has(ErrorOf("v 0 0 nan\n"), "line 1: got 'nan'");
  has(ErrorOf("v 0 0 1e999\n"), "line 1");
  has(ErrorOf("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), "line 4: got vertex 4");
  has(ErrorOf("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n"), "vertex 0");
  has(ErrorOf("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n"), "vertex -4");
  has(ErrorOf("v 0 0 0\nv 1 0 0\nf 1 2\n"), "a face of 2 vertices");
  has(ErrorOf("v 0 0 0\nf 99999999999999999999 1 1\n"), "number of a vertex");
  has(ErrorOf("v 1e200 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "over 1e100");
  has(ErrorOf("solid\nvertex 0 0 0\n"), "line 2");
  has(ErrorOf("solid\nfacet normal 0 0 0\nvertex 0 0 0\nendfacet\n"), "line 4");
  has(ErrorOf("solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"), "end of the file");
  has(ErrorOf("solid\nwhat\n"), "'what'");
  std::string stl = BinaryStl(BoxSoup(1, 1, 1));
  has(ErrorOf(stl.substr(0, stl.size() - 1)), "84 + 50 x 12");
  has(ErrorOf(stl + "x"), "84 + 50 x 12");
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(stl.data() + 84 + 3 * 50 + 12 + 8, &nan, 4);
  has(ErrorOf(stl), "face 3");
}

TEST(ReadMesh, FlatTrianglesPassToTheMeshThatNamesThem) {
  TriangleSoup box = BoxSoup(1, 1, 1);
  box.triangles[4][2] = box.triangles[4][1];
  const TriangleSoup got = ReadMesh(BinaryStl(box), "box.stl");
  try {
    Mesh mesh(got);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("face 4 is degenerate"), std::string::npos);
  }
}

/// Every file with one byte changed, and every beginning of a file, is read or
/// refused; nothing else happens. (tests/fuzz goes much further.)
TEST(ReadMesh, SurvivesChangedBytes) {
  std::mt19937 random(2);
  int read = 0, refused = 0;
  for (const std::string& good :
       {BinaryStl(BoxSoup(1, 2, 3)), AsciiStl(BoxSoup(1, 2, 3)), Obj(BoxSoup(1, 2, 3))}) {
    for (int k = 0; k < 1500; ++k) {
      std::string bytes = good;
      if (k % 3 == 0) bytes.resize(random() % bytes.size());
      if (!bytes.empty()) bytes[random() % bytes.size()] = static_cast<char>(random());
      try {
        const Mesh mesh(ReadMesh(bytes, "x"));
        SurfacePoint out[kMostSurfacePoints];
        mesh.Nearest({0.9f, 1.9f, 2.9f}, 0.5f, out, kMostSurfacePoints);
        ++read;
      } catch (const std::invalid_argument&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(read, 100);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace grouser::dem
