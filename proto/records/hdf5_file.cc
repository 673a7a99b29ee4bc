#include "proto/records/hdf5_file.h"

#include <unistd.h>

#include <stdexcept>
#include <utility>

#include "proto/records/durable_file.h"
#include "proto/records/model_file.h"

#ifndef H5_HAVE_THREADSAFE
#error "Campaigns write run files from several threads: a thread-safe libhdf5 is needed"
#endif

namespace grouser::records::internal {
namespace {

constexpr std::size_t kImageIncrement = 1 << 20;

H5Handle CoreAccess() {
  H5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access.get(), kImageIncrement, /*backing_store=*/0);
  return access;
}

// The error stack is per thread in a thread-safe library: silence it wherever
// a file is created or opened. Errors become exceptions instead.
void Silence() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

// The core driver takes images of one name for one file, so that two threads
// on one path would meet: the name is made the thread's own.
std::string ImageName(const std::string& path) { return path + "#" + std::to_string(gettid()); }

H5Handle TextType() {
  H5Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

herr_t CollectName(hid_t, const char* name, const H5L_info_t*, void* names) {
  static_cast<std::vector<std::string>*>(names)->push_back(name);
  return 0;
}

}  // namespace

H5Handle::H5Handle(H5Handle&& other) noexcept
    : id_(std::exchange(other.id_, -1)), close_(other.close_) {}

H5Handle& H5Handle::operator=(H5Handle&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(close_, other.close_);
  return *this;
}

H5Handle::~H5Handle() {
  if (id_ >= 0 && close_ != nullptr) close_(id_);
}

H5Image::H5Image(std::string path) : path_(std::move(path)) { Silence(); }

void H5Image::Fail(const std::string& what) const { throw std::runtime_error(path_ + ": " + what); }

H5Image H5Image::Create(const std::string& path) {
  H5Image image(path);
  const H5Handle access = CoreAccess();
  image.file_ = H5Handle(
      H5Fcreate(ImageName(path).c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access.get()), H5Fclose);
  if (image.file_.get() < 0) image.Fail("cannot create an HDF5 image in memory");
  return image;
}

H5Image H5Image::Open(const std::string& path) {
  H5Image image(path);
  std::string bytes = ReadFileBytes(path);
  static constexpr char kSignature[] = "\x89HDF\r\n\x1a\n";
  if (bytes.compare(0, 8, kSignature) != 0) image.Fail("not an HDF5 file (wrong signature)");
  const H5Handle access = CoreAccess();
  if (H5Pset_file_image(access.get(), bytes.data(), bytes.size()) < 0) {
    image.Fail("HDF5 refuses the file image");
  }
  image.file_ = H5Handle(H5Fopen(ImageName(path).c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (image.file_.get() < 0) image.Fail("truncated or damaged HDF5 file");
  return image;
}

void H5Image::PutText(hid_t object, const std::string& name, const std::string& value) {
  const H5Handle type = TextType();
  const H5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const H5Handle attribute(
      H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  const char* text = value.c_str();
  if (attribute.get() < 0 || H5Awrite(attribute.get(), type.get(), &text) < 0) {
    Fail("cannot write HDF5 attribute '" + name + "'");
  }
}

void H5Image::WriteText(const std::string& name, const std::string& value) {
  PutText(file_.get(), name, value);
}

void H5Image::WriteNumber(const std::string& object, const std::string& name, double value) {
  const H5Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const H5Handle attribute(
      H5Acreate_by_name(file_.get(), object.c_str(), name.c_str(), H5T_IEEE_F64LE, space.get(),
                        H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  if (attribute.get() < 0 || H5Awrite(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    Fail("cannot write HDF5 attribute '" + name + "'");
  }
}

std::string H5Image::ReadText(const std::string& name) const {
  const H5Handle attribute(H5Aopen(file_.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (attribute.get() < 0) Fail("no attribute '" + name + "'");
  const H5Handle stored(H5Aget_type(attribute.get()), H5Tclose);
  const H5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  if (H5Tis_variable_str(stored.get()) <= 0 || H5Sget_simple_extent_npoints(space.get()) != 1) {
    Fail("attribute '" + name + "' is not a text");
  }
  const H5Handle type = TextType();
  char* text = nullptr;
  if (H5Aread(attribute.get(), type.get(), &text) < 0 || text == nullptr) {
    Fail("cannot read attribute '" + name + "'");
  }
  std::string value(text);
  H5free_memory(text);
  return value;
}

double H5Image::ReadNumber(const std::string& object, const std::string& name) const {
  const H5Handle attribute(
      H5Aopen_by_name(file_.get(), object.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  if (attribute.get() < 0) Fail("no attribute '" + name + "' at " + object);
  const H5Handle space(H5Aget_space(attribute.get()), H5Sclose);
  double value = 0;
  if (H5Sget_simple_extent_npoints(space.get()) != 1 ||
      H5Aread(attribute.get(), H5T_NATIVE_DOUBLE, &value) < 0) {
    Fail("attribute '" + name + "' at " + object + " is not a number");
  }
  return value;
}

void H5Image::CreateGroup(const std::string& name) {
  const H5Handle group(H5Gcreate2(file_.get(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Gclose);
  if (group.get() < 0) Fail("cannot create HDF5 group " + name);
}

void H5Image::Put(const std::string& name, hid_t type, const void* data, std::size_t count,
                  const std::string& unit) {
  const hsize_t size = count;
  const H5Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  const H5Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(layout.get(), 0);  // equal contents give equal bytes
  if (count > 0) {
    H5Pset_chunk(layout.get(), 1, &size);
    H5Pset_fletcher32(layout.get());
  }
  const H5Handle dataset(H5Dcreate2(file_.get(), name.c_str(), type, space.get(), H5P_DEFAULT,
                                    layout.get(), H5P_DEFAULT),
                         H5Dclose);
  if (dataset.get() < 0 ||
      (count > 0 && H5Dwrite(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)) {
    Fail("cannot write HDF5 dataset " + name);
  }
  if (!unit.empty()) PutText(dataset.get(), "unit", unit);
}

void H5Image::WriteArray(const std::string& name, const std::vector<double>& values,
                         const std::string& unit) {
  Put(name, H5T_NATIVE_DOUBLE, values.data(), values.size(), unit);
}
void H5Image::WriteArray(const std::string& name, const std::vector<float>& values) {
  Put(name, H5T_NATIVE_FLOAT, values.data(), values.size(), "");
}
void H5Image::WriteArray(const std::string& name, const std::vector<std::int32_t>& values) {
  Put(name, H5T_NATIVE_INT32, values.data(), values.size(), "");
}

H5Handle H5Image::OpenArray(const std::string& name, H5T_class_t kind, std::size_t* count) const {
  H5Handle dataset(H5Dopen2(file_.get(), name.c_str(), H5P_DEFAULT), H5Dclose);
  if (dataset.get() < 0) Fail("no dataset " + name);
  const H5Handle type(H5Dget_type(dataset.get()), H5Tclose);
  const H5Handle space(H5Dget_space(dataset.get()), H5Sclose);
  if (H5Tget_class(type.get()) != kind || H5Sget_simple_extent_ndims(space.get()) != 1) {
    Fail("dataset " + name + " has the wrong type or shape");
  }
  const hssize_t size = H5Sget_simple_extent_npoints(space.get());
  // A damaged header must not make us allocate without bound: what is stored
  // unfiltered cannot be larger than the storage that the file holds for it.
  const hsize_t stored = H5Dget_storage_size(dataset.get());
  if (size < 0 || static_cast<hsize_t>(size) * H5Tget_size(type.get()) > stored) {
    Fail("dataset " + name + " is incomplete");
  }
  *count = static_cast<std::size_t>(size);
  return dataset;
}

namespace {

herr_t ReadAll(const H5Handle& dataset, hid_t type, std::size_t count, void* data) {
  return count == 0 ? 0 : H5Dread(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
}

}  // namespace

void H5Image::ReadArray(const std::string& name, std::vector<double>* values) const {
  std::size_t count = 0;
  const H5Handle dataset = OpenArray(name, H5T_FLOAT, &count);
  values->resize(count);
  if (ReadAll(dataset, H5T_NATIVE_DOUBLE, count, values->data()) < 0) {
    Fail("cannot read dataset " + name + " (damaged file?)");
  }
}

void H5Image::ReadArray(const std::string& name, std::vector<float>* values) const {
  std::size_t count = 0;
  const H5Handle dataset = OpenArray(name, H5T_FLOAT, &count);
  values->resize(count);
  if (ReadAll(dataset, H5T_NATIVE_FLOAT, count, values->data()) < 0) {
    Fail("cannot read dataset " + name + " (damaged file?)");
  }
}

void H5Image::ReadArray(const std::string& name, std::vector<std::int32_t>* values) const {
  std::size_t count = 0;
  const H5Handle dataset = OpenArray(name, H5T_INTEGER, &count);
  values->resize(count);
  if (ReadAll(dataset, H5T_NATIVE_INT32, count, values->data()) < 0) {
    Fail("cannot read dataset " + name + " (damaged file?)");
  }
}

std::vector<std::string> H5Image::List(const std::string& group) const {
  std::vector<std::string> names;
  const H5Handle handle(H5Gopen2(file_.get(), group.c_str(), H5P_DEFAULT), H5Gclose);
  if (handle.get() < 0) Fail("no group " + group);
  if (H5Literate(handle.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, CollectName, &names) < 0) {
    Fail("cannot list group " + group);
  }
  return names;
}

void H5Image::WriteFormat(const std::string& format, int schema) {
  WriteText("format", format);
  WriteNumber("/", "schema", schema);
}

int H5Image::CheckFormat(const std::string& format, int newest) const {
  if (H5Aexists(file_.get(), "format") <= 0) {
    Fail("foreign HDF5 file: no root attribute 'format', expected '" + format + "'");
  }
  const std::string found = ReadText("format");
  if (found != format) Fail("holds '" + found + "', expected '" + format + "'");
  const double found_schema = ReadNumber("/", "schema");
  const int schema =
      found_schema >= 1 && found_schema <= newest ? static_cast<int>(found_schema) : 0;
  if (schema != found_schema || schema == 0) {
    Fail("has schema " + std::to_string(found_schema) + ", expected 1 to " +
         std::to_string(newest));
  }
  return schema;
}

void H5Image::Save() {
  if (H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) < 0) Fail("cannot finish the HDF5 image");
  const ssize_t size = H5Fget_file_image(file_.get(), nullptr, 0);
  if (size <= 0) Fail("cannot size the HDF5 image");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  if (H5Fget_file_image(file_.get(), bytes.data(), bytes.size()) != size) {
    Fail("cannot take the HDF5 image");
  }
  WriteFileDurably(path_, bytes);
}

}  // namespace grouser::records::internal
