#!/usr/bin/python3
"""Processor time of Model.evaluate in Python over the C++ library's, in turn: the median of 30 pairs, each of
20 calls, and what one call costs beside its states. Usage: python_overhead.py BUILD_DIR [STATES]
BUILD_DIR: say build/release."""

import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

PAIRS, CALLS = 30, 20


def seconds_of(call):
    start = time.process_time()
    for _ in range(CALLS):
        call()
    return (time.process_time() - start) / CALLS


def main(build, count="10000"):
    build = pathlib.Path(build).absolute()
    sys.path.insert(0, str(build / "python"))
    import grouser  # of this build

    rng = np.random.default_rng(1)
    n = int(count)
    file = grouser.MODEL_DIR / "cmu-smooth-62.5.model"
    model = grouser.Model.open(file)
    states = grouser.States.from_slip(rng.uniform(-0.4, 0.7, n), rng.uniform(-1, 1, n), 0.1, rng.uniform(12, 38, n))
    out = model.evaluate(states)
    with tempfile.NamedTemporaryFile() as asked:
        for array in (states.v_x, states.v_y, states.rim_speed, states.load):
            asked.write(array.tobytes())
        asked.flush()
        with subprocess.Popen([build / "bin/python_reference", "time", file, asked.name], text=True,
                              stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
            def library():
                other.stdin.write("\n")
                other.stdin.flush()
                return float(other.stdout.readline())

            rows = [(library(), seconds_of(lambda: model.evaluate(states, out)),
                     seconds_of(lambda: model.evaluate(states))) for _ in range(PAIRS)]
            other.stdin.close()
    cpp, in_place, fresh = (statistics.median(r[k] for r in rows) for k in range(3))
    ratio = [statistics.median(r[k] / r[0] for r in rows) for k in (1, 2)]
    one = grouser.States.of([0.08], [0], [0.1], [24])
    single = model.evaluate(one)
    call = min(seconds_of(lambda: model.evaluate(one, single)) for _ in range(PAIRS))
    print(f"{n} states, value, low and high of all outputs: C++ {1e6 * cpp:.0f} us; Python, out given "
          f"{1e6 * in_place:.0f} us ({ratio[0]:.3f}), new arrays {1e6 * fresh:.0f} us ({ratio[1]:.3f}); "
          f"one state, out given: {1e6 * call:.1f} us")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]) if 2 <= len(sys.argv) <= 3 else print(__doc__, file=sys.stderr) or 2)
