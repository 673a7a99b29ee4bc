// The compiled part of the package `grouser`: classes of the public headers, names of their bits.
#include <pybind11/pybind11.h>

#include <cstdint>
#include <exception>
#include <stdexcept>

#include "clients/python/arrays.h"
#include "grouser/model.h"
#include "grouser/vehicle.h"

namespace grouser::python {
namespace {

py::dict Flags() {
  using namespace py::literals;  // NOLINT(build/namespaces): the arguments' names
  return py::dict("INVALID"_a = int{kInvalid}, "CLAMPED"_a = int{kClamped},
                  "EXTRAPOLATED"_a = int{kExtrapolated}, "STATIC"_a = int{kStatic},
                  "NO_EQUILIBRIUM"_a = int{kNoEquilibrium}, "RATE"_a = int{kRate},
                  "SLOPE"_a = int{kSlope}, "VIRGIN_ASSUMED"_a = int{kVirginAssumed},
                  "FORM_UNKNOWN"_a = int{kFormUnknown}, "TOLERANCE_UNMET"_a = int{kToleranceUnmet},
                  "AIRBORNE"_a = int{kAirborne}, "UNTUNED"_a = int{kUntuned});
}

py::dict Reasons() {
  py::dict names;
  for (const Reason r :
       {kNoBalance, kOverTorque, kSinksIn, kTips, kUntrainedSpeed, kModelDomain, kBadInput}) {
    names[NamesOfReasons(r).c_str()] = static_cast<std::uint32_t>(r);
  }
  return names;
}

py::dict Bindings() {
  py::dict names;
  for (std::uint8_t b = 0; b <= static_cast<std::uint8_t>(Binding::kInput); ++b) {
    names[NameOfBinding(static_cast<Binding>(b))] = b;
  }
  return names;
}

}  // namespace
}  // namespace grouser::python

PYBIND11_MODULE(_core, m) {
  namespace py = pybind11;
  using namespace grouser::python;  // NOLINT(build/namespaces)
  m.doc() =
      "Compiled part of grouser: what grouser/model.h, model_selector.h and vehicle.h declare.";
  // Made before any class, whose messages it carries; of this module alone, as every extension of a
  // process that is built with pybind11 shares the others.
  static PyObject* const error = PyErr_NewExceptionWithDoc(
      "grouser.Error", "What the library or this package refuses, with the reason in its text.",
      PyExc_Exception, nullptr);
  if (error == nullptr) throw py::error_already_set();
  m.attr("Error") = py::handle(error);
  // As Python decodes names of files, which stand in texts and need not be UTF-8.
  static constexpr auto kRaise = [](const char* what) {
    const auto text = py::reinterpret_steal<py::object>(PyUnicode_DecodeFSDefault(what));
    if (text) PyErr_SetObject(error, text.ptr());
  };
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const py::builtin_exception&) {
      throw;  // TypeError, KeyError, ... of pybind11's own
    } catch (const std::logic_error& refused) {
      kRaise(refused.what());
    } catch (const std::runtime_error& refused) {
      kRaise(refused.what());
    }
  });
  m.attr("FLAGS") = Flags();
  m.attr("REASONS") = Reasons();
  m.attr("BINDINGS") = Bindings();
  m.attr("WORSE_BY_SD") = grouser::kWorseBySd;
  m.attr("BALANCED_RESIDUAL") = grouser::kBalancedResidual;
  BindModel(m);
  BindSelector(m);
  BindVehicle(m);
  BindSpeedPlanner(m);
}
