// grouser/vehicle.h in Python: the vehicle, and its solver.
#include "grouser/vehicle.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "clients/python/arrays.h"

namespace grouser::python {
namespace {

const Field<Motions, const double> kMotionFields[] = {
    {"steering", &Motions::steering},
    {"acceleration", &Motions::acceleration},
    {"yaw_acceleration", &Motions::yaw_acceleration},
    {"grade", &Motions::grade},
    {"bank", &Motions::bank},
    {"worse_by_sd", &Motions::worse_by_sd}};
const Field<Motions, const double> kTwistFields[] = {{"v_x", &Motions::v_x},
                                                     {"yaw_rate", &Motions::yaw_rate}};
const Field<Solutions, double> kSolutionFields[] = {
    {"residual", &Solutions::residual},
    {"v_x", &Solutions::v_x},
    {"v_y", &Solutions::v_y},
    {"yaw_rate", &Solutions::yaw_rate},
    {"side_slip", &Solutions::side_slip},
    {"steering", &Solutions::steering},
    {"pitching_moment", &Solutions::pitching_moment},
    {"f_x", &Solutions::f_x},
    {"f_y", &Solutions::f_y},
    {"m_z", &Solutions::m_z},
    {"shaft_power", &Solutions::shaft_power},
    {"electric_power", &Solutions::electric_power},
    {"tip_margin", &Solutions::tip_margin},
    {"torque_margin", &Solutions::torque_margin},
    {"sinkage_margin", &Solutions::sinkage_margin}};
const Field<WheelSpans, double> kWheelFields[] = {{"load", &WheelSpans::load},
                                                  {"rim_speed", &WheelSpans::rim_speed},
                                                  {"v_x", &WheelSpans::v_x},
                                                  {"v_y", &WheelSpans::v_y},
                                                  {"slip", &WheelSpans::slip},
                                                  {"slip_angle", &WheelSpans::slip_angle},
                                                  {"steer", &WheelSpans::steer},
                                                  {"f_x", &WheelSpans::f_x},
                                                  {"f_y", &WheelSpans::f_y},
                                                  {"torque", &WheelSpans::torque},
                                                  {"m_z", &WheelSpans::m_z},
                                                  {"sinkage", &WheelSpans::sinkage},
                                                  {"shaft_power", &WheelSpans::shaft_power}};
const Field<Powers, double> kPowerFields[] = {
    {"residual", &Powers::residual},
    {"electric", &Powers::electric},
    {"shaft", &Powers::shaft},
    {"drive", &Powers::drive},
    {"rolling", &Powers::rolling},
    {"slip", &Powers::slip},
    {"scrub", &Powers::scrub},
    {"grade", &Powers::grade},
    {"acceleration", &Powers::acceleration},
    {"imbalance", &Powers::imbalance},
    {"electric_low", &Powers::electric_low},
    {"electric_high", &Powers::electric_high},
    {"joules_per_metre", &Powers::joules_per_metre},
    {"joules_per_metre_low", &Powers::joules_per_metre_low},
    {"joules_per_metre_high", &Powers::joules_per_metre_high}};

// The solver owns the room that solving needs: one caller at a time, the others wait.
struct Solver {
  explicit Solver(const Vehicle& v) : vehicle(v), solver(v) {}

  Vehicle vehicle;
  VehicleSolver solver;
  std::mutex busy;
};

// What one call reads.
struct Question {
  Question(const Vehicle& vehicle, py::handle motions) {
    const py::object rim_speed = ValueOf(motions, "rim_speed");
    shape = rim_speed.is_none() ? ShapeOf(motions, "v_x") : ShapeOf(motions, "rim_speed", 1);
    in.rim_speed =
        arrays.SpanOf<const double>(rim_speed, "rim_speed", With(shape, vehicle.drives()));
    arrays.Read(motions, kTwistFields, shape, &in);
    arrays.Read(motions, kMotionFields, shape, &in);
    in.draw = arrays.SpanOf<const std::int32_t>(ValueOf(motions, "draw"), "draw", shape);
    const py::object soil = ValueOf(motions, "soil");
    const bool by_wheel = !soil.is_none() && ShapeOf(motions, "soil").size() == shape.size() + 1;
    in.soil = arrays.SpanOf<const std::uint8_t>(soil, "soil",
                                                by_wheel ? With(shape, vehicle.wheels()) : shape);
  }

  Arrays arrays;
  Shape shape;
  Motions in;
};

py::object Solve(Solver& self, const py::object& motions, const py::object& given,
                 const py::object& fields) {
  Question q(self.vehicle, motions);
  const std::size_t wheels = self.vehicle.wheels(), drives = self.vehicle.drives();
  py::object out = OutOf(given, fields, "Solutions", q.shape, wheels, drives);
  Solutions s;
  s.reasons = q.arrays.SpanOf<std::uint32_t>(ValueOf(out, "reasons"), "reasons", q.shape);
  q.arrays.Read(out, kSolutionFields, q.shape, &s);
  s.rim_speed =
      q.arrays.SpanOf<double>(ValueOf(out, "rim_speed"), "rim_speed", With(q.shape, drives));
  const py::object by_wheel = ValueOf(out, "wheel");
  if (!by_wheel.is_none()) {
    const Shape shape = With(q.shape, wheels);
    q.arrays.Read(by_wheel, kWheelFields, shape, &s.wheel, "wheel.");
    s.wheel.flags =
        q.arrays.SpanOf<std::uint32_t>(ValueOf(by_wheel, "flags"), "wheel.flags", shape);
  }
  q.arrays.CheckOverlaps();
  AskOrRefuse(
      &self.busy, [&] { return self.solver.Solve(q.in, s); },
      [&] { return self.solver.Problem(q.in, s); });
  return out;
}

py::object Energy(Solver& self, const py::object& motions, const py::object& given, double sds,
                  const py::object& fields) {
  Question q(self.vehicle, motions);
  const std::size_t wheels = self.vehicle.wheels();
  py::object out = OutOf(given, fields, "Powers", q.shape, wheels);
  Powers p;
  p.reasons = q.arrays.SpanOf<std::uint32_t>(ValueOf(out, "reasons"), "reasons", q.shape);
  q.arrays.Read(out, kPowerFields, q.shape, &p);
  p.wheel_shaft =
      q.arrays.SpanOf<double>(ValueOf(out, "wheel_shaft"), "wheel_shaft", With(q.shape, wheels));
  q.arrays.CheckOverlaps();
  AskOrRefuse(
      &self.busy, [&] { return self.solver.Energy(q.in, p, sds); },
      [&] { return self.solver.Problem(q.in, p, sds); });
  return out;
}

// Margins by value: another thread may write Python's while the lock is released.
template <auto Ask>
py::tuple Probability(Solver& self, const py::object& motions, Margins margins) {
  Question q(self.vehicle, motions);
  py::array_t<double> least(q.shape), most(q.shape);
  const auto low = q.arrays.SpanOf<double>(least, "least", q.shape);
  const auto high = q.arrays.SpanOf<double>(most, "most", q.shape);
  AskOrRefuse(
      &self.busy, [&] { return (self.solver.*Ask)(q.in, margins, low, high); },
      [&] {
        const std::string problem = self.solver.Problem(q.in, margins, low, high);
        return problem.empty() ? "draws: none, expected use_draws before" : problem;
      });
  return py::make_tuple(least, most);
}

void UseDraws(Solver& self, std::size_t count) {
  const py::gil_scoped_release release;
  const std::lock_guard lock(self.busy);
  self.solver.UseDraws(count);
}

void BindConstants(py::module_& m) {
  using C = SkidConstants;
  py::class_<C>(m, "SkidConstants", R"(What a differential-drive controller asks for.

Of one soil, speed and radius of path. With rim speeds l, r of the sides and their distance b:

    separation_multiplier = (r - l)/(b yaw rate),  radius_multiplier = 2 v_x/(l + r)

low and high: ends of the ground's 90 % interval; both NaN: no balance at one.)")
      .def_readonly("soil", &C::soil)
      .def_readonly("speed", &C::speed, "[m/s]")
      .def_readonly("radius", &C::radius, "[m]")
      .def_readonly("separation_multiplier", &C::separation_multiplier)
      .def_readonly("separation_low", &C::separation_low)
      .def_readonly("separation_high", &C::separation_high)
      .def_readonly("radius_multiplier", &C::radius_multiplier)
      .def_readonly("radius_low", &C::radius_low)
      .def_readonly("radius_high", &C::radius_high)
      .def_readonly("variance_speed", &C::variance_speed,
                    "Variance of odometry with these multipliers, of the ground alone [(m/s)^2].")
      .def_readonly("variance_yaw_rate", &C::variance_yaw_rate, "The same [(rad/s)^2].")
      .def_readonly("pull_over_weight", &C::pull_over_weight,
                    "Largest forward force over weight that balances, at the mean ground.")
      .def_readonly("pull_low", &C::pull_low, "The same 1.645 sd worse.")
      .def_readonly("reasons", &C::reasons, "Bits of Reason.");
  using P = WheelPlace;
  py::class_<P>(m, "WheelPlace", R"(A wheel as the vehicle file has it.

With the steering psi, its length L and centre, (c, s) = (cos psi - sin psi y/L, sin psi (x - centre)/L):
a steered wheel points along (c, s).)")
      .def_readonly("x_m", &P::x_m, "Of its centre, from the origin.")
      .def_readonly("y_m", &P::y_m)
      .def_readonly("radius_m", &P::radius_m, "r of rim speeds r w.")
      .def_readonly("drive", &P::drive, "Index into drive_names; -1: it rolls freely.")
      .def_readonly("steered", &P::steered)
      .def_readonly(
          "own_motor", &P::own_motor,
          "In a vehicle that steers its rim speed is that of the drive times hypot(c, s), "
          "or c if it is not steered itself.");
}

}  // namespace

void BindVehicle(py::module_& m) {
  BindConstants(m);
  py::class_<Vehicle>(m, "Vehicle",
                      R"(A vehicle, with a model for each wheel type and soil of its file.

Immutable; for any number of threads. Axes of ISO 8855: x forward, y left, z up.)")
      .def_static(
          "open", &Vehicle::Open, py::arg("vehicle_file"), py::call_guard<py::gil_scoped_release>(),
          R"(Reads and checks a vehicle file (docs/planning.md), and the models that it names.

Raises Error "FILE:LINE: key 'a.b': got X, expected Y", also for a model that cannot be read or is of
another wheel.)")
      .def_property_readonly("name", &Vehicle::name)
      .def_property_readonly("mass_kg", &Vehicle::mass_kg, "[kg]")
      .def_property_readonly("gravity_m_per_s2", &Vehicle::gravity_m_per_s2, "[m/s^2]")
      .def_property_readonly("wheels", &Vehicle::wheels, "How many.")
      .def_property_readonly("drives", &Vehicle::drives, "How many.")
      .def_property_readonly("steered", &Vehicle::steered)
      .def_property_readonly("wheel_names", &Vehicle::wheel_names,
                             "In the order of answers by wheel.")
      .def_property_readonly("drive_names", &Vehicle::drive_names, "In the order of rim speeds.")
      .def_property_readonly("soils", &Vehicle::soils, "Names, in the order of indices of a soil.")
      .def_property_readonly("wheel_places", &Vehicle::wheel_places,
                             "WheelPlace of each wheel, in the order of wheel_names.")
      .def_property_readonly("steering_centre_m", &Vehicle::steering_centre_m,
                             "x of the axle that does not steer.")
      .def_property_readonly("steering_length_m", &Vehicle::steering_length_m,
                             "L: tan(psi) = L times curvature.")
      .def("soil", &Vehicle::soil, py::arg("name"),
           "Index of a soil. Raises Error with the nearest name there is.")
      .def(
          "constants",
          [](const Vehicle& v, const std::vector<double>& speeds,
             const std::vector<double>& radii) { return v.Constants(speeds, radii); },
          py::arg("speeds"), py::arg("radii"), py::call_guard<py::gil_scoped_release>(),
          R"(SkidConstants for each soil, speed [m/s] and radius [m], in this order.

Raises Error where the vehicle is no skid-steered one, or a number is not finite and above 0.)")
      .def("__repr__", [](const Vehicle& v) { return "<grouser.Vehicle " + v.name() + ">"; });

  const Margins margins;
  py::class_<Margins>(m, "Margins", R"(What must be left of a limit.

tip: 0 about to tip, 1 at the centre; torque, sinkage: 1 - largest use of the limit [-].
trained_only: what the models' runs do not cover counts as a limit.)")
      .def(py::init([](double tip, double torque, double sinkage, bool trained_only) {
             return Margins{tip, torque, sinkage, trained_only};
           }),
           py::kw_only(), py::arg("tip") = margins.tip, py::arg("torque") = margins.torque,
           py::arg("sinkage") = margins.sinkage, py::arg("trained_only") = margins.trained_only)
      .def_readwrite("tip", &Margins::tip)
      .def_readwrite("torque", &Margins::torque)
      .def_readwrite("sinkage", &Margins::sinkage)
      .def_readwrite("trained_only", &Margins::trained_only)
      .def("__repr__", [](const Margins& g) {
        return py::str("Margins(tip={}, torque={}, sinkage={}, trained_only={})")
            .format(g.tip, g.torque, g.sinkage, g.trained_only);
      });

  py::class_<Solver>(m, "VehicleSolver", R"(Solves steady motions of a vehicle.

Best one for each thread: threads that share one wait for each other. Python's lock is released.)")
      .def(py::init<const Vehicle&>(), py::arg("vehicle"))
      .def("solve", &Solve, py::arg("motions"), py::arg("out") = py::none(), py::kw_only(),
           py::arg("fields") = py::none(),
           R"(Balances n motions; returns Solutions.

motions: Motions, arrays of one shape (any; in C order). out: Solutions of that shape, written in
place. fields: what new ones hold; see Solutions.empty. A bad motion gets reason INPUT, and harms no
other. Raises Error for arrays of another shape, dtype or order, read-only or overlapping ones.)")
      .def("energy", &Energy, py::arg("motions"), py::arg("out") = py::none(), py::kw_only(),
           py::arg("sds") = kWorseBySd, py::arg("fields") = py::none(),
           R"(Where the power of n motions goes; returns Powers.

At the mean ground, and at grounds better and worse by `sds` standard deviations. Else as solve.)")
      .def(
          "probability_to_go", &Probability<&VehicleSolver::ProbabilityToGo>, py::arg("motions"),
          py::arg("margins") = margins,
          R"(Probability that a motion leaves every margin: (least, most), arrays of the motions' shape.

That of ground no worse than the worst on which it does, from -4 to 4 standard deviations. Where the
models' runs do not cover what decides, least counts it as not going and most as going.)")
      .def("use_draws", &UseDraws, py::arg("count"),
           "From now on motions may name one of so many coherent draws of the ground; 0: none. "
           "Raises Error for more than 1024.")
      .def("probability_by_draws", &Probability<&VehicleSolver::ProbabilityByDraws>,
           py::arg("motions"), py::arg("margins") = margins,
           "The share of the draws (use_draws) on which a motion leaves every margin: (least, "
           "most).");
}

}  // namespace grouser::python
