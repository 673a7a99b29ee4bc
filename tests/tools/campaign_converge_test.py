#!/usr/bin/python3
"""./grouser campaign converge: real runs of a toy scene, all variants; the same call again
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


def window_campaign(folder):
    """The toy scene with a window and all switches, its soil in a file of its own, numbers that PyYAML takes for text."""
    scene = yaml.load((ROOT / "dem_offline" / "campaigns" / "smoke.scene.yaml").read_text(), Loader=yaml.BaseLoader)
    (folder / "toy.soil.yaml").write_text(yaml.safe_dump(scene.pop("soil")))
    scene["soil"] = "toy.soil.yaml"
    scene["rig"] |= {"bed_width_m": "9e-2", "scene": "SWITCHES"}
    text = yaml.safe_dump(scene, sort_keys=False)
    (folder / "toy.scene.yaml").write_text(text.replace("SWITCHES", "{bed: window, freeze: on, largest_step: on}"))
    (folder / "toy.campaign.yaml").write_text("name: toy\nscene: toy.scene.yaml\nseeds: [1]\n")
    return str(folder / "toy.campaign.yaml")


def check_runs(folder):
    out = folder / "out"
    call = (window_campaign(folder), "--at", "0,0,1.5", "--beds", "1", "--out", str(out))
    done = converge(*call, "--json")
    expect(done.returncode == 0, done.stderr)
    rows = {row["variant"]: row for row in json.loads(done.stdout)["rows"]}
    names = ("as_it_is", "half_step", "double_width", "double_window")
    expect(tuple(rows) == names, f"variants {tuple(rows)}")
    base, half, box, window = (records(out / name)[0] for name in names)
    ratio = half["numerics"]["dt_s"] / base["numerics"]["dt_s"]
    expect(abs(ratio - 0.5) < 1e-6, f"step over step {ratio}")
    rigs = [one["spec"]["rig"] for one in (base, box, window)]
    for key, factor in (("bed_length_m", 1), ("bed_width_m", 2), ("bed_depth_m", 1)):
        expect(abs(rigs[1][key] - factor * rigs[0][key]) < 1e-12, key)
    expect(rigs[2]["scene"]["window_length_m"] > 0 and rigs[2]["scene"]["freeze"], "a longer window")
    grains = [float(n["particle_steps"]) / float(n["steps"]) for n in (base["numerics"], window["numerics"])]
    expect(grains[1] > 1.5 * grains[0], f"grains {grains}")
    for name, one in (("half_step", half), ("double_width", box), ("double_window", window)):
        mean, got = one["outputs"][0]["mean"], rows[name]["f_x"]["value"]
        expect(abs(got - (mean - rows["as_it_is"]["f_x"]["value"])) < 1e-5 * abs(mean) + 1e-6, f"{name}: {got}")
        expect(rows[name]["f_x"]["standard_error"] > rows["as_it_is"]["f_x"]["standard_error"] > 0, "errors add up")
    before = {path: path.stat().st_mtime_ns for path in out.glob("*/runs/runs/*.run.h5")}
    again = converge(*call)
    expect(again.returncode == 0 and "| slip 0, 0 deg, 1.5 N | as it is | 1 |" in again.stdout, again.stdout)
    after = {path: path.stat().st_mtime_ns for path in out.glob("*/runs/runs/*.run.h5")}
    expect(before == after and len(before) == 4, "nothing runs twice")


def check_refusals(folder):
    scene = folder / "c.campaign.yaml"
    scene.write_text("name: c\nscene: none.yaml\n")
    words = folder / "words.campaign.yaml"
    words.write_text(f"name: c\nscene: {ROOT}/dem_offline/campaigns/smoke.scene.yaml\nextra:\n"
                     + 3 * "  - {slip: much, attack_angle_deg: 0, load_n: 1}\n")
    for arguments, what in {(SMOKE,): "0 driven states in `extra`, expected 3",
                            (SMOKE, "--at", "0.3,0"): "expected SLIP,ANGLE_DEG,LOAD_N",
                            (SMOKE, "--beds", "0"): "--beds 0: expected at least 1",
                            (str(scene),): "none.yaml: No such file or directory",
                            (str(words),): "extra: slip: got 'much', expected a number",
                            (str(folder / "gone"),): "gone: No such file or directory"}.items():
        done = converge(*arguments, "--out", str(folder / "refused"))
        expect(done.returncode == 2 and what in done.stderr and "Traceback" not in done.stderr,
               f"{arguments}: {done.returncode} {done.stderr}")


with tempfile.TemporaryDirectory() as name:
    check_refusals(pathlib.Path(name))
    check_runs(pathlib.Path(name))
