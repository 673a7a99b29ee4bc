#!/usr/bin/python3
"""The web page in a headless Chromium: its numbers are those of the command line; keyboard, dark mode, phone
width, rights, a server that is gone. Usage: web_page_test.py BIN ROOT [--pictures DIR]
(folders of the programs and of the source tree). Exit code 77: there is no Chromium."""
import base64
import contextlib
import hashlib
import json
import os
import pathlib
import shlex
import signal
import subprocess
import sys
import tempfile
import time

import chromium
import web_page_jobs
import web_page_parts

NO_CHROMIUM = 77
NUMBERS = """Object.fromEntries(Array.from(document.querySelectorAll('#answer article:nth-child(%d) data'),
  (one) => [one.dataset.output, [one.value, one.textContent]]))"""
COMMAND = "(document.querySelector('#answer article:nth-child(%d) .command')?.textContent ?? '')"
FITS = "document.documentElement.scrollWidth <= innerWidth"
FIRST_ANSWER = "document.querySelector('#answer data') !== null"


@contextlib.contextmanager
def serving(program, folder, *options):
    """A program with HTTP on a free port; its addresses (gRPC, HTTP) and its process."""
    port = pathlib.Path(folder, f"{pathlib.Path(program).name}.port")
    port.unlink(missing_ok=True)
    process = subprocess.Popen(
        [program, "--grpc", "127.0.0.1:0", "--http", "127.0.0.1:0", "--port-file", port, *options],
        stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 60  # a guard against hanging
        while not (port.exists() and port.read_text().count("\n") == 2):
            assert time.monotonic() < until and process.poll() is None, f"{program} is not ready"
            time.sleep(0.02)
        grpc, http = (line.partition("=")[2] for line in port.read_text().splitlines())
        yield grpc, http, process
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)


def client(bin_dir, grpc, *arguments):
    done = subprocess.run([f"{bin_dir}/grouser-client", *arguments, "--server", grpc, "--json"], check=False,
                          capture_output=True, text=True)
    assert done.returncode == 0, f"{arguments}: {done.stderr}"
    return json.loads(done.stdout)


def check_numbers(page, bin_dir, grpc, article, wanted):
    """What is shown is what the command that is shown answers, bit for bit, and in its digits."""
    shown = page.wait(f"{COMMAND % article}.includes('{wanted}') && {COMMAND % article}")
    words = shlex.split(shown)
    assert words[:2] == ["./grouser", "query"], shown
    responses = client(bin_dir, grpc, *words[1:])["responses"]
    numbers = page.run(NUMBERS % article)
    assert len(numbers) == 6, numbers
    for output, (exact, text) in numbers.items():
        value = responses[output]["value"][0]
        assert float(exact) == value, f"{output}: the page has {exact}, the command line {value}"
        assert float(text.replace("−", "-")) == float(f"{value:.5g}"), f"{output}: {text} for {value}"
    return responses


def check_state(page, bin_dir, grpc):
    page.type_into("#state-slip", "0.2")
    page.type_into("#state-angleDeg", "30")
    page.type_into("#state-load", "24")
    check_numbers(page, bin_dir, grpc, 1, "--slip 0.2 --angle-deg 30 --load 24")
    page.type_into("#state-load", "500")
    check_numbers(page, bin_dir, grpc, 1, "--load 500")
    flags = page.run("document.querySelector('#answer .flags').textContent")
    assert "EXTRAPOLATED: outside of the training domain" in flags, flags
    page.type_into("#state-load", "")  # nothing is asked
    assert page.run("document.getElementById('state-load').getAttribute('aria-invalid')") == "true"
    page.type_into("#state-load", "24")
    check_numbers(page, bin_dir, grpc, 1, "--load 24")


def check_curves(page, bin_dir, grpc):
    """Five plots with curve and band; the end that a reader of the screen is told is the server's."""
    counts = page.run("""Array.from(document.querySelectorAll('#plots svg'), (svg) =>
      [svg.querySelectorAll('.curve').length, svg.querySelectorAll('.band').length])""")
    assert len(counts) == 5 and all(curves > 0 and bands > 0 for curves, bands in counts), counts
    told = page.run("document.getElementById('plot-f_x').getAttribute('aria-label')")
    last = told.split(", ")[-1].replace("−", "-")  # "4.31 N at slip 0.95"
    slip = float(last.rsplit(" ", 1)[1])
    model = shlex.split(page.run(COMMAND % 1))[3]
    answer = client(bin_dir, grpc, "query", "--model", model, "--slip", str(slip), "--angle-deg", "30", "--load", "24")
    value = answer["responses"]["f_x"]["value"][0]
    assert abs(float(last.split(" ")[0]) - value) <= 0.006 * abs(value), f"{told}: {value}"


def check_comparison(page, bin_dir, grpc):
    page.run("""const select = document.getElementById('model-b'); select.selectedIndex = 2;
      select.dispatchEvent(new Event('change'))""")
    page.wait("document.querySelectorAll('#answer article').length === 2")
    first, second = (check_numbers(page, bin_dir, grpc, article, "--load 24") for article in (1, 2))
    assert first["f_x"] != second["f_x"], "two models, one answer"
    assert page.run("document.querySelectorAll('#plots svg .b .curve').length") >= 5
    assert page.run("document.querySelectorAll('#card article').length") == 2


def check_keyboard(page, bin_dir, grpc):
    page.run("document.activeElement.blur()")
    reached = []
    for _ in range(80):
        page.press("Tab", 9)
        reached.append(page.run("""(({id, type, name, className}) => id || className || name || type)(document.activeElement)"""))
    for wanted in ("name", "model-a", "model-b", "state-slip", "state-load", "target", "range", "command"):
        assert wanted in reached, f"{wanted}: not reached by Tab: {reached}"
    page.run("document.querySelector('input[type=range]').focus()")
    page.press("ArrowRight", 39)
    check_numbers(page, bin_dir, grpc, 1, "--slip 0.21 ")


def check_looks(page, pictures):
    """No text that is hard to read, nothing wider than the window; pictures where they are asked for."""
    contrast = """(() => {
      const light = (css) => { const [r, g, b] = css.match(/[\\d.]+/g).map((v) => { v /= 255;
        return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; }); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
      const back = light(getComputedStyle(document.body).backgroundColor);
      return Math.min(...Array.from(document.querySelectorAll('body, .note, th, h3, h4, button, a, summary, .flags b, .ready, .failed'), (one) => {
        const text = light(getComputedStyle(one).color);
        return (Math.max(text, back) + 0.05) / (Math.min(text, back) + 0.05); })); })()"""
    page.run("document.activeElement.blur()")
    for name, width, scheme, top, height in (("desktop", 1280, "light", "h1", 1340), ("phone", 380, "light", "#response-title", 1500),
                                             ("dark", 1280, "dark", "#response-title", 720),
                                             ("explain-phone", 380, "dark", "#why", 1750)):
        page.view(width, 900, scheme)
        page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert page.run(contrast) >= 4.5, f"{name}: contrast {page.run(contrast)}"
        is_dark = page.run("getComputedStyle(document.body).backgroundColor.match(/\\d+/g)[0] < 128")
        assert is_dark == (scheme == "dark"), name
        assert page.run(FITS), f"{name}: wider than the window"
        if pictures:
            take_picture(page, f"{pictures}/{name}.webp", top, height)


def take_picture(page, file, top, height):
    """From the element `top` on."""
    shot = page.call("Page.captureScreenshot", captureBeyondViewport=True, format="webp", quality=80, clip=page.run(
        f"({{x: 0, y: Math.max(0, document.querySelector('{top}').getBoundingClientRect().top + scrollY - 16), "
        f"width: innerWidth, height: {height}, scale: 1}})"))
    pathlib.Path(file).write_bytes(base64.b64decode(shot["data"]))


def shooter(page, pictures):
    return lambda name, top, height: take_picture(page, f"{pictures}/{name}.webp", top, height)


def check_server_gone(page, process):
    process.send_signal(signal.SIGTERM)
    process.wait(60)
    page.type_into("#state-slip", "0.3")
    page.wait("!document.getElementById('problem').hidden")
    assert "UNREACHABLE" in page.run("document.getElementById('problem').textContent")


def check_server(page, bin_dir, root, pictures):
    with tempfile.TemporaryDirectory() as folder:
        with serving(f"{bin_dir}/grouser-server", folder, "--state", folder, "--no-lcm",
                     "--shipped", f"{root}/surrogate/pairs/cmu-smooth-62.5-8mm") as (grpc, http, process):
            page.view(1280, 900)
            page.open(f"http://{http}/")
            page.wait(FIRST_ANSWER)
            page.wait("document.getElementById('state').textContent.startsWith('grouser-server: ready; generation')")
            models = len(client(bin_dir, grpc, "models")["models"])
            assert page.run("document.querySelectorAll('#models tbody tr').length") == models
            check_state(page, bin_dir, grpc)
            check_curves(page, bin_dir, grpc)
            check_comparison(page, bin_dir, grpc)
            web_page_parts.check(page, lambda *asked: client(bin_dir, grpc, *asked), bin_dir, root, folder,
                                 pictures and shooter(page, pictures))
            check_keyboard(page, bin_dir, grpc)
            check_looks(page, pictures)
            # What stands behind '#' brings the same state again; it is written half a second after the last change.
            where = page.wait("location.hash.includes('&slip=0.21&angleDeg=30&load=24') && location.href")
            page.open(where)
            page.wait(FIRST_ANSWER)
            check_numbers(page, bin_dir, grpc, 2, "--slip 0.21 --angle-deg 30 --load 24")
            assert not page.errors, page.errors
            others = [url for url in page.loaded if not url.startswith((f"http://{http}/", "data:", "about:"))]
            assert not others, f"loaded from elsewhere: {others}"
            check_server_gone(page, process)


def check_rights(page, bin_dir, root):
    with tempfile.TemporaryDirectory() as folder:
        rights = pathlib.Path(folder, "rights.yaml")
        digest = hashlib.sha256(b"secret").hexdigest()
        rights.write_text(f"format: grouser-rights/1\ncallers:\n  - {{name: a, role: read, token_sha256: {digest}}}\n")
        with serving(f"{bin_dir}/grouser-server", folder, "--state", folder, "--no-lcm", "--rights", rights,
                     "--shipped", f"{root}/surrogate/shipped") as (_, http, _):
            page.open(f"http://{http}/ui/")
            for token, wanted in (("", "UNAUTHENTICATED"), ("wrong", "not one of the rights file's"), ("secret", None)):
                if token:
                    page.type_into("#token", token)
                    page.press("Enter", 13, "\r")
                if wanted:
                    page.wait(f"document.getElementById('problem').textContent.includes(\"{wanted}\")")
                    page.wait("!document.getElementById('access').hidden")
            page.wait(FIRST_ANSWER)
            assert page.run("document.getElementById('access').hidden && document.getElementById('problem').hidden")


def check_jobs(page, bin_dir, root, pictures):
    with tempfile.TemporaryDirectory() as folder:
        with serving(f"{bin_dir}/grouser-jobs", folder, "--state", folder, "--bin", bin_dir, "--workers", "1",
                     "--shipped", f"{root}/surrogate/shipped") as (grpc, http, _):
            page.open(f"http://{http}/ui/")
            page.wait("document.getElementById('job-list').textContent.startsWith('No jobs')")
            submit = [f"{bin_dir}/grouser-client", "submit", "--jobs", grpc, "--json", "--slip", "0.35",
                      "--angle-deg", "20", "--load", "24"]
            job = json.loads(subprocess.run(submit, check=True, capture_output=True, text=True).stdout)["job"]
            page.wait(f"document.querySelector('.job code')?.textContent === '{job['job_id']}'")
            text = page.run("document.querySelector('.job').textContent")
            assert "slip 0.35, attack angle 20 deg, load 24 N" in text, text
            page.wait("document.querySelector('.job progress') !== null")
            page.view(380, 900)
            assert page.run(FITS), "wider than the window"


def main():
    program = chromium.find_chromium()
    if program is None:
        print(f"skipped: none of {', '.join(chromium.PROGRAMS)} is installed (the group full of cmake/packages.debian)")
        return NO_CHROMIUM
    bin_dir, root = (os.path.abspath(path) for path in sys.argv[1:3])
    pictures = sys.argv[4] if sys.argv[3:4] == ["--pictures"] else None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page = chromium.Page(program, folder)
        try:
            check_server(page, bin_dir, root, pictures)
            page.errors.clear()
            check_jobs(page, bin_dir, root, pictures)
            assert not page.errors, page.errors
            web_page_jobs.check(page, serving, bin_dir, root, pictures and shooter(page, pictures))
            check_rights(page, bin_dir, root)
        finally:
            page.close()
    print("ok")
    return 0


if __name__ == "__main__":
    sys.exit(main())
