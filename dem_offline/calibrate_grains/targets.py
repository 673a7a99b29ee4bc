"""What a measurement file asks of grains: plates, a pressed wheel and wheel states, each row with a key that says
what was done, so that one table of runs serves every file that measured the same."""

import math

import measured_table
import wheel_campaign
from beside import same_wheel
from experiment_runs import Refused
from processes import ProgramFailed

CURVES = ("plate", "press")
PREDICT = {"none": (), "plates": ("plate",), "tests": CURVES, "all": (*CURVES, "wheel")}
LOG = CURVES  # kinds whose values are compared as logarithms: their errors grow with them


class Row:
    """One measured number. value, sd: SI, force for plates too; sd none: not stated; weight: of an independent
    observation. scale: what errors of its kind are a share of. reads: key of what DEM gives for it."""

    def __init__(self, key, test, kind, measured, value, sd, held_out, **at):
        self.key, self.test, self.kind, self.measured = key, test, kind, measured
        self.value, self.sd, self.held_out, self.at = value, sd, held_out, at
        self.weight = 1.0

    @property
    def group(self):
        """Rows whose model is off alike: of one kind and one measured number."""
        return self.kind if self.kind in CURVES else f"{self.kind} {self.measured}"

    @property
    def is_log(self):
        return self.kind in LOG


class Targets:
    """All rows that DEM runs can answer; plates: {mm: most sinkage}; press: (radius, width, most sinkage) or none;
    wheel: (radius, width) or none; states: rows of measured_table; notes: what was left out."""

    def __init__(self, read, diameter):
        """read: what `grouser-calibrate rows` says; diameter: of the grains [m]."""
        self.soil, self.source, self.files, self.gravity = (read[key] for key in ("soil", "source", "files", "gravity"))
        self.notes, self.rows = list(read["notes"]), []
        self.tests = read["tests"]
        self.wheel = self.press_wheel = None
        least = 0.5 * diameter
        shallow = {}
        for one in read["observations"]:
            test = self.tests[one["test_index"]]
            if one["kind"] in CURVES and one["sinkage_m"] < least:
                shallow[one["test"]] = shallow.get(one["test"], 0) + 1
                continue
            row = getattr(self, "_" + one["kind"], self._left_out)(one, test)
            if row:
                self.rows.append(row)
        for name, count in shallow.items():
            self._note(f"{name}: {count} rows above half a grain of sinkage ({1e3 * least:.3g} mm) left out: there "
                       "single grains carry")
        self.states = measured_table.rows_of(read["observations"])
        self._weigh()
        if not any(not row.held_out for row in self.rows):
            raise Refused("no row to fit is left, expected plates, a pressed wheel or wheel tests that are not held "
                          "out")

    def _note(self, text):
        if text not in self.notes:
            self.notes.append(text)

    def _left_out(self, one, _test):
        self._note(f"{one['test']}: a {one['kind']} test is not run with grains here, left out")

    def _plate(self, one, test):
        if test["shape"] != "disc":
            self._note(f"{one['test']}: a rectangular plate is not run with grains here, left out")
            return None
        area = math.pi * one["width_m"]**2
        return Row(plate_key(2e3 * one["width_m"], one["sinkage_m"]), one["test"], "plate", "force",
                   one["value"] * area, scaled(one["sd"], area), one["held_out"], mm=2e3 * one["width_m"],
                   sinkage=one["sinkage_m"])

    def _press(self, one, test):
        self.press_wheel = same_wheel(self.press_wheel, test, "pressed")
        return Row(press_key(*self.press_wheel, one["sinkage_m"]), one["test"], "press", "force", one["value"],
                   one["sd"], one["held_out"], sinkage=one["sinkage_m"])

    def _wheel(self, one, test):
        if one["measured"] not in measured_table.OUTPUTS:
            self._note(f"{one['test']}: {one['measured']} is not compared, left out")
            return None
        self.wheel = same_wheel(self.wheel, test, "driven")
        state = wheel_campaign.state_of(measured_table.Row(0, one["slip"], math.radians(one["attack_angle_deg"]),
                                                           one["load_n"]))
        return Row(wheel_key(state, one["measured"]), one["test"], "wheel", one["measured"], one["value"], one["sd"],
                   one["held_out"], slip=state[0], angle=state[1], load=state[2])

    def _weigh(self):
        """counts_as of a test over its fitted rows; an output of a wheel counts for itself."""
        for test in self.tests:
            own = [row for row in self.rows if row.test == test["name"] and not row.held_out]
            for row in own:
                row.weight = min(1.0, test["counts_as"] / len(own)) if test["counts_as"] else 1.0

    def chosen(self, predict):
        """What a point of the design runs: rows to fit, and of those that are held out the kinds of PREDICT."""
        return [row for row in self.rows if not row.held_out or row.kind in PREDICT[predict]]

    def plates(self, predict):
        """{diameter mm: most sinkage m}."""
        most = {}
        for row in self.chosen(predict):
            if row.kind == "plate":
                most[row.at["mm"]] = max(most.get(row.at["mm"], 0), row.at["sinkage"])
        return most

    def press_sinkage(self, predict):
        """Most of the pressed wheel [m]; 0: none."""
        return max((row.at["sinkage"] for row in self.chosen(predict) if row.kind == "press"), default=0)

    def wheel_states(self, predict):
        return [state for state in self.states if not state.held_out or "wheel" in PREDICT[predict]]


def scaled(sd, by):
    return None if sd is None else sd * by


def kind_of(key):
    return key.split(" ", 1)[0]


def plate_key(mm, sinkage):
    return f"plate {mm:.6g} mm @ {1e3 * sinkage:.6g} mm"


def press_key(radius, width, sinkage):
    return f"press {1e3 * radius:.6g} x {1e3 * width:.6g} mm @ {1e3 * sinkage:.6g} mm"


def wheel_key(state, output):
    slip, angle, load = state
    return f"wheel slip {slip:.6g} angle {angle:.6g} load {load:.6g} {output}"


def read(program, path, diameter):
    """Targets of a measurement file (.yaml)."""
    try:
        return Targets(wheel_campaign.capture([program, "rows", path]), diameter)
    except ProgramFailed as error:
        raise Refused(str(error).rsplit("grouser-calibrate: ", 1)[-1]) from None
