#!/usr/bin/python3
"""How long grouser-server takes to start with many models.

  tests/bench/start_models.py --server build/release/bin/grouser-server --models 100

Makes a state folder of copies of the models in surrogate/shipped and surrogate/pairs under other
names (so that their digests differ); --names of them have an alias "stable", as where the others
are earlier versions (default: all). Starts the server --repeats times and prints the seconds until
it answers, and those of processors that it took (which tell more on a busy machine). Exit code: 0;
1 where the server does not start or does not serve what has an alias.
"""
import argparse
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = 16  # magic and version
LENGTH = 8
DIGEST = 64


def renamed(data, name):
    """The bytes of a model file under another name, and its digest."""
    payload = data[HEADER + LENGTH + DIGEST:]
    if payload[0] != 0x0A:
        raise ValueError("expected a model whose first field is its name")
    payload = bytes([0x0A, len(name)]) + name.encode() + payload[2 + payload[1]:]
    digest = hashlib.sha256(payload).hexdigest()
    head = data[:HEADER] + len(payload).to_bytes(LENGTH, "little") + digest.encode()
    return head + payload, digest


def make_state(folder, count, named):
    sources = sorted((ROOT / "surrogate/shipped").glob("*.model"))
    sources += sorted((ROOT / "surrogate/pairs").glob("*/hybrid.model"))
    models = folder / "models"
    models.mkdir(parents=True)
    aliases, history = {}, []
    for i in range(count):
        name = f"made-{i}"
        data, digest = renamed(sources[i % len(sources)].read_bytes(), name)
        (models / f"{digest}.model").write_bytes(data)
        if i >= named:
            continue
        aliases[name] = {"stable": digest}
        history.append({"model": name, "alias": "stable", "digest": digest, "generation": i + 1,
                        "who": "start_models.py", "why": "", "unix_s": time.time()})
    text = json.dumps({"generation": len(history), "aliases": aliases, "history": history})
    (models / "aliases.json").write_text(text)


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start(server, state, named):
    begin = time.monotonic()
    command = [server, "--state", state, "--grpc", "127.0.0.1:0", "--no-lcm"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        served = 0
        for line in process.stderr:
            found = re.search(r"with (\d+) model", line)
            served = int(found.group(1)) if found else served
            if line.startswith("ready "):
                if served < named:
                    sys.exit(f"served {served} models, expected {named} or more")
                return time.monotonic() - begin, cpu_seconds(process.pid)
        sys.exit(f"{server} ended with {process.wait()}")
    finally:
        process.terminate()
        process.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--server", required=True)
    parser.add_argument("--models", type=int, default=100)
    parser.add_argument("--names", type=int, help="that have an alias; default: all")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--keep", help="folder for the state, left there; default: a temporary one")
    arguments = parser.parse_args()
    named = arguments.models if arguments.names is None else arguments.names
    with tempfile.TemporaryDirectory() as temporary:
        state = pathlib.Path(arguments.keep or temporary) / "state"
        if not state.exists():
            make_state(state, arguments.models, named)
        times = [start(arguments.server, str(state), named)
                 for _ in range(arguments.repeats)]
    taken = ", ".join(f"{wall:.2f} s ({cpu:.2f} s of processors)" for wall, cpu in times)
    print(f"{arguments.models} models, {named} with an alias: {taken}")


if __name__ == "__main__":
    main()
