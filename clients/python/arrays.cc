#include "clients/python/arrays.h"

#include <algorithm>

namespace grouser::python {
namespace {

std::string TypeOf(py::handle value) {
  return py::type::of(value).attr("__name__").cast<std::string>();
}

Shape ShapeOfArray(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

}  // namespace

std::string TextOf(const Shape& shape) {
  std::string text;
  for (const py::ssize_t size : shape) text += (text.empty() ? "" : ", ") + std::to_string(size);
  return "(" + text + (shape.size() == 1 ? ",)" : ")");
}

py::object ValueOf(py::handle object, const char* name, PyObject* key) {
  PyObject* const value = key != nullptr ? PyObject_GetAttr(object.ptr(), key)
                                         : PyObject_GetAttrString(object.ptr(), name);
  if (value != nullptr) return py::reinterpret_steal<py::object>(value);
  if (PyErr_ExceptionMatches(PyExc_AttributeError) == 0) throw py::error_already_set();
  PyErr_Clear();
  throw Refusal(TypeOf(object) + " has no " + name);
}

Shape ShapeOf(py::handle object, const char* name, std::size_t inner) {
  const py::object value = ValueOf(object, name);
  if (!py::isinstance<py::array>(value)) {
    throw Refusal(std::string(name) + ": " + TypeOf(value) + ", expected a NumPy array of float64");
  }
  Shape shape = ShapeOfArray(py::reinterpret_borrow<py::array>(value));
  if (shape.size() < inner) {
    throw Refusal(std::string(name) + ": shape " + TextOf(shape) + ", expected one dimension more");
  }
  shape.resize(shape.size() - inner);
  return shape;
}

py::array Arrays::Checked(py::handle value, const std::string& name, const py::dtype& dtype,
                          const Shape& shape, bool written) {
  const auto text = [](const py::object& o) { return py::str(o).cast<std::string>(); };
  if (!py::isinstance<py::array>(value)) {
    throw Refusal(name + ": " + TypeOf(value) + ", expected a NumPy array of " + text(dtype));
  }
  const auto array = py::reinterpret_borrow<py::array>(value);
  if (!py::detail::npy_api::get().PyArray_EquivTypes_(array.dtype().ptr(), dtype.ptr())) {
    throw Refusal(name + ": dtype " + text(array.dtype()) + ", expected " + text(dtype));
  }
  const Shape own = ShapeOfArray(array);
  if (own != shape) {
    throw Refusal(name + ": shape " + TextOf(own) + ", expected " + TextOf(shape));
  }
  if ((array.flags() & py::array::c_style) == 0 ||
      (array.flags() & py::detail::npy_api::NPY_ARRAY_ALIGNED_) == 0) {
    throw Refusal(name + ": strided or not aligned, expected contiguous entries " +
                  "(numpy.ascontiguousarray makes a copy that is)");
  }
  if (written && !array.writeable())
    throw Refusal(name + ": read-only, expected a writeable array");
  const auto* begin = static_cast<const std::byte*>(array.data());
  kept_.push_back({array, name, begin, begin + array.nbytes(), written});
  return array;
}

void Arrays::CheckOverlaps() {
  std::sort(kept_.begin(), kept_.end(),
            [](const Kept& a, const Kept& b) { return a.begin < b.begin; });
  const Kept *furthest = nullptr, *furthest_written = nullptr;
  for (const Kept& k : kept_) {
    if (k.begin == k.end) continue;
    for (const Kept* other : {furthest, furthest_written}) {
      if (other == nullptr || other->end <= k.begin || !(k.written || other->written)) continue;
      throw Refusal((k.written ? k : *other).name + ": overlaps " + (k.written ? *other : k).name);
    }
    if (furthest == nullptr || k.end > furthest->end) furthest = &k;
    if (k.written && (furthest_written == nullptr || k.end > furthest_written->end)) {
      furthest_written = &k;
    }
  }
}

}  // namespace grouser::python
