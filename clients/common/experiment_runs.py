"""Runs of experiment files: plans, their execution, the record of the run file and the CSVs beside it."""

import fcntl
import functools
import hashlib
import json
import os
import re
import subprocess
import sys
import time

import numpy
import yaml

from processes import ProgramFailed

ENDING = ".run.h5"


class Refused(Exception):
    """Bad usage, in words."""


class Plan:
    """One run: a name, an experiment file and what is put over it."""

    def __init__(self, name, file, sets):
        self.name = name
        self.file = file
        self.sets = [f"{key}={text_of(value)}" for key, value in sets.items()]

    def options(self):
        return [word for text in self.sets for word in ("--set", text)]

    def is_done_in(self, record, engine):
        """Whether a record is of this experiment text, overrides and further files, by this engine version."""
        if record is None or record["status"] != "RUN_STATUS_DONE":
            return False
        if record.get("numerics", {}).get("engine_version") != engine:
            return False
        spec = record.get("experiment_spec") or {}
        with open(self.file, encoding="utf-8") as file:
            text = file.read()
        hashes = {one.split(" ")[0] for one in spec.get("others", [])}
        return (spec.get("yaml") == text and spec.get("sets") == self.sets
                and hashes == hashes_of_others([text, *self.set_texts()], os.path.dirname(self.file)))

    def set_texts(self):
        """What is put over the file, as YAML mappings of the last part of the key."""
        pairs = (one.split("=", 1) for one in self.sets)
        return [f"{key.rsplit('.', 1)[-1].split('[')[0]}: {value}" for key, value in pairs]


def text_of(value):
    """A value as --set takes it."""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, list):
        return "[" + ", ".join(text_of(one) for one in value) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {text_of(one)}" for key, one in value.items()) + "}"
    return str(value)


def hashes_of_others(texts, folder):
    """SHA-256 of the files that the parts of an experiment name (key `file`), from its folder."""
    found = set()

    def look(node):
        if isinstance(node, list):
            for one in node:
                look(one)
        elif isinstance(node, dict):
            for key, value in node.items():
                if key == "file" and isinstance(value, str):
                    path = os.path.join(folder, value)
                    if os.path.exists(path):
                        with open(path, "rb") as file:
                            found.add(hashlib.sha256(file.read()).hexdigest())
                else:
                    look(value)

    for text in texts:
        look(yaml.safe_load(text))
    return found


def check_plans(program, plans):
    """The engine reads every plan before the first one starts. Raises Refused with what it says."""
    for plan in plans:
        done = subprocess.run([program, "check", plan.file, *plan.options()], stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, check=False)
        if done.returncode != 0:
            raise Refused(f"run {plan.name}: {done.stderr.strip()}")


@functools.lru_cache(maxsize=None)
def engine_of(program):
    """Engine version of grouser-dem, as its runs have it in numerics.engine_version."""
    shown = subprocess.run([program, "--version"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                           stdin=subprocess.DEVNULL, text=True, check=False)
    found = re.search(r"\(engine ([^,)]+)", shown.stdout)
    if shown.returncode != 0 or not found:
        raise ProgramFailed(f"{program} --version: got '{(shown.stdout + shown.stderr).strip()}', expected "
                            "'grouser-dem VERSION (engine N, ...)'")
    return found[1]


def record_of(program, path):
    """The record of a run file; None where there is none that can be read."""
    if not os.path.exists(path):
        return None
    shown = subprocess.run([program, "show", "--json", path], stdout=subprocess.PIPE,
                           stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, check=False)
    return json.loads(shown.stdout)[0] if shown.returncode == 0 else None


class Result:
    """A run that has a record. `series` and other tables: arrays by column."""

    def __init__(self, plan, stem, record):
        self.plan = plan
        self.stem = stem
        self.record = record
        self._tables = {}

    @property
    def done(self):
        return self.record["status"] == "RUN_STATUS_DONE"

    @property
    def reason(self):
        return self.record.get("reason", "")

    @property
    def numerics(self):
        return self.record["numerics"]

    def table(self, name):
        """{column: array} of NAME.csv; rows that a kill cut short are left out."""
        if name not in self._tables:
            self._tables[name] = read_csv(f"{self.stem}.{name}.csv")
        return self._tables[name]

    @property
    def series(self):
        return self.table("series")


def read_csv(path):
    with open(path, encoding="utf-8") as file:
        columns = file.readline().strip().split(",")
        rows = [row for row in (line.strip().split(",") for line in file)
                if len(row) == len(columns)]
    values = numpy.array(rows, dtype=float).reshape(len(rows), len(columns))
    return {name: values[:, k] for k, name in enumerate(columns)}


class Execution:
    """Runs of experiments in FOLDER/runs: those that are done are kept, the others run, `jobs` at once."""

    def __init__(self, folder, program, jobs, processes, say):
        self.folder, self.program, self.jobs, self.processes = folder, program, jobs, processes
        self.say = say
        os.makedirs(os.path.join(folder, "runs"), exist_ok=True)

    def stem(self, plan):
        return os.path.join(self.folder, "runs", plan.name)

    def is_done(self, plan):
        return plan.is_done_in(record_of(self.program, self.stem(plan) + ENDING), engine_of(self.program))

    def start(self, plan):
        path = self.stem(plan) + ENDING
        if os.path.exists(path):
            os.unlink(path)  # its CSVs are about to be written anew
        log = self.processes.log_path(plan.name)
        if os.path.exists(log):
            os.unlink(log)
        return self.processes.start(plan.name, [self.program, "run", plan.file, *plan.options(),
                                                "--out", path])

    def run(self, plans):
        """{name: Result} in the order of the plans. Raises ProgramFailed for a run without a
        record, once those in flight have ended."""
        records = {plan.name: record_of(self.program, self.stem(plan) + ENDING) for plan in plans}
        waiting = [plan for plan in plans if not plan.is_done_in(records[plan.name], engine_of(self.program))]
        self.say(f"{len(plans)} runs, {len(plans) - len(waiting)} of them done before")
        running, broken = {}, []
        while waiting and not broken or running:
            while waiting and not broken and len(running) < self.jobs:
                plan = waiting.pop(0)
                self.say(f"run {plan.name}")
                running[plan.name] = (plan, self.start(plan), time.monotonic())
            time.sleep(0.05)
            for name, (plan, child, started) in list(running.items()):
                if child.poll() is None:
                    continue
                del running[name]
                self.processes.stop(child)
                records[name] = record_of(self.program, self.stem(plan) + ENDING)
                if child.returncode != 0 or records[name] is None:
                    broken.append(f"run {name} ended with {child.returncode}:\n"
                                  + self.processes.log_tail(name))
                    continue
                status = records[name]["status"].replace("RUN_STATUS_", "")
                self.say(f"run {name}: {status} {records[name].get('reason', '')}"
                         f"({time.monotonic() - started:.1f} s)")
        if broken:
            raise ProgramFailed("\n".join(broken))
        return {plan.name: Result(plan, self.stem(plan), records[plan.name]) for plan in plans}


def run_or_refuse(processes, name, argv, **options):
    """Processes.run; what the program calls bad input (exit code 2) raises Refused with its words."""
    try:
        return processes.run(name, argv, **options)
    except ProgramFailed as error:
        if error.exit_code == 2:
            raise Refused(str(error)) from None
        raise


def read_kept(path, kinds, origin="what an earlier call has kept"):
    """A mapping that an earlier call has kept as JSON; none where there is no file. kinds: {key: type or types}
    that it must have. Refused: what, where, expected, of which origin."""
    if not os.path.exists(path):
        return None
    try:
        with open(path, encoding="utf-8") as file:
            kept = json.load(file)
    except (OSError, ValueError) as error:
        raise Refused(f"{path}: {type(error).__name__} {error}, expected {origin}") from None
    words = {dict: "a mapping", list: "a list", str: "a text", int: "a whole number", (int, float): "a number"}
    if not isinstance(kept, dict):
        raise Refused(f"{path}: got no mapping, expected {origin} with {', '.join(kinds)}")
    for key, kind in kinds.items():
        if not isinstance(kept.get(key), kind):
            raise Refused(f"{path}: {key}: got {repr(kept.get(key))[:60]}, expected {words[kind]}: {origin}")
    return kept


def lock_of(out, wait_s=10):
    """The runs share it: those of a call that was killed get `wait_s` to end. Raises ProgramFailed: what holds it will
    end, and the same call may go on then."""
    os.makedirs(out, exist_ok=True)
    lock = open(os.path.join(out, ".lock"), "w", encoding="utf-8")
    last = time.monotonic() + wait_s
    told = False
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return lock
        except BlockingIOError:
            if time.monotonic() > last:
                raise ProgramFailed(f"--out {out}: another call is running there, waited {wait_s:g} s for its "
                                    "end") from None
            if not told:
                print(f"--out {out}: another call is running there; waiting for its end, {wait_s:g} s at most",
                      file=sys.stderr, flush=True)
            told = True
            time.sleep(0.1)
