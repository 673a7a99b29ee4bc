"""Runs the points of a design, a few at once, within a budget; keeps what they gave in one table."""

import contextlib
import json
import time

from experiment_runs import Refused
from point import Point
from processes import write_atomically

VERSION = 1


class Table:
    """design.json: all that the inference needs of the runs."""

    def __init__(self, path, head):
        """head: what the table says before its points."""
        self.path, self.head, self.points = path, head, []

    def write(self):
        points = sorted(self.points, key=lambda one: (one["label"][0] != "s", one["label"]))
        lines = [json.dumps(key) + ": " + json.dumps(value) for key, value in {"version": VERSION, **self.head}.items()]
        lines.append('"points": [' + ",".join("\n" + json.dumps(one) for one in points) + "\n]")
        write_atomically(self.path, "{" + ",\n".join(lines) + "}\n")


def read_table(path):
    """As design.json has it. Refused: what, where, expected."""
    try:
        with open(path, encoding="utf-8") as file:
            table = json.load(file)
        version = table["version"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Refused(f"{path}: {type(error).__name__} {error}, expected the design.json of ./grouser calibrate grains"
                      ) from None
    if version != VERSION:
        raise Refused(f"{path}: version {version}, expected {VERSION}")
    return table


def labelled(kind, points):
    return [(f"{kind}{k:03d}", values) for k, values in enumerate(points, 1)]


class Work:
    """One point at work: its generator, and the child that it waits for."""

    def __init__(self, point):
        self.point, self.steps, self.began = point, point.work(), time.monotonic()
        self.child = next(self.steps, None)

    def goes_on(self):
        """False at its end."""
        while self.child is not None and self.child.poll() is not None:
            self.child = next(self.steps, None)
        return self.child is not None


class Runner:
    """Runs points, `jobs` at once, none beside its own process. hours: of wall time for the whole design, what
    earlier calls took counted once for each point; none: no end."""

    def __init__(self, setting, table, jobs, hours, say):
        self.setting, self.table, self.jobs, self.say = setting, table, jobs, say
        self.budget = None if hours is None else 3600 * hours * jobs
        self.spent = 0.0

    def run(self, labelled_points):
        """Whether all were run. Those whose result is kept are not run again."""
        waiting = []
        for label, values in labelled_points:
            point = Point(label, values, self.setting)
            kept = point.finished()
            if kept:
                self._take(kept)
            else:
                waiting.append(point)
        self.table.write()
        self.total = len(labelled_points)
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
                    self._end(work, len(waiting) + len(running))
            time.sleep(0.05)

    def _affords(self, running):
        if self.budget is None:
            return True
        usual = self._usual()
        open_ends = sum(max(usual, time.monotonic() - work.began) for work in running)
        return self.spent + open_ends < self.budget

    def _usual(self):
        done = [sum(one["seconds"].values()) for one in self.table.points]
        return sum(done) / len(done) if done else 0.0

    def _take(self, result):
        self.table.points.append(result)
        self.spent += sum(result["seconds"].values())

    def _end(self, work, left):
        with open(work.point.stored, encoding="utf-8") as file:
            result = json.load(file)
        self._take(result)
        self.table.write()
        failed = sum(one["status"] == "failed" for one in self.table.points)
        parts = sum(one["status"] == "part" for one in self.table.points)
        took = result["seconds"]
        self.say(f"point {result['label']}: {result['status']} (plates and press {took['tests']:.0f} s, wheels "
                 f"{took['wheels']:.0f} s); {len(self.table.points)}/{self.total} points, {failed} failed, "
                 f"{parts} in part; {self._usual() / 60:.1f} minutes of a core each; ETA {self._eta(left)}")
        for reason in result["reasons"]:
            self.say(f"point {result['label']}: {reason}")

    def _eta(self, left):
        seconds = left * self._usual() / self.jobs
        if self.budget is not None:
            seconds = min(seconds, max(0.0, self.budget - self.spent) / self.jobs)
        return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


