"""The stages of the demo, in order. Each uses the programs as anybody would,
reads their --json, and fails by exception."""

import collections
import glob
import json
import math
import os
import shutil

import mission
import refinement
import report
from demo_context import expect
from processes import wait_for_file, write_atomically
from records import NEAR_SLIP, OUTPUTS, Run, number

MODEL_NAME = "demo"
MIN_RUNS, MIN_ANGLES, MIN_HELD_OUT = 12, 3, 3
VEHICLES = os.path.join(mission.ROOT, "surrogate", "vehicle", "shipped")
QUERIED = {"slip": 0.2, "angle_deg": 30.0}


def campaign(demo):
    """DEM wheel tests; those already finished are kept."""
    arguments = demo.arguments
    status = demo.run_json("campaign", "grouser-dem", "campaign", "run", arguments.campaign, "--out",
                           demo.path("campaign"), "--jobs", arguments.jobs, show=True)
    expect(int(status["done"]) == int(status["total"]), f"campaign is incomplete: {status}")
    demo.print(demo.run("campaign", "grouser-dem", "campaign", "list", demo.path("campaign")))
    rows = demo.run_json("campaign", "grouser-dem", "campaign", "list", demo.path("campaign"))
    records = {record["run_id"]: record for record in demo.show_runs(
        *(demo.path("campaign", "runs", row["file"]) for row in rows))}
    demo.data["runs"] = [{"role": row["role"], "record": records[row["run_id"]]} for row in rows]
    runs = demo.runs = [Run(records[row["run_id"]], row["role"]) for row in rows]
    steady = [run for run in runs if run.steady]
    train = [run for run in steady if run.role == "train"]
    angles = {round(run.angle_deg) for run in train}
    expect(len(train) >= MIN_RUNS and len(angles) >= MIN_ANGLES,
           f"{len(train)} steady training runs over {len(angles)} attack angles, "
           f"expected {MIN_RUNS} over {MIN_ANGLES}")
    held_out = sum(run.role == "test" for run in steady)
    expect(held_out >= MIN_HELD_OUT, f"{held_out} steady held-out runs, expected {MIN_HELD_OUT}")
    demo.load_n = collections.Counter(run.load_n for run in train).most_common(1)[0][0]
    demo.data["load_n"] = demo.load_n


def fit(demo):
    os.makedirs(demo.path("model"), exist_ok=True)
    demo.model_file = demo.path("model", MODEL_NAME + ".model")
    demo.print(demo.run("fit", "grouser-fit", "fit", "--runs", demo.path("campaign"), "--name", MODEL_NAME,
                        "--out", demo.model_file, "--measured", demo.arguments.measured))
    model = demo.data["model"] = demo.run_json("fit", "grouser-fit", "show", demo.model_file)["model"]
    demo.data["version"] = model["provenance"]["grouser_version"]
    demo.data["interval_level"] = number(model["interval_level"])


def compare(demo):
    """DEM, surrogate with interval, and measurement in one table."""
    argv = ("grouser-fit", "compare", demo.model_file, "--measured", demo.arguments.measured,
            "--runs", demo.path("campaign"))
    demo.print(demo.run("compare", *argv))
    demo.data["compare"] = demo.run_json("compare", *argv)
    expect(demo.data["compare"]["rows"], "no measured point was compared")


def serve(demo):
    """Server and jobs on free loopback ports, with a state folder of their own."""
    state = demo.path("state")
    os.makedirs(state)
    tiles = demo.path("campaign", "tiles")
    if os.path.isdir(tiles):  # settled beds, named by hash: no need to settle them again
        shutil.copytree(tiles, os.path.join(state, "tiles"))
    demo.lcm_url = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0"
    common = ["--state", state, "--shipped", demo.path("model"), "--grpc", "127.0.0.1:0"]
    programs = {"server": ["--lcm-url", demo.lcm_url, "--vehicles", VEHICLES], "jobs": ["--bin", demo.arguments.bin]}
    for name, extra in programs.items():
        port_file = os.path.join(state, name + ".port")
        child = demo.processes.start(name, [demo.program("grouser-" + name), *common, *extra,
                                            "--port-file", port_file])
        demo.services[name] = child
        address = wait_for_file(port_file, child, "grouser-" + name)
        demo.addresses += ["--" + name, address.removeprefix("grpc=")]


def query(demo):
    """The same state over gRPC and LCM, then what the report draws."""
    state = dict(QUERIED, load=demo.load_n)
    demo.print(demo.client("query", *demo.state_options(state)))
    answer = demo.query([state])
    expect_same_over_lcm(demo, answer)
    domain = demo.data["model"]["domain"]
    train = [run for run in demo.runs if run.steady and run.role == "train" and run.load_n == demo.load_n]
    angles = sorted({round(run.angle_deg) for run in train})
    slips = slips_of_many_angles(train)
    low, high = number(domain["slip_min"]), number(domain["slip_max"])
    widest = math.degrees(number(domain["attack_angle_max_rad"]))
    steps = [i / 40 for i in range(41)]
    demo.data["curves_over_slip"] = {
        angle: demo.query([{"slip": low + (high - low) * t, "angle_deg": angle, "load": demo.load_n}
                           for t in steps])["responses"] for angle in angles}
    demo.data["curves_over_angle"] = {
        slip: demo.query([{"slip": slip, "angle_deg": widest * t, "load": demo.load_n}
                          for t in steps])["responses"] for slip in sorted(slips)}
    held_out = [run for run in demo.runs if run.steady and run.role == "test"]
    demo.data["held_out"] = {
        "run_ids": [run.run_id for run in held_out],
        "responses": demo.query([{"slip": run.slip, "angle_deg": run.angle_deg, "load": run.load_n}
                                 for run in held_out])["responses"]}


def slips_of_many_angles(train, count=3, apart=0.25):
    """Slips near which there are runs at the most attack angles."""
    def angles_near(slip):
        return len({round(run.angle_deg) for run in train if abs(run.slip - slip) <= NEAR_SLIP})

    chosen = []
    for slip in sorted({round(run.slip, 2) for run in train}, key=angles_near, reverse=True):
        if len(chosen) < count and all(abs(slip - other) >= apart for other in chosen):
            chosen.append(slip)
    return chosen


def expect_same_over_lcm(demo, answer):
    over_lcm = demo.lcm_query(answer["responses"]["velocity"], demo.load_n)
    expect(over_lcm["model"] == answer["model"], f"LCM answered with model {over_lcm['model']!r}")
    for output in OUTPUTS:
        for field in ("value", "low", "high"):
            pair = [number(form["responses"][output][field][0]) for form in (answer, over_lcm)]
            expect(pair[0] == pair[1], f"{output}.{field}: {pair[0]} over gRPC, {pair[1]} over LCM")


def latency(demo):
    """Of a server of its own, beside an echo: --no-lcm, for lo may carry no multicast."""
    argv = ("grouser-bench", "server", "--no-lcm", "--starts", 1, "--seconds", 10)
    rows = demo.data["latency"] = demo.run_json("latency", *argv)["rows"]
    for row in rows:
        demo.print(f"{row['transport']:12} {row['states']:6} states, {row['fields']:8}: "
                   f"p50 {row['p50']['server_us']:9.1f} us, p99 {row['p99']['server_us']:9.1f} us, "
                   f"p50 {row['p50']['ratio']:.2f} times an echo's\n")
    expect({row["transport"] for row in rows} >= {"tcp unary", "unix stream"}, "not every transport was measured")


def stop(demo):
    """Both end by SIGTERM with exit code 0 and leave no file half written."""
    for name, child in demo.services.items():
        code = demo.processes.stop(child)
        expect(code == 0, f"grouser-{name} ended with {code} on SIGTERM:\n{demo.processes.log_tail(name)}")
    left = [path for path in glob.glob(demo.path("**", "*"), recursive=True)
            if path.endswith((".tmp", ".aside")) or ".tmp" in os.path.basename(path)]
    expect(not left, f"half-written files were left: {left}")


def write_report(demo):
    write_atomically(demo.path("data.json"), json.dumps(demo.data))
    write_atomically(demo.path("report.html"), report.render(demo.data))


STAGES = (
    ("campaign", campaign),
    ("fit", fit),
    ("compare", compare),
    ("serve", serve),
    ("query", query),
    ("latency", latency),
    ("refinement", refinement.refine),
    ("mission", mission.mission),
    ("stop", stop),
    ("report", write_report),
)
