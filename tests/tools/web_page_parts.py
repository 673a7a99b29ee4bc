"""Parts of the web page of grouser-server, for web_page_test.py: where an answer comes from, measured rows, a map."""

import json
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
    shown = page.wait(f"({WHY % 2}?.querySelector('.command')?.textContent ?? '').includes('--load 40') && {WHY % 2}.querySelector('.command').textContent")
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


def check_measured(page, bin_dir, root, folder, shoot):
    table = pathlib.Path(root, PAIR, "measured.csv")
    page.type_into("#state-load", "22")
    page.choose_file("#measured-file", table)
    count = len([line for line in table.read_text().splitlines() if line[:1] not in ("#", "s")])
    page.wait(f"document.getElementById('measured-note').textContent.startsWith('measured.csv: {count} rows. A smooth rigid wheel')")
    page.wait("document.querySelectorAll('#plot-f_x .measured').length > 0")
    marks = page.run("['f_x', 'torque'].map((key) => ['.measured', '.a .beside', '.b .beside'].map((mark) => "
                     "document.querySelectorAll(`#plot-${key} ${mark}`).length))")
    assert marks[0][0] >= 8 and len(set(marks[0])) == 1 and set(marks[1]) == {0}, marks  # no torque was measured
    first = page.run("document.querySelector('#model-a').value").partition("@")[0]
    model = next(path for path in pathlib.Path(root, PAIR).glob("*.model") if named(bin_dir, path, first))
    compared = json.loads(fit(bin_dir, "compare", model, "--measured", table, "--json"))
    shown = page.run("Object.fromEntries(Array.from(document.querySelectorAll('#measured-errors article:nth-child(1) data'), "
                     "(one) => [one.dataset.rms, Number(one.value)]))")
    wanted = {row["output"]: row["rmse"] for row in compared["errors"] if row["region"] == "all"}
    assert shown.keys() == wanted.keys() and all(abs(shown[key] / wanted[key] - 1) < 1e-9 for key in wanted), f"{shown}: {wanted}"
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


def fit(bin_dir, *arguments):
    return subprocess.run([f"{bin_dir}/grouser-fit", *arguments], check=True, capture_output=True, text=True).stdout


def named(bin_dir, path, name):
    return fit(bin_dir, "show", path).startswith(f"{name}@")


def check_map(page, folder, shoot):
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
    if shoot:
        shoot("map-cells", "#map-title", 700)
    path.write_bytes(path.read_bytes()[:900])
    page.choose_file("#map-file", path)
    page.wait("document.querySelector('#map [role=status]').textContent.startsWith('cells.tif: ends at byte 900')")


def check(page, ask, bin_dir, root, folder, shoot):
    """`ask` asks the server by the command line; `shoot` takes pictures, or None. Two models are compared, at 30 degrees."""
    check_measured(page, bin_dir, root, folder, shoot)
    check_explain(page, ask, shoot)
    check_map(page, folder, shoot)
    page.type_into("#state-load", "24")
