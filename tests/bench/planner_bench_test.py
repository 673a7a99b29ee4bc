#!/usr/bin/python3
"""The planner's measurement runs and its JSON has its fields; never how long anything takes."""
import json
import subprocess
import sys

FIELDS = {"vehicle": str, "path": str, "points": int, "wheels": int, "plan_p50_ms": float,
          "plan_p99_ms": float, "plan_cpu_ms": float, "solve_cold_us": float,
          "solve_warm_us": float, "solve_draw_us": float, "allocations": int, "not_held": int,
          "grpc_p50_ms": float, "grpc_p99_ms": float, "grpc_differ": int}
POINTS = 12


def main(bench):
    command = [bench, "planner", "--points", str(POINTS), "--repetitions", "1"]
    rows = json.loads(subprocess.run(command + ["--json"], check=True, capture_output=True,
                                     text=True).stdout)
    assert len(rows) == 16, len(rows)  # four vehicles, four paths
    assert len({(row["vehicle"], row["path"]) for row in rows}) == 16
    for row in rows:
        assert {name: type(value) for name, value in row.items()} == FIELDS, row
        assert row["points"] == POINTS and row["wheels"] in (4, 6), row
        assert row["allocations"] == 0, row
        assert 0 <= row["not_held"] <= POINTS, row
        assert row["grpc_p50_ms"] == row["grpc_p99_ms"] == row["grpc_differ"] == 0, row  # no server
        assert row["plan_p50_ms"] > 0 and row["plan_p99_ms"] >= row["plan_p50_ms"], row
    table = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert len(table.splitlines()) == 17 and "solve cold us" in table, table
    refused = subprocess.run([bench, "planner", "--points", "1"], capture_output=True, text=True)
    assert refused.returncode == 2 and "--points" in refused.stderr, refused


if __name__ == "__main__":
    main(sys.argv[1])
