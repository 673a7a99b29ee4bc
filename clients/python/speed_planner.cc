// grouser/vehicle.h in Python: speed plans.
#include <pybind11/stl.h>

#include <mutex>
#include <vector>

#include "clients/python/arrays.h"
#include "grouser/vehicle.h"

namespace grouser::python {
namespace {

const Field<Path, const double> kPathFields[] = {{"s", &Path::s},
                                                 {"curvature", &Path::curvature},
                                                 {"grade", &Path::grade},
                                                 {"bank", &Path::bank}};
const Field<Path, const std::uint8_t> kPathSoil[] = {{"soil", &Path::soil}};
const Field<SpeedPlan, double> kPlanFields[] = {{"speed", &SpeedPlan::speed},
                                                {"acceleration", &SpeedPlan::acceleration},
                                                {"safe", &SpeedPlan::safe},
                                                {"shortfall", &SpeedPlan::shortfall}};

struct Planner {
  Planner(const Vehicle& vehicle, std::size_t most_points) : planner(vehicle, most_points) {}

  SpeedPlanner planner;
  std::mutex busy;
};

Path PathOf(Arrays& arrays, py::handle path, const Shape& shape) {
  if (shape.size() != 1) throw Refusal("s: shape " + TextOf(shape) + ", expected (n,)");
  Path in;
  arrays.Read(path, kPathFields, shape, &in);
  arrays.Read(path, kPathSoil, shape, &in);
  return in;
}

// Entries of one byte as those of another type of one byte.
template <class To, class From>
std::span<To> Bytes(std::span<From> from) {
  static_assert(sizeof(To) == 1 && sizeof(From) == 1);
  return {reinterpret_cast<To*>(from.data()), from.size()};
}

// Options by value: another thread may write Python's while the lock is released.
py::object Plan(Planner& self, const py::object& path, SpeedOptions options,
                const py::object& given, const py::object& fields) {
  Arrays arrays;
  const Shape shape = ShapeOf(path, "s");
  const Path in = PathOf(arrays, path, shape);
  py::object out = OutOf(given, fields, "SpeedPlan", shape);
  SpeedPlan plan;
  arrays.Read(out, kPlanFields, shape, &plan);
  const auto binding = [&](const char* name) {
    return Bytes<Binding>(arrays.SpanOf<std::uint8_t>(ValueOf(out, name), name, shape));
  };
  plan.safe_binding = binding("safe_binding");
  plan.binding = binding("binding");
  plan.holds = Bytes<std::uint8_t>(arrays.SpanOf<bool>(ValueOf(out, "holds"), "holds", shape));
  arrays.CheckOverlaps();
  std::size_t not_held = 0;
  AskOrRefuse(
      &self.busy, [&] { return self.planner.Plan(in, options, plan, &not_held); },
      [&] { return self.planner.Problem(in, options, plan); });
  out.attr("not_held") = not_held;
  return out;
}

double PlanByDraws(Planner& self, const py::object& path, SpeedOptions options,
                   const py::object& plan, const py::object& by_point) {
  Arrays arrays;
  const Shape shape = ShapeOf(path, "s");
  const Path in = PathOf(arrays, path, shape);
  const auto of = [&](const char* name) {
    return arrays.SpanOf<const double>(ValueOf(plan, name), name, shape);
  };
  const auto speed = of("speed"), acceleration = of("acceleration"), safe = of("safe");
  const auto at = arrays.SpanOf<double>(by_point, "by_point", shape);
  arrays.CheckOverlaps();
  double holds = 0;
  const auto ask = [&] {
    return self.planner.PlanByDraws(in, options, speed, acceleration, &holds, at, safe);
  };
  AskOrRefuse(&self.busy, ask, [&] {
    std::vector<double> room(speed.size());
    const std::string problem = self.planner.Problem(in, options, {.speed = room});
    return problem.empty() ? "draws, speed or acceleration: none, or not finite; expected "
                             "use_draws before, and a plan"
                           : problem;
  });
  return holds;
}

void UseDrawsOf(Planner& self, std::size_t count) {
  const py::gil_scoped_release release;
  const std::lock_guard lock(self.busy);
  self.planner.UseDraws(count);
}

GradeRange Grades(Planner& self, double speed, std::uint8_t soil, double worse_by_sd,
                  Margins margins) {
  GradeRange range;
  AskOrRefuse(
      &self.busy, [&] { return self.planner.Grades(speed, soil, worse_by_sd, margins, &range); },
      [&] { return self.planner.Problem(speed, soil, worse_by_sd, margins); });
  return range;
}

void BindOptions(py::module_& m) {
  const SpeedOptions d;
  using O = SpeedOptions;
  py::class_<O>(m, "SpeedOptions", R"(What a speed plan has to keep to.

speed_limit: > 0 [m/s]. worse_by_sd: ground that the plan must stand, in standard deviations worse
than the mean. margins: Margins. acceleration, braking: largest, of comfort; above 0 [m/s^2]. start,
end: speeds at the first and the last point [m/s].)")
      .def(py::init([](double speed_limit, double worse_by_sd, const Margins& margins,
                       double acceleration, double braking, double start, double end) {
             return O{speed_limit, worse_by_sd, margins, acceleration, braking, start, end};
           }),
           py::kw_only(), py::arg("speed_limit"), py::arg("worse_by_sd") = d.worse_by_sd,
           py::arg("margins") = d.margins, py::arg("acceleration") = d.acceleration,
           py::arg("braking") = d.braking, py::arg("start") = d.start, py::arg("end") = d.end)
      .def_readwrite("speed_limit", &O::speed_limit)
      .def_readwrite("worse_by_sd", &O::worse_by_sd)
      .def_readwrite("margins", &O::margins)
      .def_readwrite("acceleration", &O::acceleration)
      .def_readwrite("braking", &O::braking)
      .def_readwrite("start", &O::start)
      .def_readwrite("end", &O::end);

  using G = GradeRange;
  const auto number = [](Binding G::*member) {
    return [member](const G& g) { return static_cast<int>(g.*member); };
  };
  py::class_<G>(m, "GradeRange", "The grades about the level that are driven, up to 85 degrees.")
      .def_readonly("any", &G::any, "False: none; binding_up says why not the level.")
      .def_readonly("down", &G::down, "The lowest [rad].")
      .def_readonly("up", &G::up, "The highest [rad]. Both of one sign: not the level.")
      .def_property_readonly("binding_down", number(&G::binding_down), "A Binding: beyond `down`.")
      .def_property_readonly("binding_up", number(&G::binding_up), "A Binding: beyond `up`.");
}

}  // namespace

void BindSpeedPlanner(py::module_& m) {
  BindOptions(m);
  py::class_<Planner>(m, "SpeedPlanner", R"(Safe speeds and speed plans along paths.

With room for paths of so many points (some 3 KB each). Best one for each thread, as VehicleSolver.)")
      .def(py::init<const Vehicle&, std::size_t>(), py::arg("vehicle"), py::arg("most_points"))
      .def("plan", &Plan, py::arg("path"), py::arg("options"), py::arg("out") = py::none(),
           py::kw_only(), py::arg("fields") = py::none(),
           R"(The highest safe speed at each point of a Path, and a plan that can be driven.

Forward and backward passes v_2^2 = v_1^2 + 2 a d over what balances; every point is solved once more
with its speed and acceleration, and slowed down where that does not hold. Returns SpeedPlan; out and
fields as in VehicleSolver.solve. Raises Error, also for options and paths that make no sense.)")
      .def("use_draws", &UseDrawsOf, py::arg("count"), "As VehicleSolver.use_draws.")
      .def(
          "plan_by_draws", &PlanByDraws, py::arg("path"), py::arg("options"), py::arg("plan"),
          py::arg("by_point") = py::none(),
          R"(Share of the draws on which a plan of that path holds at all points, with every margin left.

by_point: float64, of the path's shape: written with the share at each point. Raises Error where there
are no draws (use_draws).)")
      .def("grades", &Grades, py::arg("speed"), py::arg("soil") = 0,
           py::arg("worse_by_sd") = kWorseBySd, py::arg("margins") = Margins{},
           R"(GradeRange driven straight at constant speed [m/s] (0: the limit of creeping).

soil: index into Vehicle.soils.)");
}

}  // namespace grouser::python
