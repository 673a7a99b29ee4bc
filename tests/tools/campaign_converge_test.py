#!/usr/bin/python3
"""./grouser campaign converge: real runs of a toy scene with half the step and a larger bed; the same call again
runs nothing; clear refusals. Usage: campaign_converge_test.py ROOT FOLDER-OF-PROGRAMS"""

import json
import pathlib
import subprocess
import sys
import tempfile

import yaml

ROOT, BIN = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
SMOKE = str(ROOT / "dem_offline" / "campaigns" / "smoke.campaign.yaml")


def converge(*arguments):
    return subprocess.run([sys.executable, str(ROOT / "dem_offline" / "convergence" / "converge.py"), "--bin", str(BIN),
                           *arguments], capture_output=True, text=True, check=False)


def expect(condition, what):
    if not condition:
        sys.exit(f"failed: {what}")


def records(folder):
    files = sorted((folder / "runs" / "runs").glob("*.run.h5"))
    shown = subprocess.run([BIN / "grouser-dem", "show", "--json", *files], capture_output=True, check=True).stdout
    return json.loads(shown)


def check_runs(out):
    call = (SMOKE, "--at", "0.3,0,1.5", "--beds", "1", "--out", str(out))
    done = converge(*call, "--json")
    expect(done.returncode == 0, done.stderr)
    rows = {row["variant"]: row for row in json.loads(done.stdout)["rows"]}
    expect(set(rows) == {"as_it_is", "half_step", "double_box"}, f"variants {set(rows)}: the scene has no window")
    base, half, box = (records(out / name)[0] for name in ("as_it_is", "half_step", "double_box"))
    ratio = half["numerics"]["dt_s"] / base["numerics"]["dt_s"]
    expect(abs(ratio - 0.5) < 1e-6, f"step over step {ratio}")
    rigs = [yaml.safe_load((out / name / "variant.scene.yaml").read_text())["rig"]
            for name in ("as_it_is", "double_box")]
    for key, factor in (("bed_length_m", 2), ("bed_width_m", 2), ("bed_depth_m", 1)):
        expect(abs(rigs[1][key] - factor * rigs[0][key]) < 1e-12, key)
    means = {name: one["outputs"][0]["mean"] for name, one in (("half_step", half), ("double_box", box))}
    for name, mean in means.items():
        got = rows[name]["f_x"]["value"]
        expect(abs(got - (mean - rows["as_it_is"]["f_x"]["value"])) < 1e-5 * abs(mean), f"{name}: {got}")
        expect(rows[name]["f_x"]["standard_error"] > rows["as_it_is"]["f_x"]["standard_error"] > 0, "errors add up")
    before = {path: path.stat().st_mtime_ns for path in out.glob("*/runs/runs/*.run.h5")}
    again = converge(*call)
    expect(again.returncode == 0 and "| slip 0.3, 0 deg, 1.5 N | as it is | 1 |" in again.stdout, again.stdout)
    after = {path: path.stat().st_mtime_ns for path in out.glob("*/runs/runs/*.run.h5")}
    expect(before == after and len(before) == 3, "nothing runs twice")


def check_refusals(folder):
    scene = folder / "c.campaign.yaml"
    scene.write_text("name: c\nscene: none.yaml\n")
    for arguments, what in {(SMOKE,): "0 driven states in `extra`, expected 3",
                            (SMOKE, "--at", "0.3,0"): "expected SLIP,ANGLE_DEG,LOAD_N",
                            (SMOKE, "--beds", "0"): "--beds 0: expected at least 1",
                            (str(scene),): "none.yaml: [Errno 2]",
                            (str(folder / "gone"),): "gone: [Errno 2]"}.items():
        done = converge(*arguments, "--out", str(folder / "refused"))
        expect(done.returncode == 2 and what in done.stderr and "Traceback" not in done.stderr,
               f"{arguments}: {done.returncode} {done.stderr}")


with tempfile.TemporaryDirectory() as name:
    check_refusals(pathlib.Path(name))
    check_runs(pathlib.Path(name) / "out")
