"""Runs the points of a design, a few at once, within a budget; keeps what they gave in one table."""

import contextlib
import json
import time

from point import Point
from processes import write_atomically
from table_check import VERSION

NAMES = {"tests": "plates and pressed wheel", "wheels": "wheel states"}
KEPT_EVERY_S = 30  # the time of points at work


class Table:
    """design.json: all that the inference needs of the runs."""

    def __init__(self, path, head):
        """head: what the table says before its points."""
        self.path, self.head, self.points = path, head, []

    def write(self, left=()):
        """left: lines of points that are still to be run, of which an earlier design knows something: so that a design
        that was cut short can be gone on from by --known."""
        points = sorted([*self.points, *left], key=lambda one: (one["label"][0] != "s", one["label"]))
        lines = [json.dumps(key) + ": " + json.dumps(value) for key, value in {"version": VERSION, **self.head}.items()]
        lines.append('"points": [' + ",".join("\n" + json.dumps(one) for one in points) + "\n]")
        write_atomically(self.path, "{" + ",\n".join(lines) + "}\n")


def labelled(kind, points):
    return [(f"{kind}{k:03d}", values) for k, values in enumerate(points, 1)]


def usual_seconds(results):
    """{kind of runs: mean seconds of a core at the points that made them, here or in the design before}; what no point
    made is not in it."""
    found = {}
    for one in results:
        for seconds in (one["seconds"], one.get("known", {}).get("seconds", {})):
            for what, value in seconds.items():
                if value > 0:
                    found.setdefault(what, []).append(value)
    return {what: sum(values) / len(values) for what, values in found.items()}


def to_run(point):
    """Kinds of runs that a point still needs."""
    return [what for what, some in (("tests", point.tests), ("wheels", point.states)) if some]


def expected_seconds(points, usual):
    """Of a core, for points that are to be run; what `usual` has no word of counts as nothing."""
    return sum(max(0.0, usual.get(what, 0.0) - point.before[what]) for point in points for what in to_run(point))


def plan_text(points, results, more, of_all):
    """What points that are to be run take. results: of the others; more: points that the emulators will choose then,
    each of of_all runs (Point.of_all)."""
    usual = usual_seconds([*results, *({"seconds": {}, "known": point.known.entry} for point in points if point.known)])
    lines = [f"{len(points) + len(results)} points, {len(results)} of them done"]
    for what, runs in (("tests", sum(len(p.tests) for p in points)), ("wheels", sum(len(p.states) for p in points))):
        name = NAMES[what]
        some = [point for point in points if what in to_run(point)]
        if not some:
            lines.append(f"{name}: no run")
            continue
        cost = (f"{expected_seconds(some, {what: usual[what]}) / 60:.0f} core-minutes ({usual[what] / 60:.1f} a point, "
                "as recorded)" if what in usual else "no time recorded before a first point is done")
        lines.append(f"{name}: {runs * some[0].setting.beds} runs at {len(some)} points, {cost}")
    failed = sum(point.known is not None and point.known.failed for point in points)
    if failed:
        lines.append(f"{failed} points are known to fail: nothing is run there")
    if more > 0:
        what = [f"{more * of_all[kind]} runs of {name}" for kind, name in NAMES.items() if of_all[kind]]
        seconds = sum(usual.get(kind, 0.0) for kind in NAMES if of_all[kind])
        untold = [NAMES[kind] for kind in NAMES if of_all[kind] and kind not in usual]
        lines.append(f"{more} points more that the emulators will choose (--more): {', '.join(what)}, "
                     f"{more * seconds / 60:.0f} core-minutes"
                     + (f" without {' and '.join(untold)}: no time recorded" if untold else ""))
    return "\n".join(lines) + "\n"


class Work:
    """One point at work: its generator, and the child that it waits for."""

    def __init__(self, point):
        self.point, self.steps, self.began = point, point.work(), time.monotonic()
        self.child = next(self.steps, None)

    def goes_on(self):
        """False at its end."""
        while self.child is not None and self.child.poll() is not None:
            self.point.processes.stop(self.child)  # it is forgotten: its number may soon be another process's
            self.point.count()
            self.child = next(self.steps, None)
        if self.child is not None and time.monotonic() - self.point.counted > KEPT_EVERY_S:
            self.point.count()
        return self.child is not None


class Runner:
    """Runs points, `jobs` at once, none beside its own process. hours: of wall time for the whole design, what
    earlier calls took counted once for each point, also of those that they did not end; none: no end. tell: called
    with fraction, seconds left and stage at the end of each point; none: nobody."""

    def __init__(self, setting, table, jobs, hours, say, tell=None):
        self.setting, self.table, self.jobs, self.say, self.tell = setting, table, jobs, say, tell
        self.budget = None if hours is None else 3600 * hours * jobs
        self.spent = 0.0

    def waiting(self, labelled_points):
        """Points that are to be run; the results that are kept of others are taken."""
        found = []
        for label, values in labelled_points:
            point = Point(label, values, self.setting)
            kept = point.finished()
            if kept:
                self._take(kept)
            else:
                found.append(point)
                self.spent += sum(point.before.values())
        return found

    def run(self, labelled_points):
        """Whether all were run. Those whose result is kept are not run again."""
        waiting = self.waiting(labelled_points)
        self._write(waiting)
        self.total = len(self.table.points) + len(waiting)
        self.say(f"{self.total} points, {len(self.table.points)} of them done before ({self.spent / 60:.1f} minutes "
                 "of a core)")
        if waiting:
            waiting[0].check()
        with contextlib.ExitStack() as children:
            self._all(waiting, children)
        return not waiting

    def _all(self, waiting, children):
        running = []
        while waiting or running:
            while waiting and len(running) < self.jobs and self._affords(running):
                point = waiting.pop(0)
                children.enter_context(point.processes)
                running.append(Work(point))
            if not running:
                self.say(f"the budget is used up: {len(waiting)} points were not run")
                return
            for work in list(running):
                if not work.goes_on():
                    running.remove(work)
                    self._end(work, waiting + [one.point for one in running])
            time.sleep(0.05)

    def _affords(self, running):
        if self.budget is None:
            return True
        usual = usual_seconds(self.table.points)
        open_ends = sum(max(expected_seconds([work.point], usual), time.monotonic() - work.began) for work in running)
        return self.spent + open_ends < self.budget

    def _write(self, left):
        self.table.write([point.known_line() for point in left if point.known])

    def _take(self, result):
        self.table.points.append(result)
        self.spent += sum(result["seconds"].values())

    def _end(self, work, left):
        with open(work.point.stored, encoding="utf-8") as file:
            result = json.load(file)
        self.spent -= sum(work.point.before.values())  # it is in the result, too
        self._take(result)
        self._write(left)
        failed = sum(one["status"] == "failed" for one in self.table.points)
        parts = sum(one["status"] == "part" for one in self.table.points)
        took = result["seconds"]
        self.say(f"point {result['label']}: {result['status']} (plates and press {took['tests']:.0f} s, wheels "
                 f"{took['wheels']:.0f} s); {len(self.table.points)}/{self.total} points, {failed} failed, "
                 f"{parts} in part; ETA {self._eta(left)}")
        if self.tell:
            self.tell(len(self.table.points) / self.total, self._seconds_left(left),
                      f"{len(self.table.points)} of {self.total} points")
        for reason in result["reasons"]:
            self.say(f"point {result['label']}: {reason}")

    def _seconds_left(self, left):
        seconds = expected_seconds(left, usual_seconds(self.table.points)) / self.jobs
        if self.budget is not None:
            seconds = min(seconds, max(0.0, self.budget - self.spent) / self.jobs)
        return seconds

    def _eta(self, left):
        seconds = self._seconds_left(left)
        return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


