"""Parts of the web page of grouser-server, for web_page_test.py: where an answer comes from, measured rows, a map."""

import csv
import math
import pathlib
import shlex
import subprocess

import numpy as np
from PIL import Image

PAIR = "surrogate/pairs/cmu-smooth-62.5-8mm"
WHY = "document.querySelector('#why-answer article:nth-child(%d)')"


def check_explain(page, ask, shoot):
    """Opened by keyboard; numbers, reasons and runs are those of `query --explain`."""
    page.run("document.querySelector('#why > summary').focus()")
    page.press("Enter", 13, "\r")
    page.type_into("#state-load", "40")
    page.wait(f"({WHY % 2}?.querySelector('.command')?.textContent ?? '').includes('--load 40')")
    for article in (1, 2):
        shown = page.run(f"{WHY % article}.querySelector('.command').textContent")
        told = ask(*shlex.split(shown)[1:])["explanation"]
        values = page.run(f"Array.from({WHY % article}.querySelectorAll('data'), (one) => [one.dataset.explained, one.value])")
        assert [(name, float(value)) for name, value in values] == [(o["output"], o["value"]) for o in told["outputs"]], values
        text = page.run(f"{WHY % article}.textContent")
        assert told["reasons"] and all(reason["text"] in text for reason in told["reasons"]), f"{told['reasons']}: {text[:500]}"
        hashes = page.run(f"Array.from({WHY % article}.querySelectorAll('.runs code'), (one) => one.title)")
        runs = told["nearest"] + told["held_out"] + told["overloads"]
        assert hashes == [f"run {one['run']['run_id']}, sha256 {one['run']['sha256']}" for one in runs], hashes
        drawn = page.run(f"Array.from({WHY % article}.querySelectorAll('svg.stress'), (svg) => svg.querySelectorAll('path.rim').length)")
        assert len(drawn) == 2 and all(count >= 5 for count in drawn), drawn
    if shoot:
        shoot("explain", "#why", 1150)
        shoot("stress", "#why-answer h4:last-of-type", 440)


def check_measured(page, ask, root, folder, shoot):
    table = pathlib.Path(root, PAIR, "measured.csv")
    page.type_into("#state-load", "22")
    page.choose_file("#measured-file", table)
    count = len([line for line in table.read_text().splitlines() if line[:1] not in ("#", "s")])
    page.wait(f"document.getElementById('measured-note').textContent.startsWith('measured.csv: {count} rows. A smooth rigid wheel')")
    page.wait("document.querySelectorAll('#plot-f_x .measured').length > 0")
    marks = page.run("['f_x', 'torque'].map((key) => ['.measured', '.a .beside', '.b .beside'].map((mark) => "
                     "document.querySelectorAll(`#plot-${key} ${mark}`).length))")
    assert marks[0][0] >= 8 and len(set(marks[0])) == 1 and set(marks[1]) == {0}, marks  # no torque was measured
    shown = page.run("Object.fromEntries(Array.from(document.querySelectorAll('#measured-errors article:nth-child(1) data'), "
                     "(one) => [one.dataset.rms, Number(one.value)]))")
    rows = list(csv.DictReader(line for line in table.read_text().splitlines() if line[0] != "#"))
    listed = [word for option, column in (("--slip", "slip"), ("--angle-deg", "attack_angle_deg"), ("--load", "load_n"))
              for word in (option, *(row[column] for row in rows))]
    answer = ask("query", "--model", page.run("document.querySelector('#model-a').value"), *listed)["responses"]
    for output, column in (("f_x", "f_x_n"), ("f_y", "f_y_n"), ("sinkage", "sinkage_m")):
        off = [value - float(row[column]) for value, row in zip(answer[output]["value"], rows)]
        rms = math.sqrt(sum(one * one for one in off) / len(off))
        assert abs(shown.pop(output) / rms - 1) < 1e-12, output
    assert not shown, shown
    if shoot:
        shoot("measured", "#response-title", 1450)
    page.type_into("#state-load", "40")  # nobody measured there
    page.wait("document.querySelectorAll('#plots .measured').length === 0")
    bad = pathlib.Path(folder, "bad.csv")
    bad.write_text("slip,attack_angle_deg,load_n,f_x_n\n0.1,0,24,abc\n")
    page.choose_file("#measured-file", bad)
    page.wait("document.getElementById('measured-note').textContent === "
              "'bad.csv:2: f_x_n: \"abc\", expected a number. Still shown: measured.csv.'")
    page.run("document.getElementById('measured-clear').click()")
    page.wait("document.querySelectorAll('#measured-errors article').length === 0")
    page.type_into("#state-load", "24")


def check_map(page, folder):
    """A raster of 40 x 30 cells whose values say where they are, with a hole in its first row."""
    cells = (100 * np.arange(30)[:, None] + np.arange(40)).astype("f4")
    cells[0, 3] = np.nan
    path = pathlib.Path(folder, "cells.tif")
    Image.fromarray(cells).save(path, compression="tiff_adobe_deflate", tiffinfo={317: 3})
    value = "document.getElementById('map-value').textContent"
    page.choose_file("#map-file", path)
    page.wait(f"{value} === 'band 1: 1520 at column 20, row 15'")
    assert "40 × 30 cells" in page.run("document.querySelector('#map [role=status]').textContent")
    page.run("document.getElementById('map-canvas').focus()")
    for key, code, text in (("ArrowRight", 39, None), ("ArrowUp", 38, None), ("+", 187, "+")):
        page.press(key, code, text)
    page.wait(f"{value} === 'band 1: 1421 at column 21, row 14'")
    for key, code in [("ArrowUp", 38)] * 14 + [("ArrowLeft", 37)] * 18:
        page.press(key, code)
    page.wait(f"{value} === 'band 1: no data at column 3, row 0'")
    page.press("0", 48, "0")
    # The pointer: the middle of the canvas is the middle of the raster.
    box = page.run("(({x, y, width, height}) => ({x, y, width, height}))(document.getElementById('map-canvas').getBoundingClientRect())")
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=box["x"] + box["width"] / 2 + 2, y=box["y"] + box["height"] / 2 + 2)
    page.wait(f"{value} === 'band 1: 1520 at column 20, row 15'")
    colours = page.run("""(() => { const canvas = document.getElementById('map-canvas');
      const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      return new Set(Array.from({length: data.length / 4}, (_, i) => data.slice(4 * i, 4 * i + 4).join())).size; })()""")
    assert colours > 200, colours
    short = path.with_name("short.tif")
    short.write_bytes(path.read_bytes()[:400])
    page.choose_file("#map-file", short)
    page.wait("document.querySelector('#map [role=status]').textContent.startsWith('short.tif: ends at byte 400')")
    assert page.run("document.querySelector('#map [role=status]').textContent").endswith(". Still shown: cells.tif.")
    page.wait(f"{value} === 'band 1: 1520 at column 20, row 15' && document.getElementById('map-canvas').clientWidth > 0")


def picture_map(page, bin_dir, root, folder, shoot):
    """The map of docs/maps.md, where grouser-map was built."""
    terrain, out = pathlib.Path(folder, "terrain"), pathlib.Path(folder, "map")
    subprocess.run([f"{root}/surrogate/terrain_map/example/make_terrain.py", terrain], check=True)
    subprocess.run([f"{bin_dir}/grouser-map", f"{root}/surrogate/vehicle/shipped/husky.vehicle.yaml", "--elevation", terrain / "elevation.tif",
                    "--soil-class", terrain / "soil.tif", "--soils", "1=asphalt,2=ice", "--limit", "0.8", "--no-pictures", "--out", out],
                   check=True, capture_output=True)
    for name, text in (("binding", "up: "), ("speed", " m/s at column 100, row 100; east 500201 m, north 5299799 m")):
        page.choose_file("#map-file", out / f"{name}.tif")
        page.wait(f"document.querySelector('#map [role=status]').textContent.startsWith('{name}.tif: 200 × 200 cells of 2 m')")
        page.wait(f"document.getElementById('map-value').textContent.includes('{text}')")
        shoot("map" if name == "speed" else "map-binding", "#map-title", 860)


def check(page, ask, bin_dir, root, folder, shoot):
    """`ask` asks the server by the command line; `shoot` takes pictures, or None. Two models are compared, at 30 degrees."""
    check_measured(page, ask, root, folder, shoot)
    check_explain(page, ask, shoot)
    check_map(page, folder)
    if shoot and pathlib.Path(bin_dir, "grouser-map").exists():
        picture_map(page, bin_dir, root, folder, shoot)
    page.type_into("#state-load", "24")
