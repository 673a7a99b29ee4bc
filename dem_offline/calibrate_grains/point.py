"""One point of the design: its soil and scene files, its runs one after the other, what they measured."""

import contextlib
import hashlib
import json
import os
import time

import numpy
import wheel_campaign
from bench import Bench, first_on, packing_of
from beside import WINDOW, force_at
from experiment_runs import ENDING, Execution, Result, check_plans, engine_of, read_kept, record_of
from grain_soil import GrainSoil
from plain_yaml import text_of
from processes import Processes, ProgramFailed, write_atomically
from targets import kind_of, wheel_key

COLLECTED = "3"  # what is kept of the runs: another one reads them again


class Setting:
    """What all points share. start: vary.Start; targets; predict; beds; program: grouser-dem; folder: of the
    points; lock: a descriptor that children keep; say; known: of an earlier design, or none; scratch: where a point
    writes, its own folder but for a call that runs nothing."""

    def __init__(self, start, targets, predict, beds, program, folder, lock, say, known=None):
        self.start, self.targets, self.predict, self.beds = start, targets, predict, beds
        self.program, self.folder, self.lock, self.say, self.known = program, folder, lock, say, known
        self.scratch = folder

    @property
    def keys(self):
        """Of all rows that a point is to give."""
        return sorted(row.key for row in self.targets.chosen(self.predict))


class Point:
    """label: s001 of the sequence, m001 of those chosen by the emulator; values: {parameter: value}, fixed ones too."""

    def __init__(self, label, values, setting):
        self.label, self.values, self.setting = label, values, setting
        kept, self.folder = (os.path.join(one, label) for one in (setting.folder, setting.scratch))
        self.stored, self.spent = (os.path.join(kept, name) for name in ("point.json", "spent.json"))
        os.makedirs(os.path.join(self.folder, "logs"), exist_ok=True)
        soil, scene, tool, wheel = setting.start.made(values, f"point {label}")
        scene["soil"] = "point.soil.yaml"
        self.soil_file = os.path.join(self.folder, "point.soil.yaml")
        self.scene_file = os.path.join(self.folder, "point.scene.yaml")
        texts = [text_of(one) for one in (soil, scene)]
        for path, text in zip((self.soil_file, self.scene_file), texts):
            write_atomically(path, text)
        self.bench = bench_of(GrainSoil(self.soil_file), setting.targets, setting.predict, setting.beds, tool, wheel)
        self.known = setting.known.of(values) if setting.known else None
        self.tests, self.states = self._left()
        asked = [COLLECTED, engine_of(setting.program), *texts, repr(tool), str(setting.beds), *setting.keys]
        if self.known:
            asked.append(json.dumps([self.known.entry, self.known.failed, self.known.outputs], sort_keys=True))
        self.asked = hashlib.sha256("\n".join(asked).encode()).hexdigest()
        self.processes = Processes(os.path.join(self.folder, "logs"), inherited=[setting.lock])
        self.execution = Execution(self.folder, setting.program, 1, self.processes, setting.say)
        self.before = {"tests": 0.0, "wheels": 0.0}  # seconds of earlier calls
        self.seconds, self.reasons = dict(self.before), []
        self.phase, self.counted = "tests", time.monotonic()

    def _left(self):
        """(names of the tests on the bench, wheel states) that are to be run: those with a row that is not known."""
        names, states = list(self.bench.bed_tests()), self.setting.targets.wheel_states(self.setting.predict)
        if not self.known:
            return names, states
        if self.known.failed:
            return [], []
        left = set(self.setting.keys) - self.known.asked
        if not any(kind_of(key) != "wheel" for key in left):
            names = []
        rows = (row for row in self.setting.targets.chosen(self.setting.predict) if row.kind == "wheel")
        at = {(row.at["slip"], row.at["angle"], row.at["load"]) for row in rows if row.key in left}
        return names, [state for state in states if wheel_campaign.state_of(state) in at]

    def of_all(self):
        """{kind of runs: how many of them a point makes of which nothing is known}."""
        count = {"tests": len(self.bench.bed_tests()),
                 "wheels": len(self.setting.targets.wheel_states(self.setting.predict))}
        return {what: self.setting.beds * runs for what, runs in count.items()}

    def finished(self):
        """What an earlier call has kept of the same point, else none; of the same grains asked for less, or cut
        short, its time."""
        kinds = {"values": dict, "seconds": dict}
        kept = read_kept(self.stored, {"asked": str, **kinds})
        if kept and kept["asked"] == self.asked:
            return kept
        spent = [one["seconds"] for one in (kept, read_kept(self.spent, kinds)) if one and one["values"] == self.values]
        self.before = max(spent, key=lambda one: sum(one.values()), default=self.before)  # the later has the other's
        return None

    def count(self):
        """Keeps the time until now: it counts although the point be cut short."""
        now = time.monotonic()
        self.seconds[self.phase] += now - self.counted
        self.counted = now
        whole = {name: value + self.before[name] for name, value in self.seconds.items()}
        write_atomically(self.spent, json.dumps({"values": self.values, "seconds": whole}) + "\n")

    def known_line(self):
        """Its line of the table before it was run: `left` says that what it lacks is still to be run."""
        line = self._summary({}, {})
        return line if line["status"] == "failed" else {**line, "left": True}

    def check(self):
        """The engine reads the experiments before the first run starts. Raises Refused."""
        check_plans(self.setting.program, [self.bench.on_bed(name, 1) for name in self.tests])

    def work(self):
        """Yields every child that is to be waited for; at the end point.json is there."""
        self.counted = time.monotonic()
        results = yield from self._tests()
        self.count()
        self.phase = "wheels"
        packed = results or not self.tests
        records = (yield from self._wheels()) if packed and self.states else {}
        self.count()
        write_atomically(self.stored, json.dumps(self._summary(results, records), indent=1) + "\n")
        os.unlink(self.spent)

    def _tests(self):
        """{(test, bed): Result} of those that ended well; a bed that cannot be packed is passed over."""
        results = {}
        for seed in range(1, self.setting.beds + 1):
            if not self.tests:
                break
            first = first_on(self.bench, seed, self.execution)
            result = yield from self._run(first)
            if not result:
                continue
            results[first.name.rsplit("_bed", 1)[0], seed] = result
            for name in self.tests:
                if (name, seed) in results:
                    continue
                later = yield from self._run(self.bench.on_bed(name, seed, packing_of(result)))
                if later:
                    results[name, seed] = later
        return results

    def _run(self, plan):
        """A Result, or none with the reason kept."""
        path = self.execution.stem(plan) + ENDING
        if not self.execution.is_done(plan):
            child = self.execution.start(plan)
            yield child
            if child.returncode != 0:
                self.reasons.append(f"{plan.name}: {last_line(self.processes.log_tail(plan.name))}")
                return None
        record = record_of(self.setting.program, path)
        result = Result(plan, self.execution.stem(plan), record) if record else None
        if not result or not result.done:
            self.reasons.append(f"{plan.name}: {result.reason if result else 'left no record'}")
            return None
        return result

    def _wheels(self):
        """{state: records}."""
        path = os.path.join(self.folder, "wheels.campaign.yaml")
        folder = os.path.join(self.folder, "wheels")
        write_atomically(path, wheel_campaign.text_of("./grouser calibrate grains", f"point-{self.label}",
                                                      self.scene_file, self.soil_file,
                                                      wheel_campaign.runs_of(self.states, self.setting.beds),
                                                      self.folder))
        with contextlib.suppress(FileNotFoundError):
            os.unlink(os.path.join(folder, "campaign.json"))  # an earlier call's, maybe of other grains
        child = self.processes.start("wheels", wheel_campaign.command(self.setting.program, path, folder, 1, "cpu"))
        yield child
        failed = child.returncode != 0
        if failed:
            self.reasons.append(f"wheels: {last_line(self.processes.log_tail('wheels'))}")
        try:
            records = wheel_campaign.records_in(self.setting.program, folder)
        except (OSError, ProgramFailed) as error:
            if not (failed and isinstance(error, FileNotFoundError)):
                self.reasons.append(f"wheels: {last_line(str(error))}")
            return {}
        for state, each in records.items():
            for run in map(wheel_campaign.summary_of, each):
                if not counts(run):
                    self.reasons.append(f"wheel slip {state[0]:g} angle {state[1]:g} bed {run['seed']}: "
                                        f"{run['status']} {run['reason']}".rstrip())
        return records

    def _summary(self, results, records):
        known, wanted = self.known, set(self.setting.keys)
        outputs = {**(known.outputs if known else {}), **self._curves(results), **self._wheel_outputs(records)}
        outputs = {key: value for key, value in outputs.items() if key in wanted}
        beds = {"tests": {seed: r.record["bed"] for (_, seed), r in results.items()},
                "wheels": {r["spec"].get("seed"): r.get("bed", {}) for each in records.values() for r in each}}
        missing = sorted(wanted - set(outputs))
        fractions = {key: {**(getattr(known, key) if known else {}), **reached(key, beds)}
                     for key in ("solid_fraction", "top_solid_fraction")}
        return {"label": self.label, "values": self.values, "asked": self.asked,
                **({"known": known.entry} if known else {}),
                "status": "failed" if not outputs else "part" if missing else "done",
                "seconds": {name: round(value + self.before[name], 1) for name, value in self.seconds.items()},
                **fractions, "outputs": outputs, "reasons": (known.reasons if known else []) + self.reasons}

    def _curves(self, results):
        found = {}
        for row in self.setting.targets.chosen(self.setting.predict):
            if row.kind == "wheel":
                continue
            name, body = (f"plate{row.at['mm']:g}", "plate") if row.kind == "plate" else ("press", "wheel")
            each = {seed: force_at(result.series, body, row.at["sinkage"], WINDOW * self.bench.soil.diameter)
                    for (one, seed), result in results.items() if one == name}
            found[row.key] = over_beds({seed: (value, None) for seed, value in each.items() if value is not None})
        return {key: value for key, value in found.items() if value}

    def _wheel_outputs(self, records):
        found = {}
        for state, each in records.items():
            by_seed = {run["seed"]: run["outputs"] for run in map(wheel_campaign.summary_of, each) if counts(run)}
            for output in {name for one in by_seed.values() for name in one}:
                found[wheel_key(state, output)] = over_beds({
                    seed: (one[output]["mean"], one[output]["standard_error"]) for seed, one in by_seed.items()
                    if output in one})
        return found


def counts(run):
    """Whether the summary of a wheel run (wheel_campaign.summary_of) is of one that did not fail and went the equal
    travel."""
    return run["status"] != wheel_campaign.FAILED and run["equal_travel"]


def bench_of(soil, targets, predict, beds, tool_friction, wheel_friction):
    plates = targets.plates(predict)
    names = [f"plate{mm:g}" for mm in plates]
    sinkages = {f"plate{mm:g}": z + WINDOW * soil.diameter for mm, z in plates.items()}
    press = targets.press_sinkage(predict)
    if press:
        names.append("press")
        sinkages["press"] = press + WINDOW * soil.diameter
    return Bench(soil, names, beds, False, tool_friction, wheel=targets.press_wheel, sinkages=sinkages,
                 wheel_friction=wheel_friction)


def over_beds(by_seed):
    """by_seed: {seed: (value, own standard error or none)}. The mean; its standard error: by the beds where there are
    two or more, not less than the runs' own; none: not known."""
    if not by_seed:
        return None
    values = numpy.array([value for value, _ in by_seed.values()])
    own = [error for _, error in by_seed.values()]
    error = None if None in own else float(numpy.sqrt(numpy.sum(numpy.square(own))) / len(own))
    if len(values) > 1:
        error = max(error or 0.0, float(values.std(ddof=1) / numpy.sqrt(len(values))))
    return {"value": short(values.mean()), "standard_error": short(error),
            "beds": {str(seed): short(value) for seed, (value, _) in sorted(by_seed.items())}}


def short(value):
    """As a table has it."""
    return None if value is None else float(f"{value:.7g}")


def reached(key, beds):
    """{kind of test: mean over its beds} of what their preparation reached; none where it is not known."""
    found = {}
    for kind, by_seed in beds.items():
        values = [float(bed[key]) for bed in by_seed.values() if float(bed.get(key, 0)) > 0]
        if values:
            found[kind] = round(sum(values) / len(values), 6)
    return found


def last_line(text):
    lines = [line for line in text.strip().splitlines() if line.strip()]
    return lines[-1].strip() if lines else "no word"
