#!/usr/bin/python3
"""Backup and restore as docs/operating.md describes them, with the commands that stand there.
Usage: backup_test.py BIN ROOT    (folders of the programs and of the source tree)"""
import contextlib
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

MODEL = "cmu-smooth-62.5"


@contextlib.contextmanager
def serving(bin_dir, root, state):
    """Both programs on a state folder; the options that lead a client to them."""
    programs = {"grouser-server": ["--no-lcm"], "grouser-jobs": ["--bin", bin_dir, "--workers", "1"]}
    processes = []
    with tempfile.TemporaryDirectory() as folder:
        for name, options in programs.items():
            processes.append(subprocess.Popen(
                [f"{bin_dir}/{name}", "--state", state, "--shipped", f"{root}/surrogate/shipped",
                 "--grpc", "127.0.0.1:0", "--port-file", f"{folder}/{name}", *options],
                stderr=subprocess.DEVNULL))
        try:
            ports = []
            for name in programs:
                port = pathlib.Path(folder, name)
                until = time.monotonic() + 60  # a guard against hanging
                while not (port.exists() and port.read_text().startswith("grpc=")):
                    assert time.monotonic() < until, f"{name} is not ready"
                    time.sleep(0.05)
                ports.append(port.read_text().splitlines()[0].removeprefix("grpc="))
            yield ["--server", ports[0], "--jobs", ports[1]]
        finally:
            for process in processes:
                process.send_signal(signal.SIGTERM)
            codes = [process.wait(60) for process in processes]
    assert codes == [0, 0], f"exit codes {codes}"


def ask(bin_dir, where, *arguments):
    done = subprocess.run([f"{bin_dir}/grouser-client", *where, "--json", *arguments], check=False,
                          capture_output=True, text=True)
    assert done.returncode == 0, f"{arguments}: {done.stderr}"
    return json.loads(done.stdout)


def remembered(bin_dir, where):
    """What must come back: where aliases pointed, and the jobs."""
    jobs = ask(bin_dir, where, "jobs")
    return {"moves": ask(bin_dir, where, "model", "history", MODEL),
            "jobs": sorted(job["job_id"] for job in jobs.get("jobs", []))}


def commands_of_page(root, heading):
    """The block of commands below a heading, for the state folder that a test has."""
    page = pathlib.Path(root, "docs/operating.md").read_text()
    block = re.search(rf"^## {heading}\n.*?```\n(.*?)```", page, re.S | re.M).group(1)
    return [line.replace("sudo ", "") for line in block.splitlines() if "systemctl" not in line]


def main(bin_dir, root):
    with tempfile.TemporaryDirectory() as folder:
        state = f"{folder}/grouser"
        with serving(bin_dir, root, state) as where:
            digest = ask(bin_dir, where, "model", MODEL)["model"]["digest"]
            ask(bin_dir, where, "model", "move", f"{MODEL}@sha256:{digest}", "--to", "canary",
                "--who", "test", "--why", "backup", "--override-gate")
            job = ask(bin_dir, where, "submit", "--slip", "0.2", "--load", "24", "--request-id", "a-request")
            ask(bin_dir, where, "cancel", job["job"]["job_id"], "--request-id", "a-request")
            before = remembered(bin_dir, where)
        assert before["jobs"] and before["moves"].get("moves"), f"nothing to remember: {before}"
        for heading in ("Back up", "Restore"):
            for command in commands_of_page(root, heading):
                command = command.replace("/var/lib", folder).replace("/srv/backup", folder)
                subprocess.run(["bash", "-c", command], check=True, cwd=folder)
            if heading == "Back up":
                shutil.rmtree(state)
        with serving(bin_dir, root, state) as where:
            after = remembered(bin_dir, where)
        assert after == before, f"after the restore {after}, before {before}"
        print(f"{len(before['moves']['moves'])} moves and {len(before['jobs'])} jobs came back")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    sys.exit(main(*sys.argv[1:]))
