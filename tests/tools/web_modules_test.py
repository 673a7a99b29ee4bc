#!/usr/bin/python3
"""The web page's modules that need no page, in Node.js: they say what the programs say. Explanations, comparisons with
measured rows, refusals of tables and gate checks come from grouser-fit, rasters from libtiff and, where it was built,
from grouser-map. Usage: web_modules_test.py ROOT FOLDER-OF-PROGRAMS. Exit code 77: there is no Node.js."""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

NO_NODE = 77
ROOT, BIN = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
PAIR = ROOT / "surrogate" / "pairs" / "cmu-smooth-62.5-8mm"
# Slip, attack angle [deg], load [N]; runs near each of them lie outside of the model's intervals.
STATES = (("0.3", "75", "40"), ("0.6", "80", "25"), ("-0.3", "-80", "20"))

HEAD = "slip,attack_angle_deg,load_n,f_x_n,f_x_sd\n"
BAD_TABLES = (
    "slip,load_n\n", "slip,attack_angle_deg,load_n,fx\n", "slip,attack_angle_deg,load_n,load_n\n", HEAD, "# nothing\n",
    HEAD + "0.1,0,24,abc,\n", HEAD + "0.1,0,24\n", HEAD + "0.1,0,-4,1,\n", HEAD + "1.7,0,24,1,\n", HEAD + "0.1,0,24,1,-1\n",
    HEAD + '"0.1,0,24,1,1\n', HEAD + "0.1,0,24,5,\n0.1,0.5236,24,5,\n", HEAD + "0.1,30,24,0.005,\n0.2,30,24,0.006,\n",
    HEAD + "0.1,,24,5,\n", HEAD + "0.1,0,24,inf,\n", "slip,attack_angle_deg,load_n,toString\n")


def fit(*arguments):
    return subprocess.run([BIN / "grouser-fit", *map(str, arguments)], capture_output=True, text=True, check=False)


def told(*arguments):
    done = fit(*arguments)
    assert done.returncode in (0, 3), f"{arguments}: {done.stderr}"
    return done.stdout


def explanations():
    """What --json says, and the lines of text that say the same in words."""
    for slip, angle, load in STATES:
        state = [PAIR / "hybrid.model", "--slip", slip, "--angle-deg", angle, "--load", load]
        yield {"explanation": json.loads(told("explain", *state, "--json")), "text": told("explain", *state)}


def bad_tables(folder):
    table = folder / "bad.csv"
    for text in BAD_TABLES:
        table.write_text(text)
        done = fit("compare", PAIR / "hybrid.model", "--measured", table)
        assert done.returncode == 2, f"{text!r} was taken: {done.stdout[:200]}"
        yield {"text": text, "refusal": done.stderr.strip()}


def gate():
    """A candidate that passes some checks and fails others."""
    return json.loads(told("gate", "--base", PAIR / "hybrid.model", "--candidate", PAIR / "lookup.model", "--json"))


def raster(folder, name, cells, **options):
    Image.fromarray(cells).save(folder / name, **options)
    bands = cells if cells.ndim == 3 else cells[..., None]
    expected = [bands[..., i].astype("<f4") for i in range(bands.shape[2])]
    for i, band in enumerate(expected):
        band.tofile(folder / f"{name}.{i}")
    return {"file": str(folder / name), "width": cells.shape[1], "height": cells.shape[0], "bands": len(expected)}


def rasters(folder):
    """By libtiff: strips, plain and deflate, each predictor, numbers of several kinds."""
    random = np.random.default_rng(3)
    heights = (400 + 30 * np.cumsum(random.normal(size=(211, 317)), axis=0)).astype("f4")
    heights[3:9, 4:60] = np.nan
    deflate = {"compression": "tiff_adobe_deflate"}
    yield raster(folder, "plain.tif", heights)
    yield raster(folder, "deflate.tif", heights, **deflate)
    yield raster(folder, "predictor3.tif", heights, **deflate, tiffinfo={317: 3})
    yield raster(folder, "bytes.tif", random.integers(0, 200, (70, 90), dtype="u1"), **deflate, tiffinfo={317: 2})
    yield raster(folder, "three.tif", random.integers(0, 255, (61, 47, 3), dtype="u1"), **deflate, tiffinfo={317: 2})
    yield raster(folder, "integers.tif", random.integers(-9000, 9000, (80, 50), dtype="i4"), **deflate)


def made_map(folder):
    """A map of grouser-map with its own account of it; None where it was not built."""
    if not (BIN / "grouser-map").exists():
        return None
    subprocess.run([ROOT / "surrogate" / "terrain_map" / "example" / "make_terrain.py", folder / "terrain", "--cells", "40"], check=True)
    done = subprocess.run(
        [BIN / "grouser-map", ROOT / "surrogate" / "vehicle" / "shipped" / "husky.vehicle.yaml", "--elevation",
         folder / "terrain" / "elevation.tif", "--soil", "asphalt", "--limit", "0.8", "--no-pictures", "--out", folder / "map"],
        capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return {"folder": str(folder / "map"), "json": json.loads((folder / "map" / "map.json").read_text())}


def main():
    node = shutil.which("node") or shutil.which("nodejs")
    if node is None:
        print("skipped: no Node.js here, which only this test uses (the page itself is tested in a browser: web_page)")
        return NO_NODE
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        for module in (ROOT / "clients" / "web").glob("*.js"):
            shutil.copy(module, folder)
        shutil.copy(pathlib.Path(__file__).with_suffix(".mjs"), folder / "test.js")
        (folder / "package.json").write_text('{"type": "module"}')  # else Node.js takes *.js for CommonJS
        measured = PAIR / "measured.csv"
        cases = {
            "explanations": list(explanations()), "badTables": list(bad_tables(folder)), "gate": gate(),
            "rasters": list(rasters(folder)), "map": made_map(folder), "measured": measured.read_text(),
            "compared": json.loads(told("compare", PAIR / "hybrid.model", "--measured", measured, "--json"))}
        (folder / "cases.json").write_text(json.dumps(cases))
        return subprocess.run([node, "--test", "test.js"], cwd=folder, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
