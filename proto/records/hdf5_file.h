#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace grouser::records::internal {

/// Owns one HDF5 identifier of any kind.
class H5Handle {
 public:
  H5Handle() = default;
  H5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  H5Handle(H5Handle&& other) noexcept;
  H5Handle& operator=(H5Handle&& other) noexcept;
  ~H5Handle();
  hid_t get() const { return id_; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

/// An HDF5 file that lives in memory (core driver without backing store): the
/// disk only ever sees finished images. Every method throws std::runtime_error
/// "PATH: what is wrong"; the HDF5 library itself prints nothing.
///
/// One object is for one thread; different threads may use different objects
/// (Debian's libhdf5 is thread-safe, and the build checks it).
class H5Image {
 public:
  /// A new, empty file. `path` is for error messages and `Save`.
  static H5Image Create(const std::string& path);
  /// Reads and opens `path`. A missing, truncated or non-HDF5 file throws.
  static H5Image Open(const std::string& path);

  /// Text attribute of the root group.
  void WriteText(const std::string& name, const std::string& value);
  void WriteNumber(const std::string& object, const std::string& name, double value);
  std::string ReadText(const std::string& name) const;
  double ReadNumber(const std::string& object, const std::string& name) const;

  void CreateGroup(const std::string& name);
  /// Datasets are checksummed (Fletcher-32). `unit` becomes an attribute.
  void WriteArray(const std::string& name, const std::vector<double>& values,
                  const std::string& unit = "");
  void WriteArray(const std::string& name, const std::vector<float>& values);
  void WriteArray(const std::string& name, const std::vector<std::int32_t>& values);
  void ReadArray(const std::string& name, std::vector<double>* values) const;
  void ReadArray(const std::string& name, std::vector<float>* values) const;
  void ReadArray(const std::string& name, std::vector<std::int32_t>* values) const;
  /// Names in a group, sorted.
  std::vector<std::string> List(const std::string& group) const;

  /// Root attributes `format` and `schema`; CheckFormat takes schemas from 1 on and returns it.
  void WriteFormat(const std::string& format, int schema);
  int CheckFormat(const std::string& format, int newest) const;

  /// Writes the image durably to `path`.
  void Save();

 private:
  explicit H5Image(std::string path);
  [[noreturn]] void Fail(const std::string& what) const;
  void Put(const std::string& name, hid_t type, const void* data, std::size_t count,
           const std::string& unit);
  H5Handle OpenArray(const std::string& name, H5T_class_t kind, std::size_t* count) const;
  void PutText(hid_t object, const std::string& name, const std::string& value);

  std::string path_;
  H5Handle file_;
};

}  // namespace grouser::records::internal
