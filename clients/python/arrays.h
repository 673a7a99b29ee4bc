#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <mutex>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// NumPy arrays as the spans of the public headers: nothing is copied, and nothing is handed on that
// the library could not read or write.

namespace grouser::python {

namespace py = pybind11;

/// What this module itself refuses; Python sees grouser.Error, as for what the library throws.
class Refusal : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

using Shape = std::vector<py::ssize_t>;

std::string TextOf(const Shape& shape);
inline Shape With(Shape shape, std::size_t last) {
  shape.push_back(static_cast<py::ssize_t>(last));
  return shape;
}

/// Name of a span of the struct S. T: const where it is read.
template <class S, class T>
struct Field {
  using Value = T;
  const char* name;
  std::span<T> S::*member;
  mutable PyObject* key = nullptr;  ///< the name as Python's, made once and kept
};

/// object.name. Throws Refusal where there is none.
py::object ValueOf(py::handle object, const char* name, PyObject* key = nullptr);
/// Shape of object.name, which has to be an array, without its last `inner` dimensions.
Shape ShapeOf(py::handle object, const char* name, std::size_t inner = 0);

/// The arrays of one call, which it keeps until the call has ended.
class Arrays {
 public:
  Arrays() { kept_.reserve(32); }

  /// Entries of an array: C-contiguous, aligned, in the machine's byte order, of this shape,
  /// writeable unless T is const. None: no entries. Throws Refusal.
  template <class T>
  std::span<T> SpanOf(py::handle value, const std::string& name, const Shape& shape) {
    if (value.is_none()) return {};
    const py::array array =
        Checked(value, name, py::dtype::of<std::remove_const_t<T>>(), shape, !std::is_const_v<T>);
    auto* data = static_cast<T*>(const_cast<void*>(array.data()));
    return {data, static_cast<std::size_t>(array.size())};
  }
  /// fields: an array of Field<S, ...>.
  template <class S, class Fields>
  void Read(py::handle object, const Fields& fields, const Shape& shape, S* into,
            const std::string& prefix = "") {
    using T = typename std::remove_cvref_t<decltype(fields[0])>::Value;
    for (const auto& field : fields) {
      if (field.key == nullptr) field.key = PyUnicode_InternFromString(field.name);
      const py::object value = ValueOf(object, field.name, field.key);
      if (!value.is_none()) into->*field.member = SpanOf<T>(value, prefix + field.name, shape);
    }
  }

  /// Throws Refusal where one that is written overlaps another.
  void CheckOverlaps();

 private:
  struct Kept {
    py::array array;
    std::string name;
    const std::byte *begin, *end;
    bool written;
  };

  py::array Checked(py::handle value, const std::string& name, const py::dtype& dtype,
                    const Shape& shape, bool written);

  std::vector<Kept> kept_;
};

/// Calls `ask` without Python's lock; where it says false, throws what `problem` says.
template <class Ask, class Problem>
void AskOrRefuse(Ask ask, Problem problem) {
  const py::gil_scoped_release release;
  if (!ask()) throw Refusal(problem());
}
/// The same with `busy` locked, which never waits for Python's lock.
template <class Ask, class Problem>
void AskOrRefuse(std::mutex* busy, Ask ask, Problem problem) {
  const py::gil_scoped_release release;
  const std::lock_guard lock(*busy);
  if (!ask()) throw Refusal(problem());
}

/// `out`, or grouser.arrays.NAME.empty(shape, counts..., fields) where it is None.
template <class... Counts>
py::object OutOf(const py::object& out, const py::object& fields, const char* name,
                 const Shape& shape, Counts... counts) {
  if (out.is_none()) {
    const py::object container = py::module_::import("grouser.arrays").attr(name);
    return container.attr("empty")(py::tuple(py::cast(shape)), counts..., fields);
  }
  if (!fields.is_none()) throw Refusal("fields: given with out, whose arrays say what is answered");
  return out;
}

void BindModel(py::module_& m);
void BindSelector(py::module_& m);
void BindVehicle(py::module_& m);
void BindSpeedPlanner(py::module_& m);

}  // namespace grouser::python
