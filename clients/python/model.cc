// grouser/model.h and grouser/model_selector.h in Python.
#include "grouser/model.h"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "clients/python/arrays.h"
#include "grouser/model_selector.h"

namespace grouser::python {
namespace {

const Field<States, const double> kStateFields[] = {{"v_x", &States::v_x},
                                                    {"v_y", &States::v_y},
                                                    {"rim_speed", &States::rim_speed},
                                                    {"load", &States::load}};
const auto kOutputFields = [] {
  std::array<Field<OutputSpans, double>, kOutputSpanFields.size()> fields;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    fields[k] = {kOutputSpanFields[k].name, kOutputSpanFields[k].member};
  }
  return fields;
}();
const Field<Answers, double> kEchoFields[] = {{"slip", &Answers::slip},
                                              {"attack_angle", &Answers::attack_angle}};
const Field<Answers, std::uint32_t> kFlagFields[] = {{"flags", &Answers::flags}};

// What one evaluation reads and writes.
struct Batch {
  Batch(py::handle states, const py::object& given, const py::object& fields)
      : shape(ShapeOf(states, "load")), out(OutOf(given, fields, "Answers", shape)) {
    arrays.Read(states, kStateFields, shape, &in);
    arrays.Read(out, kFlagFields, shape, &answers);
    arrays.Read(out, kEchoFields, shape, &answers);
    for (std::size_t o = 0; o < kOutputs; ++o) {
      const py::object output = ValueOf(out, kOutputNames[o]);
      if (output.is_none()) continue;
      const std::string prefix = std::string(kOutputNames[o]) + ".";
      arrays.Read(output, kOutputFields, shape, &answers.output[o], prefix);
    }
  }

  Arrays arrays;
  Shape shape;
  py::object out;
  States in;
  Answers answers;
};

py::object Evaluate(const Model& model, const py::object& states, const py::object& out,
                    const py::object& fields) {
  Batch b(states, out, fields);
  b.arrays.CheckOverlaps();
  AskOrRefuse([&] { return model.Evaluate(b.in, b.answers); },
              [&] { return Model::SizeProblem(b.in, b.answers); });
  return b.out;
}

py::object EvaluateDraws(const Model& model, const py::object& states, const Draws& draws,
                         const py::object& k, const py::object& out, const py::object& fields) {
  Batch b(states, out, fields);
  if (k.is_none()) throw Refusal("k: None, expected a NumPy array of uint32");
  const auto given = b.arrays.SpanOf<const std::uint32_t>(k, "k", b.shape);
  b.arrays.CheckOverlaps();
  // They are checked and then used as indices, without the lock: another thread may write k.
  const std::vector<std::uint32_t> of(given.begin(), given.end());
  AskOrRefuse([&] { return model.EvaluateDraws(b.in, draws, of, b.answers); },
              [&] {
                const std::string problem = Model::SizeProblem(b.in, b.answers);
                return problem.empty()
                           ? "k: an entry is none of the " + std::to_string(draws.size()) + " draws"
                           : problem;
              });
  return b.out;
}

py::object Select(const ModelSelector& selector, const py::object& states,
                  const AccuracyRequest& accuracy, const py::object& out, const py::object& fields,
                  const py::object& answered_by) {
  Batch b(states, out, fields);
  const auto by = b.arrays.SpanOf<std::uint32_t>(answered_by, "answered_by", b.shape);
  b.arrays.CheckOverlaps();
  AskOrRefuse([&] { return selector.Evaluate(b.in, accuracy, b.answers, by); },
              [&] { return ModelSelector::Problem(b.in, accuracy, b.answers, by); });
  return b.out;
}

Model MixtureOf(const py::sequence& models, const std::vector<double>& weights) {
  std::vector<const Model*> pointers;
  for (const py::handle model : models) {
    if (!py::isinstance<Model>(model)) throw py::type_error("models: expected a list of Model");
    pointers.push_back(&model.cast<const Model&>());
  }
  return Model::Mixture(pointers, weights);
}

AccuracyRequest RequestOf(const std::map<std::string, double>& tolerance, double share_of_load,
                          double budget_us, const std::string& target) {
  AccuracyRequest request;
  for (const auto& [name, largest] : tolerance) {
    std::size_t o = 0;
    while (o < kOutputs && name != kOutputNames[o]) ++o;
    if (o == kOutputs) {
      throw Refusal("tolerance: '" + name + "', expected f_x, f_y, f_z, torque, m_z or sinkage");
    }
    request.tolerance[o] = largest;
  }
  if (target != "dem" && target != "measured") {
    throw Refusal("target: '" + target + "', expected dem or measured");
  }
  request.share_of_load = share_of_load;
  request.budget_us = budget_us;
  request.target = target == "dem" ? IntervalTarget::kDem : IntervalTarget::kMeasured;
  return request;
}

std::map<std::string, double> ToleranceOf(const AccuracyRequest& request) {
  std::map<std::string, double> tolerance;
  for (std::size_t o = 0; o < kOutputs; ++o) {
    if (request.tolerance[o] != 0) tolerance[kOutputNames[o]] = request.tolerance[o];
  }
  return tolerance;
}

std::string DescriptionOf(const Model& m) {
  return "<grouser.Model " + m.name() + ": " + m.kind() + ", wheel " + m.wheel() + ", soil " +
         m.soil() + ">";
}

void BindDomain(py::module_& m) {
  py::class_<Domain>(m, "Domain",
                     "What the training runs covered; outside it answers are flagged EXTRAPOLATED "
                     "and their intervals grow. Mirrored in v_x and v_y.")
      .def_readonly("slip_min", &Domain::slip_min, "[-]")
      .def_readonly("slip_max", &Domain::slip_max, "[-]")
      .def_readonly("attack_angle_max_rad", &Domain::attack_angle_max_rad, "[rad]")
      .def_readonly("load_min_n", &Domain::load_min_n, "[N]")
      .def_readonly("load_max_n", &Domain::load_max_n, "[N]")
      .def_readonly("speed_m_per_s", &Domain::speed_m_per_s, "Of the training runs [m/s].");
}

}  // namespace

void BindModel(py::module_& m) {
  py::tuple outputs(kOutputs), parts(kOutputSpanFields.size());
  for (std::size_t o = 0; o < kOutputs; ++o) outputs[o] = kOutputNames[o];
  for (std::size_t k = 0; k < parts.size(); ++k) parts[k] = kOutputSpanFields[k].name;
  m.attr("OUTPUTS") = outputs;
  m.attr("OUTPUT_ARRAYS") = parts;
  BindDomain(m);
  py::class_<Draws>(m, "Draws",
                    R"(K coherent draws of what models do not know of one soil.

Intervals say how far one state's answer may be off, draws how far all answers are off together: draw
k of every model of the soil, at every state, belongs together. At each state the draws are normal
with the model's value as mean, and 5 and 95 % of them where its 90 % interval ends. Draw k is the
same bits at every call and for every count. Equations: docs/planning.md, "Draws".)")
      .def(py::init<const std::string&, std::size_t>(), py::arg("soil"), py::arg("count"),
           "Of a soil by name, say Model.soil. Raises Error for a count that is not 1 to 1024.")
      .def("__len__", &Draws::size);

  py::class_<Model>(m, "Model", R"(The fitted response of one wheel on one soil. Immutable.

May be asked from any number of threads at once; Python's lock is released while it computes.)")
      .def_static("open", &Model::Open, py::arg("model_file"),
                  py::call_guard<py::gil_scoped_release>(),
                  "Reads and checks a model file: its hash, its fields, and that its stored test "
                  "vectors are reproduced. Raises Error 'FILE: cause'.")
      .def_static(
          "mixture", &MixtureOf, py::arg("models"), py::arg("weights"),
          R"(One soil of several, and it is not known which: model i, of one wheel on soil i,
with weight w_i >= 0 (divided by their sum). With answers m_i, sds s_i and half widths h_i

    value = sum w_i m_i,  sd_soil = sqrt(sum w_i (m_i - value)^2)
    interval = value +- sqrt(sum w_i h_i^2 + (1.645 sd_soil)^2)

Raises Error 'mixture: ...' for models of another wheel or gravity, or weights that are no weights.)")
      .def(
          "scaled", &Model::Scaled, py::arg("radius_m"), py::arg("gravity_m_per_s2"),
          R"(The model of a geometrically similar wheel on the same dry soil, of another size or under
another gravity. With l the ratio of radii, g that of gravities: a state is asked as v/sqrt(g l),
load/(g l^3) and answered by forces times g l^3, moments times g l^4, sinkage times l.

Raises Error for a soil with cohesion and for numbers that are not positive and finite.)")
      .def("evaluate", &Evaluate, py::arg("states"), py::arg("out") = py::none(), py::kw_only(),
           py::arg("fields") = py::none(),
           R"(Answers n wheel states; returns Answers.

states: States, float64 arrays of one shape (any; in C order), read where they are.
out: Answers of that shape, written in place; what is None costs nothing. By default new ones.
fields: what new answers hold; see Answers.empty.

A bad state (not finite, load < 0) gets flag INVALID and NaN outputs, and harms no other. Raises
Error for arrays of another shape, dtype or order, that are read-only, or that overlap.)")
      .def("evaluate_draws", &EvaluateDraws, py::arg("states"), py::arg("draws"), py::arg("k"),
           py::arg("out") = py::none(), py::kw_only(), py::arg("fields") = py::none(),
           R"(As evaluate, with `value` of draw k[i] at state i (a sinkage no less than 0).

k: uint32, of the states' shape, each below len(draws).)")
      .def_property_readonly("name", &Model::name)
      .def_property_readonly("soil", &Model::soil, "Name of the soil.")
      .def_property_readonly("wheel", &Model::wheel, "Name of the wheel.")
      .def_property_readonly("kind", &Model::kind, "Kind of model, e.g. 'hybrid', 'bekker'.")
      .def_property_readonly("digest", &Model::digest, "SHA-256 of the content, lower-case hex.")
      .def_property_readonly("radius_m", &Model::radius_m, "r of rim_speed [m].")
      .def_property_readonly("width_m", &Model::width_m, "[m]")
      .def_property_readonly("gravity_m_per_s2", &Model::gravity_m_per_s2, "[m/s^2]")
      .def_property_readonly("interval_level", &Model::interval_level, "Of low, high: e.g. 0.9.")
      .def_property_readonly("has_gradients", &Model::has_gradients,
                             "Of all outputs. Else d_v_x to d_load are NaN.")
      .def_property_readonly("domain", &Model::domain, "What the training runs covered: Domain.")
      .def("__repr__", &DescriptionOf);
}

void BindSelector(py::module_& m) {
  py::class_<AccuracyRequest>(m, "AccuracyRequest",
                              R"(How good an answer has to be, or how little it may cost.

tolerance: largest error to accept by output, e.g. {'f_x': 1.0, 'sinkage': 0.002} [N, N m, m].
share_of_load: the same of forces over load, moments over load times radius [-].
budget_us: for all states of a call, by cost_ns, not by a clock.
target: 'dem', a fresh DEM run's mean, or 'measured', a measurement: the half width that sd_form
stands for is added in squares to what a model claims, and states where it is unknown are unmet.

What is 0 or not named asks for nothing. Raises Error for an output or a target that there is none of.)")
      .def(py::init(&RequestOf), py::kw_only(),
           py::arg("tolerance") = std::map<std::string, double>{}, py::arg("share_of_load") = 0.0,
           py::arg("budget_us") = 0.0, py::arg("target") = "dem")
      .def_property_readonly("tolerance", &ToleranceOf,
                             "By output; what asks for nothing is not in it.")
      .def_readonly("share_of_load", &AccuracyRequest::share_of_load, "[-]")
      .def_readonly("budget_us", &AccuracyRequest::budget_us, "[us]")
      .def_property_readonly(
          "target",
          [](const AccuracyRequest& r) {
            return r.target == IntervalTarget::kDem ? "dem" : "measured";
          },
          "'dem' or 'measured'.");

  py::class_<ModelSelector>(m, "ModelSelector",
                            R"(Several models of one wheel on one soil, the cheapest first.

With a tolerance the cheapest model that suffices answers a state: the larger of its interval against
DEM there and of 1.645 rms errors of its error table is within the tolerance on every output that has
one. Where none does, the one that exceeds least answers, with flag TOLERANCE_UNMET. Without a
tolerance the most accurate model that fits the budget answers all. Immutable; for any number of
threads.)")
      .def_static("open", &ModelSelector::Open, py::arg("model_files"),
                  py::call_guard<py::gil_scoped_release>(),
                  "Opens each file as Model.open and measures what each costs here. Raises Error "
                  "'FILE: cause', also where a model is of another wheel or soil than the first.")
      .def("evaluate", &Select, py::arg("states"), py::arg("accuracy"), py::arg("out") = py::none(),
           py::kw_only(), py::arg("fields") = py::none(), py::arg("answered_by") = py::none(),
           R"(As Model.evaluate, each state by the model that the accuracy request selects.

answered_by: uint32, of the states' shape: written with the index of the model that answered.)")
      .def("__len__", &ModelSelector::size)
      .def_property_readonly(
          "models",
          [](const py::object& self) {
            const auto& selector = self.cast<const ModelSelector&>();
            py::tuple models(selector.size());
            for (std::size_t k = 0; k < selector.size(); ++k) {
              models[k] =
                  py::cast(selector.model(k), py::return_value_policy::reference_internal, self);
            }
            return models;
          },
          "The models, the cheapest first.")
      .def_property_readonly(
          "cost_ns",
          [](const ModelSelector& s) {
            std::vector<double> costs;
            for (std::size_t k = 0; k < s.size(); ++k) costs.push_back(s.cost_ns(k));
            return costs;
          },
          "What one state in a batch costs each model, as measured at opening [ns].");
}

}  // namespace grouser::python
