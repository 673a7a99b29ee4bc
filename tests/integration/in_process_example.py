#!/usr/bin/python3
"""Installs the package `grouser` and uses it as a stranger would: the example
planner is configured with that prefix alone, built and run, and its numbers are
read. Usage: in_process_example.py CMAKE BUILD_DIR EXAMPLE_DIR WORK_DIR"""

import math
import os
import pathlib
import re
import shutil
import subprocess
import sys

CYCLE = re.compile(
    r"cycle +(\d+): (\d+) states in (\S+) ms \((\S+) states/s, (\S+) ns/state, (\S+) % in the "
    r"model\), plan cost (\S+), mean (\S+), best (\S+), samples (\S+), left (\S+) right (\S+) m/s, "
    r"(\S+) m off the path")
WHEELS, ROLLOUTS, STEPS, CYCLES = 4, 512, 20, 10  # of --small --cycles 10
OUTSIDE = ("CMAKE_PREFIX_PATH", "CMAKE_MODULE_PATH", "grouser_DIR", "grouser_ROOT",
           "LD_LIBRARY_PATH", "CPATH", "CPLUS_INCLUDE_PATH", "LIBRARY_PATH")


def run(*command):
    """Output of a command that must succeed, in an environment that knows no other Grouser."""
    environment = {k: v for k, v in os.environ.items() if k not in OUTSIDE}
    result = subprocess.run([str(c) for c in command], text=True, env=environment, check=False,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit code {result.returncode}\n{result.stdout}")
    return result.stdout


def check_package(prefix):
    """What is installed, and that nothing of protobuf shows in it."""
    files = sorted(str(f.relative_to(prefix)) for f in prefix.rglob("*") if f.is_file())
    print("\n".join(files))
    expected = r"(include/grouser/(chrono|contact|map|mavs|model|model_selector|timed_wheel|vehicle|vti)\.h|lib/(\S+/)?libgrouser_model\.so[\d.]*" \
               r"|lib/(\S+/)?cmake/grouser/\S+\.cmake|share/grouser/models/\S+\.model|share/grouser/vehicles/\S+\.(vehicle\.yaml|model)|share/doc/grouser/(LICENSE|NOTICE))"
    foreign = [f for f in files if not re.fullmatch(expected, f)]
    assert not foreign, f"installed, but not of the component: {foreign}"
    # All but chrono.h and mavs.h, which include their simulators' headers.
    for name in ("contact.h", "map.h", "model.h", "model_selector.h", "timed_wheel.h", "vehicle.h", "vti.h"):
        headers = re.findall(r"#include\s+(.*)", (prefix / "include/grouser" / name).read_text())
        own = "|\"grouser/(contact|model|vehicle).h\"" if name != "model.h" else ""
        assert all(re.fullmatch(r"<[a-z]+>" + own, h) for h in headers), f"not C++20: {headers}"


def check_output(text):
    """The example's numbers: finite, of the right size, and the cost fell."""
    rows = [[float(x) for x in match] for match in CYCLE.findall(text)]
    assert [row[0] for row in rows] == list(range(1, CYCLES + 1)), "not all cycles were printed"
    for row in rows:
        assert all(math.isfinite(x) for x in row), f"not finite: {row}"
        _, states, _, rate, per_state, share, plan, mean, best, samples, left, right, off = row
        assert states == WHEELS * ROLLOUTS * STEPS, f"{states} states"
        assert rate > 0 and abs(rate * per_state * 1e-9 - 1) < 0.05, "rates disagree"
        assert 0 < share <= 101, f"{share} % of the time in the model"
        assert best <= plan < 1000 and best <= mean < 1000, f"costs: {row}"
        assert 1 <= samples <= ROLLOUTS and left > 0 and right > 0 and 0 <= off < 1, f"{row}"
    first, last = rows[0], rows[-1]
    assert last[6] < 0.6 * first[6], f"plan cost: first {first[6]}, last {last[6]}"
    assert last[12] < first[12], "the rover did not come nearer to the path"
    assert max(row[11] - row[10] for row in rows) > 0.01, "it never turned left, towards the path"


def check_vehicles(prefix, app):
    """The examples of vehicle.h, with every vehicle that is installed."""
    vehicles = sorted((prefix / "share/grouser/vehicles").glob("*.vehicle.yaml"))
    assert len(vehicles) >= 5, f"vehicles: {vehicles}"
    for vehicle in vehicles:
        text = run(app / "energy_example", vehicle)
        assert len(re.findall(r"J/m", text)) == 5, text
    speeds = [float(x) for x in re.findall(r" m +(\S+) m/s", run(app / "speed_example"))]
    assert len(speeds) == 200 and speeds[0] == 0 and 0.5 < max(speeds) <= 1.5, f"{speeds}"
    husky = prefix / "share/grouser/vehicles/husky.vehicle.yaml"
    driven, cells = re.search(r"(\d+) of (\d+) cells", run(app / "map_example", husky, 50)).groups()
    assert 0 < int(driven) <= int(cells) == 2500, f"{driven} of {cells}"
    for name, bad, word in (("speed_example", "-1", "speed_limit"), ("energy_example", "nan", "sds")):
        result = subprocess.run([app / name, vehicles[0], bad], text=True, capture_output=True, check=False)
        assert result.returncode == 1 and word in result.stderr and not result.stdout, f"{result}"


def check_lines(source):
    """Code of a map user's own, without comments and empty lines: 20 at most (docs/maps.md)."""
    lines = [line.strip() for line in source.read_text().splitlines()]
    own = [line for line in lines if line and not line.startswith("//")]
    assert len(own) <= 20, f"{source}: {len(own)} lines of code"


def check_refusal(program, work):
    """A bad model file is named, with exit code 1."""
    bad = work / "bad.model"
    bad.write_text("no model")
    result = subprocess.run([program, "--model", bad], text=True, capture_output=True, check=False)
    assert result.returncode == 1 and str(bad) in result.stderr, f"{result}"


def main(arguments):
    if len(arguments) != 4:
        print(__doc__, file=sys.stderr)
        return 2
    cmake, build, example, work = arguments[0], *map(pathlib.Path, arguments[1:])
    shutil.rmtree(work, ignore_errors=True)
    prefix, app = work / "prefix", work / "build"
    run(cmake, "--install", build, "--component", "in_process", "--prefix", prefix)
    check_package(prefix)
    run(cmake, "-S", example, "-B", app, f"-DCMAKE_PREFIX_PATH={prefix}",
        "-DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF", "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Werror")
    found = re.search(r"grouser_DIR:PATH=(.*)", (app / "CMakeCache.txt").read_text()).group(1)
    assert pathlib.Path(found).is_relative_to(prefix), f"found another package: {found}"
    run(cmake, "--build", app, "--parallel", "2")
    program = app / "mppi_example"
    text = run(program, "--small", "--cycles", CYCLES, "--threads", 2)
    print(text)
    check_output(text)
    check_refusal(program, work)
    check_vehicles(prefix, app)
    check_lines(example / "map_example.cc")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
