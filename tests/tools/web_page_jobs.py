"""Promotion, canary and rollback by the buttons of the web page of grouser-jobs, for web_page_test.py."""

import hashlib
import json
import pathlib
import shutil
import sqlite3
import subprocess
import tempfile
import time

import chromium

PAIR = "surrogate/pairs/cmu-smooth-62.5-8mm"
TOKENS = {"reader": "read", "release": "promote"}  # name, which is also its token: role
DIALOG = "document.getElementById('decide')"


def make_candidate(bin_dir, root, folder):
    """The pair's hybrid with sd_form by region, as the state folder keeps it; (base, candidate)."""
    base = f"{root}/{PAIR}/hybrid.model"
    made = pathlib.Path(folder, "candidate.model")
    subprocess.run([f"{bin_dir}/grouser-fit", "compare", base, "--measured", f"{root}/{PAIR}/measured.csv", "--out", made],
                   check=True, capture_output=True)
    (folder / "models").mkdir(exist_ok=True)
    digest = shown_name(bin_dir, made).partition("sha256:")[2]
    shutil.move(made, folder / "models" / f"{digest}.model")
    return shown_name(bin_dir, base), digest


def shown_name(bin_dir, model):
    return subprocess.run([f"{bin_dir}/grouser-fit", "show", model], check=True, capture_output=True, text=True).stdout.split()[0]


def store_job(root, folder, number, base, candidate, gate):
    """A job that awaits its promotion, as grouser-jobs stores it: a DEM run and a fit would take minutes."""
    checks = "".join(f"gate {{ {' '.join(f'{key}: {json.dumps(value)}' for key, value in check.items())} }}\n" for check in gate)
    text = (f'job_id: "job-{number}" model: "{base}" job_state: JOB_STATE_AWAITING_PROMOTION lease_epoch: 1 who: "local"\n'
            f'candidate_digest: "{candidate}" state {{ slip: 0.3 load_n: 24 }} {checks}'
            f'submit_time {{ seconds: {int(time.time())} }} update_time {{ seconds: {int(time.time())} }}')
    job = subprocess.run(["protoc", f"-I{root}/proto", "--encode=grouser.v1alpha1.Job", "grouser/v1alpha1/jobs_service.proto"],
                         input=text.encode(), check=True, capture_output=True).stdout
    with sqlite3.connect(folder / "jobs" / "jobs.sqlite") as store:
        store.execute("INSERT INTO jobs (job_id, join_key, state, lease_epoch, retries, job, spec, pending) VALUES (?,'',5,1,0,?,'','')",
                      (f"job-{number}", job))
        store.execute("INSERT INTO requests VALUES (?,?,'',0,0)", (f"request-{number}", f"job-{number}"))


def gate_of_another(bin_dir, root):
    """Checks of a gate that stops a candidate, as grouser-fit tells grouser-jobs."""
    done = subprocess.run([f"{bin_dir}/grouser-fit", "gate", "--base", f"{root}/{PAIR}/hybrid.model", "--candidate",
                           f"{root}/{PAIR}/lookup.model", "--json"], check=False, capture_output=True, text=True)
    checks = [{key: check[key] for key in ("name", "passed", "detail")} for check in json.loads(done.stdout)]
    assert {True, False} == {check["passed"] for check in checks}, checks
    return checks


def moves(bin_dir, grpc, token_file):
    done = subprocess.run([f"{bin_dir}/grouser-client", "model", "history", "--jobs", grpc, "--token-file", token_file, "--json"],
                          check=True, capture_output=True, text=True)
    return [(move["alias"], move["to_digest"], move["who"], move["why"], move["rollback"]) for move in json.loads(done.stdout)["moves"]]


def fill_in(page, selector, why, token=None):
    """Presses a button, answers its question, and waits for the end of it."""
    page.wait(f"document.querySelector(\"{selector}\") !== null")
    page.run(f"document.querySelector(\"{selector}\").click()")
    page.wait(f"{DIALOG}.open")
    page.type_into("#decide-who", "night shift")
    page.type_into("#decide-why", why)
    page.press("Enter", 13, "\r")
    if token:
        refusal = page.wait(f"!{DIALOG}.querySelector('[role=alert]').hidden && {DIALOG}.querySelector('[role=alert]').textContent")
        assert refusal.startswith("PERMISSION_DENIED") and "promote" in refusal, refusal
        page.type_into("#decide-token", token)
        page.press("Enter", 13, "\r")
    page.wait(f"!{DIALOG}.open")


def check(page, serving, bin_dir, root, shoot):
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        rights = folder / "rights.yaml"
        rights.write_text("format: grouser-rights/1\ncallers:\n" + "".join(
            f"  - {{name: {name}, role: {role}, token_sha256: {hashlib.sha256(name.encode()).hexdigest()}}}\n"
            for name, role in TOKENS.items()))
        options = ["--state", folder, "--bin", bin_dir, "--shipped", f"{root}/{PAIR}", "--rights", rights]
        with serving(f"{bin_dir}/grouser-jobs", folder, *options):
            pass  # makes its store
        base, candidate = make_candidate(bin_dir, root, folder)
        gate = gate_of_another(bin_dir, root)
        passed = [check for check in gate if check["passed"]]
        for number, checks in ((1, passed), (2, passed), (3, gate)):
            store_job(root, folder, number, base, candidate, checks)
        token = folder / "token"
        token.write_text("reader")
        with serving(f"{bin_dir}/grouser-jobs", folder, *options) as (grpc, http, _):
            page.view(1280, 900)
            page.open(f"http://{http}/ui/")
            page.wait("!document.getElementById('access').hidden")
            page.type_into("#token", "reader")
            page.press("Enter", 13, "\r")
            page.wait("document.querySelectorAll('#job-list .job').length === 3")
            page.posted.clear()
            shown = page.run("Array.from(document.querySelectorAll('#job-list .job:first-child .gate tbody tr'), (row) => "
                             "Array.from(row.cells, (cell) => cell.textContent))")
            assert [(name, result != "FAILED", f"{number}, {limit}: {words}") for name, result, number, limit, words in shown] == [
                (check["name"], check["passed"], check["detail"]) for check in gate], shown
            assert page.run("document.querySelector('#job-list .job:first-child').textContent").count("--override-gate") == 1
            assert page.run("document.querySelectorAll('#job-list .job:first-child button').length") == 0
            fill_in(page, ".job [data-promote=canary]", "to be tried", token="release")
            page.wait("document.querySelector('#aliases [data-stable$=canary]') !== null")
            who = "release (says: night shift)"
            wanted = [("canary", candidate, who, "to be tried", False)]
            assert moves(bin_dir, grpc, token)[:1] == wanted, moves(bin_dir, grpc, token)
            if shoot:
                shoot("jobs", "h1", 830)
                shoot("aliases", "#job-list .job:last-child", 880)
            fill_in(page, "#aliases [data-stable$=canary]", "a week without complaint")
            page.wait("document.querySelector('#aliases [data-rollback$=stable]') !== null")
            fill_in(page, "#aliases [data-rollback$=stable]", "worse on the slope")
            page.wait("document.getElementById('moves').textContent.includes('worse on the slope')")
            told = [move for move in moves(bin_dir, grpc, token) if move[0] == "stable"]
            assert [move[1:] for move in told] == [(base.partition("sha256:")[2], who, "worse on the slope", True),
                                                   (candidate, who, "a week without complaint", False)], told
            fill_in_refused(page)
            check_calls(page)
            page.view(380, 900)
            assert page.run("document.documentElement.scrollWidth <= innerWidth"), "wider than the window"
            if shoot:
                shoot("aliases-phone", "#job-list .job:last-child", 1400)


def fill_in_refused(page):
    """A rollback that leads nowhere: the server's words, and the question stays."""
    page.run("document.querySelector('#aliases [data-rollback$=stable]').click()")
    page.wait(f"{DIALOG}.open")
    page.type_into("#decide-why", "again")
    # While the call runs nothing closes the question.
    page.run("window.sent = window.fetch; window.held = new Promise((go) => { window.letGo = go; }); "
             "window.fetch = async (...asked) => { await window.held; return window.sent(...asked); }")
    page.press("Enter", 13, "\r")
    page.wait("document.getElementById('decide-go').disabled")
    for _ in range(3):
        page.press("Escape", 27)
    assert page.run(f"{DIALOG}.open && {DIALOG}.querySelector('button[type=button]').disabled"), "closed while its call runs"
    page.run("window.fetch = window.sent; window.letGo()")
    refusal = page.wait(f"!{DIALOG}.querySelector('[role=alert]').hidden && {DIALOG}.querySelector('[role=alert]').textContent")
    assert refusal.startswith("NOT_FOUND"), refusal
    page.press("Escape", 27)
    page.wait(f"!{DIALOG}.open && {DIALOG}.childNodes.length === 0")
    assert page.run("Array.from(document.querySelectorAll('input[type=password]')).every((input) => input.value === '')"), "a token stays"


def check_calls(page):
    """Jobs come by one call that has all that is shown; whoever comes back to the page sees it at once."""
    asked = [json.loads(body) for url, body in page.posted if url.endswith("/ListJobs")]
    assert asked and all(one == {"page_size": 25} for one in asked), asked
    hidden = ("Object.defineProperty(document, 'visibilityState', {get: () => '%s', configurable: true}); "
              "document.dispatchEvent(new Event('visibilitychange'))")
    page.run(hidden % "hidden")
    page.posted.clear()
    page.run(hidden % "visible")
    until = time.monotonic() + chromium.TIMEOUT_S
    while not any(url.endswith("/ListJobs") for url, _ in page.posted):
        assert time.monotonic() < until, page.posted
        page.run("new Promise((done) => setTimeout(done, 20))")
