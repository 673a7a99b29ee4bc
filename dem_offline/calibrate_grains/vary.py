"""What a calibration of grains varies: parameters with ranges, a space-filling design over them, and the soil and
scene that a point of it stands for."""

import copy
import difflib
import math

import yaml
from experiment_runs import Refused

TESTS = ("plate", "press", "wheel")  # kinds
ANY = "any"  # of a bed whose layers are alike: where one of them ends


class Parameter:
    """One that may be varied. usual: its range where nothing is said, none: as the soil file has it.
    least, most: what the engine or the word bears. acts_on: kinds of tests that depend on it. absent: the value that
    grains have which say nothing of it; none: that of the soil file; ANY: whatever the value."""

    def __init__(self, name, unit, usual, least, most, meaning, log=False, acts_on=TESTS, absent=None):
        self.name, self.unit, self.usual = name, unit, usual
        self.least, self.most, self.meaning, self.log, self.acts_on = least, most, meaning, log, acts_on
        self.absent = absent


KNOWN = {one.name: one for one in (
    Parameter("friction", "", (0.3, 0.8), 0, 10, "friction between grains"),
    Parameter("rolling_friction", "", (0.05, 0.5), 0, 10, "rolling friction between grains"),
    Parameter("wheel_friction", "", (0.2, 0.7), 0, 10, "friction of the wheel, driven and pressed, on grains",
              acts_on=("press", "wheel")),
    Parameter("tool_friction", "", None, 0, 10, "friction of the plates on grains", acts_on=("plate",)),
    Parameter("solid_fraction", "", (0.52, 0.58), 0.4, 0.66, "solid fraction, in two layers that of the upper"),
    Parameter("top_layer_m", "m", None, 0, 10, "thickness of the upper of two layers", absent=ANY),
    Parameter("denser_below", "", None, 0, 0.2, "solid fraction of the lower layer less that of the upper",
              absent=0),
    Parameter("surface_energy_j_per_m2", "J/m^2", None, 0, 100, "cohesion of grains (jkr)", absent=0),
    Parameter("youngs_modulus_pa", "Pa", None, 1e4, 1e12, "Young's modulus of grains", log=True),
    Parameter("grain_diameter_m", "m", None, 1e-5, 1, "mean grain diameter by mass"))}
OF_GRAINS = "grains"  # tool_friction: that of the grains
FRICTIONS = ("friction", "rolling_friction", "wheel_friction", "tool_friction")


def markdown():
    """KNOWN as the table of docs/scene-files.md."""
    lines = ["| key | unit | without a file | from, to | what it is |", "| --- | --- | --- | --- | --- |"]
    for one in KNOWN.values():
        usual = "[{:g}, {:g}]".format(*one.usual) if one.usual else "not varied"
        lines.append(f"| `{one.name}` | {one.unit or '-'} | {usual} | {one.least:g}, {one.most:g} | {one.meaning}"
                     + (", varied in its logarithm |" if one.log else " |"))
    return "\n".join(lines) + "\n"


class Vary:
    """ranges: {name: (low, high)}, in the order of the sequence's dimensions; fixed: {name: value}."""

    def __init__(self, ranges, fixed):
        self.ranges, self.fixed = ranges, fixed

    @property
    def names(self):
        return list(self.ranges)

    def acting_on(self, kind):
        """Indices of the parameters that a kind of test depends on."""
        return [k for k, name in enumerate(self.names) if kind in KNOWN[name].acts_on]

    def at(self, unit_point):
        """{name: value} of a point of the unit cube."""
        return {name: round_to(between(KNOWN[name], *self.ranges[name], float(u)))
                for name, u in zip(self.names, unit_point)}

    def to_unit(self, values):
        """The reverse, without the rounding."""
        return [position(KNOWN[name], *self.ranges[name], values[name]) for name in self.names]

    def points(self, count):
        """The first `count` of Sobol's sequence: they stay when more are asked for."""
        import openturns
        sample = openturns.SobolSequence(len(self.names)).generate(count)
        return [self.at(point) for point in sample]


def between(parameter, low, high, u):
    if parameter.log:
        return math.exp(math.log(low) + u * (math.log(high) - math.log(low)))
    return low + u * (high - low)


def position(parameter, low, high, value):
    if parameter.log:
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)


def round_to(value, digits=5):
    """As files have it: short, and the same wherever it is read."""
    return float(f"{value:.{digits}g}")


def read(path, first=()):
    """Vary of a file, or the usual one where there is none; first: parameters whose dimensions come before those of
    others (the order of KNOWN), so that a design in these alone keeps its points. Refused: what, where, expected."""
    order = [*(name for name in first if name in KNOWN), *(name for name in KNOWN if name not in first)]
    if path is None:
        return Vary({name: KNOWN[name].usual for name in order if KNOWN[name].usual}, {})
    try:
        with open(path, encoding="utf-8") as file:
            said = yaml.safe_load(file)
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise Refused(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(said, dict) or not said:
        raise Refused(f"{path}: got no mapping, expected PARAMETER: [LOW, HIGH] of {', '.join(KNOWN)}")
    for name in said:
        if name not in KNOWN:
            near = difflib.get_close_matches(str(name), KNOWN, 1, 0.3)
            raise Refused(f"{path}: unknown parameter '{name}', expected one of {', '.join(KNOWN)}"
                          + (f" (the nearest: {near[0]})" if near else ""))
    ranges, fixed = {}, {}
    for name in order:
        if name in said:
            take(path, KNOWN[name], said[name], ranges, fixed)
    if not ranges:
        raise Refused(f"{path}: every parameter is fixed, expected a range [LOW, HIGH] of one at least")
    for one, other in (("top_layer_m", "denser_below"), ("denser_below", "top_layer_m")):
        if one in said and other not in said:
            raise Refused(f"{path}: {one} without {other}, expected both: two layers")
    return Vary(ranges, fixed)


def take(path, parameter, value, ranges, fixed):
    def number(got):
        try:
            result = math.nan if isinstance(got, bool) else float(got)  # YAML reads 1e7 as a text
        except (TypeError, ValueError):
            result = math.nan
        if not parameter.least <= result <= parameter.most:
            raise Refused(f"{path}: {parameter.name}: got {got!r}, expected a number from {parameter.least:g} to "
                          f"{parameter.most:g}" + (f" {parameter.unit}" if parameter.unit else ""))
        return result
    if parameter.name == "tool_friction" and value == OF_GRAINS:
        return
    if isinstance(value, list):
        ends = [number(one) for one in value]
        if len(ends) != 2 or not ends[0] < ends[1]:
            raise Refused(f"{path}: {parameter.name}: got {value}, expected [LOW, HIGH] with LOW < HIGH")
        ranges[parameter.name] = tuple(ends)
    else:
        fixed[parameter.name] = number(value)


class Start:
    """The soil and the scene that a design changes, as documents of `load`."""

    def __init__(self, soil, scene):
        self.soil, self.scene = soil, scene

    def made(self, values, name):
        """(soil document, scene document, friction of plates or none: of the grains, friction of the wheel) at
        `values`. The grains' density is such that the bulk density of the bed, of two layers of the upper one,
        stays the measured one. Grains roll on wheel and plates as on each other."""
        soil, scene = copy.deepcopy(self.soil), copy.deepcopy(self.scene)
        grains = soil["grains"]
        soil["name"] = name
        for key in ("friction", "rolling_friction", "youngs_modulus_pa"):
            if key in values:
                grains[key] = values[key]
        if values.get("surface_energy_j_per_m2", 0) > 0:
            contact = grains.setdefault("contact", {})
            contact["surface_energy_j_per_m2"] = values["surface_energy_j_per_m2"]
            if contact.get("cohesion", "none") == "none":
                contact["cohesion"] = "jkr"
        if "grain_diameter_m" in values:
            whole = sum(float(one["mass_fraction"]) for one in grains["sizes"])
            mean = sum(float(one["mass_fraction"]) * float(one["diameter_m"]) for one in grains["sizes"]) / whole
            for one in grains["sizes"]:
                one["diameter_m"] = round_to(float(one["diameter_m"]) * values["grain_diameter_m"] / mean)
        self._pack(soil, values)  # the least layer is one of the sizes as they are now
        if "rolling_friction" in values:
            scene["wheel"]["rolling_friction"] = values["rolling_friction"]
        if "wheel_friction" in values:
            scene["wheel"]["friction"] = values["wheel_friction"]
        return soil, scene, values.get("tool_friction"), float(scene["wheel"]["friction"])

    @staticmethod
    def values_of(soil, scene):
        """The reverse of `made`, as far as the documents say it: {parameter: value}."""
        grains, wheel = soil["grains"], scene["wheel"]
        found = {key: float(grains[key]) for key in ("friction", "rolling_friction", "youngs_modulus_pa")}
        whole, layer = float(grains["solid_fraction"]), grains.get("top_layer")
        found["solid_fraction"] = float(layer["solid_fraction"]) if layer else whole
        found["denser_below"] = round_to(whole - found["solid_fraction"])
        if layer:
            found["top_layer_m"] = float(layer["thickness_m"])
        masses = [(float(one["mass_fraction"]), float(one["diameter_m"])) for one in grains["sizes"]]
        found["grain_diameter_m"] = round_to(sum(m * d for m, d in masses) / sum(m for m, _ in masses))
        found["surface_energy_j_per_m2"] = float(grains.get("contact", {}).get("surface_energy_j_per_m2", 0))
        found["wheel_friction"] = float(wheel["friction"])
        return found

    def _pack(self, soil, values):
        grains = soil["grains"]
        if not {"solid_fraction", "denser_below"} & set(values):
            return
        before = float((grains.get("top_layer") or grains)["solid_fraction"])
        upper = values.get("solid_fraction", before)
        density = float(grains["grain_density_kg_per_m3"]) * before / upper
        grains["grain_density_kg_per_m3"] = round_to(density, 8)
        grains["solid_fraction"] = upper
        grains.pop("top_layer", None)
        grains.pop("preparation", None)  # it is that of another packing
        below = values.get("denser_below", 0)
        soil["bulk_density_kg_per_m3"] = round_to(density * (upper + below), 8)
        if below > 0:
            grains["solid_fraction"] = round_to(upper + below)
            if values["top_layer_m"] >= self.least_layer(grains):
                grains["top_layer"] = {"thickness_m": values["top_layer_m"], "solid_fraction": upper}

    @staticmethod
    def least_layer(grains):
        """[m] what the engine bears of a top layer (kLeastTopGrains in dem_offline/engine/rig/bed.h), three of the
        largest grains: one that is thinner is left out."""
        return 3 * max(float(one["diameter_m"]) for one in grains["sizes"])
