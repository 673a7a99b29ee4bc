// Snapshots as files of ParaView.
#include "dem_offline/campaign/frame_files.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "proto/records/model_file.h"

namespace grouser::campaign {
namespace {

namespace dx = dem::experiment;
static_assert(std::endian::native == std::endian::little);

/// The XML of a PolyData file, and the data that it points into.
class VtpWriter {
 public:
  explicit VtpWriter(const dx::Snapshot& s) {
    xml_ =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
        "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n";
    Array("TimeValue", "Float64", 1, std::vector<double>{s.time_s}, " NumberOfTuples=\"1\"");
    Array("box_m", "Float64", 3, std::vector<double>(s.box_m.begin(), s.box_m.end()),
          " NumberOfTuples=\"1\"");
    Array("planar", "Int32", 1, std::vector<std::int32_t>{s.planar}, " NumberOfTuples=\"1\"");
    xml_ += "</FieldData>\n";
  }
  void Piece(std::size_t points, std::size_t verts, std::size_t lines, std::size_t polygons) {
    xml_ += fmt::format(
        "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" "
        "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
        points, verts, lines, polygons);
  }
  void Open(const std::string& element) { xml_ += "<" + element + ">\n"; }
  void Close(const std::string& element) { xml_ += "</" + element + ">\n"; }
  template <class T>
  void Array(const std::string& name, const char* type, int components, const std::vector<T>& data,
             const std::string& more = "") {
    xml_ += fmt::format(
        "<DataArray Name=\"{}\" type=\"{}\" NumberOfComponents=\"{}\"{} "
        "format=\"appended\" offset=\"{}\"/>\n",
        name, type, components, more, data_.size());
    const std::uint64_t bytes = data.size() * sizeof(T);
    data_.append(reinterpret_cast<const char*>(&bytes), sizeof(bytes));
    data_.append(reinterpret_cast<const char*>(data.data()), bytes);
  }
  /// Cells of `corners` points each.
  void Cells(const char* element, const std::vector<std::int32_t>& points, int corners) {
    std::vector<std::int32_t> ends;
    for (std::size_t k = corners; k <= points.size(); k += corners) {
      ends.push_back(static_cast<std::int32_t>(k));
    }
    Open(element);
    Array("connectivity", "Int32", 1, points);
    Array("offsets", "Int32", 1, ends);
    Close(element);
  }
  std::string Text() const {
    return xml_ + "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_" + data_ +
           "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  std::string xml_, data_;
};

std::vector<float> Points(const std::vector<dem::Vec3d>& at) {
  std::vector<float> out;
  for (const dem::Vec3d& p : at) {
    for (const double v : p) out.push_back(static_cast<float>(v));
  }
  return out;
}

/// Bonds that do not go round a periodic side.
std::vector<std::int32_t> Lines(const dx::Snapshot& s) {
  std::vector<std::int32_t> out;
  for (const auto& [a, b] : s.bonds) {
    const auto& p = s.grains[a];
    const auto& q = s.grains[b];
    const double reach = 4 * (p.radius_m + q.radius_m);
    if (std::abs(p.x_m - q.x_m) < reach && std::abs(p.y_m - q.y_m) < reach) {
      out.insert(out.end(), {a, b});
    }
  }
  return out;
}

}  // namespace

std::string GrainsVtp(const dx::Snapshot& s) {
  const std::size_t n = s.grains.size();
  std::vector<dem::Vec3d> at;
  std::vector<float> radius, velocity, force;
  std::vector<std::int32_t> verts, material;
  for (std::size_t i = 0; i < n; ++i) {
    const dem::GrainState& g = s.grains[i];
    at.push_back({g.x_m, g.y_m, g.z_m});
    radius.push_back(static_cast<float>(g.radius_m));
    for (const double v : {g.v_x, g.v_y, g.v_z}) velocity.push_back(static_cast<float>(v));
    for (const float f : {s.force_n[i].x, s.force_n[i].y, s.force_n[i].z}) force.push_back(f);
    material.push_back(g.material);
    verts.push_back(static_cast<std::int32_t>(i));
  }
  const std::vector<std::int32_t> lines = Lines(s);
  VtpWriter w(s);
  w.Piece(n, n, lines.size() / 2, 0);
  w.Open("PointData");
  w.Array("radius_m", "Float32", 1, radius);
  w.Array("velocity_m_per_s", "Float32", 3, velocity);
  w.Array("force_n", "Float32", 3, force);
  w.Array("overlap_over_radius", "Float32", 1, s.overlap);
  w.Array("contacts", "Float32", 1, s.contacts);
  w.Array("material", "Int32", 1, material);
  w.Array("id", "Int32", 1, s.ids);
  w.Close("PointData");
  w.Open("Points");
  w.Array("points", "Float32", 3, Points(at));
  w.Close("Points");
  w.Cells("Verts", verts, 1);
  w.Cells("Lines", lines, 2);
  return w.Text();
}

std::string BodiesVtp(const dx::Snapshot& s) {
  std::vector<std::int32_t> corners;
  for (const auto& t : s.triangles.triangles) corners.insert(corners.end(), t.begin(), t.end());
  VtpWriter w(s);
  w.Piece(s.triangles.vertices.size(), 0, 0, s.triangles.triangles.size());
  w.Open("CellData");
  w.Array("body", "Int32", 1, s.body_of);
  w.Close("CellData");
  w.Open("Points");
  w.Array("points", "Float32", 3, Points(s.triangles.vertices));
  w.Close("Points");
  w.Cells("Polys", corners, 3);
  return w.Text();
}

std::string ContactsVtp(const dx::Snapshot& s) {
  std::vector<float> at, normal, force;
  std::vector<std::int32_t> verts, body;
  for (const dem::BodyContact& c : s.touches) {
    const auto put = [](dem::Vec3f v, std::vector<float>* out) {
      out->insert(out->end(), {v.x, v.y, v.z});
    };
    verts.push_back(static_cast<std::int32_t>(body.size()));
    body.push_back(c.body);
    put(c.point, &at), put(c.normal, &normal), put(c.force, &force);
  }
  VtpWriter w(s);
  w.Piece(body.size(), body.size(), 0, 0);
  w.Open("PointData");
  w.Array("force_n", "Float32", 3, force);
  w.Array("normal", "Float32", 3, normal);
  w.Array("body", "Int32", 1, body);
  w.Close("PointData");
  w.Open("Points");
  w.Array("points", "Float32", 3, at);
  w.Close("Points");
  w.Cells("Verts", verts, 1);
  return w.Text();
}

void FrameFiles::Write(const dx::Snapshot& s) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw std::system_error(error, folder_);
  const std::size_t n = times_.size();
  records::WriteFileDurably(fmt::format("{}/grains_{:06}.vtp", folder_, n), GrainsVtp(s));
  records::WriteFileDurably(fmt::format("{}/bodies_{:06}.vtp", folder_, n), BodiesVtp(s));
  records::WriteFileDurably(fmt::format("{}/contacts_{:06}.vtp", folder_, n), ContactsVtp(s));
  if (n == 0) {
    std::string names = "body,name\n";
    for (std::size_t b = 0; b < s.bodies.size(); ++b)
      names += fmt::format("{},{}\n", b, s.bodies[b]);
    records::WriteFileDurably(folder_ + "/bodies.csv", names);
  }
  times_.push_back(s.time_s);
  std::string pvd =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (std::size_t k = 0; k < times_.size(); ++k) {
    for (const auto& [part, name] :
         {std::pair(0, "grains"), std::pair(1, "bodies"), std::pair(2, "contacts")}) {
      pvd += fmt::format(
          "<DataSet timestep=\"{:.9g}\" part=\"{}\" name=\"{}\" "
          "file=\"{}_{:06}.vtp\"/>\n",
          times_[k], part, name, name, k);
    }
  }
  records::WriteFileDurably(folder_ + "/frames.pvd", pvd + "</Collection>\n</VTKFile>\n");
}

}  // namespace grouser::campaign
