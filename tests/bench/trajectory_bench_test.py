#!/usr/bin/python3
"""The trajectories' measurement runs against a server and its JSON has its fields; never how long anything takes."""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

FIELDS = {"way": str, "calls": int, "sent_bytes": int, "answered_bytes": int, "p50_ms": float, "server_p50_ms": float}


def main(bench, server, vehicles):
    with tempfile.TemporaryDirectory() as folder:
        port = pathlib.Path(folder, "port")
        process = subprocess.Popen(["setpriv", "--pdeathsig", "KILL", server, "--state", folder, "--no-lcm", "--grpc",
                                    f"unix:{folder}/s", "--vehicles", vehicles, "--port-file", port],
                                   stderr=subprocess.DEVNULL)
        try:
            until = time.monotonic() + 60
            while not port.exists():
                assert time.monotonic() < until and process.poll() is None, "the server is not ready"
                time.sleep(0.02)
            command = [bench, "trajectories", "--server", f"unix:{folder}/s", "--trajectories", "80", "--steps", "50",
                       "--repetitions", "2"]
            rows = json.loads(subprocess.run(command + ["--json"], check=True, capture_output=True, text=True).stdout)
            table = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        finally:
            process.terminate()
            process.wait(60)
    assert [row["calls"] for row in rows] == [2, 2, 1, 1, 1], rows  # 4,000 motions, 3,000 a call
    by_way = {row["way"]: row for row in rows}
    for row in rows:
        assert {name: type(value) for name, value in row.items()} == FIELDS, row
        assert row["p50_ms"] > row["server_p50_ms"] > 0, row
    assert by_way["trajectories"]["answered_bytes"] * 100 < by_way["Solve"]["answered_bytes"], rows
    assert len(table.splitlines()) == 6 and "sent" in table, table
    refused = subprocess.run([bench, "trajectories"], capture_output=True, text=True)
    assert refused.returncode == 2 and "--server" in refused.stderr, refused


if __name__ == "__main__":
    main(*sys.argv[1:])
