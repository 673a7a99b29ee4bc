"""What the tests of the Python package share."""

import os
import pathlib
import subprocess
import tempfile
import threading

import numpy as np

import grouser

SOURCE = pathlib.Path(os.environ["GROUSER_SOURCE"])
SHIPPED = grouser.MODEL_DIR / "cmu-smooth-62.5.model"
PAIR = SOURCE / "surrogate/pairs/cmu-smooth-62.5-8mm"
PARTS = ("value", "sd_fit", "sd_patch", "low", "high", "d_v_x", "d_v_y", "d_rim_speed", "d_load", "sd_form",
         "measured_low", "measured_high", "sd_soil")
ALL = ("f_x", "f_y", "f_z", "torque", "m_z", "sinkage", "slip", "attack_angle")


def reference(what, file, *arrays):
    """The C++ library's own answers to the arrays, as one flat array."""
    with tempfile.TemporaryDirectory() as folder:
        asked, answered = pathlib.Path(folder, "in"), pathlib.Path(folder, "out")
        asked.write_bytes(b"".join(np.ascontiguousarray(a, float).tobytes() for a in arrays))
        subprocess.run([os.environ["GROUSER_REFERENCE"], what, file, asked, answered], check=True)
        return np.fromfile(answered)


def some_states(n=300, seed=1):
    """Wheel states inside and outside of the domain of the CMU models, good and bad."""
    rng = np.random.default_rng(seed)
    states = grouser.States.of(rng.uniform(-0.15, 0.15, n), rng.uniform(-0.1, 0.1, n), rng.uniform(-0.2, 0.2, n),
                               rng.uniform(5, 60, n))
    states.load[0], states.load[1], states.v_x[2], states.rim_speed[3] = 0, -1, np.nan, np.inf
    states.v_x[4] = states.v_y[4] = states.rim_speed[4] = 0
    return states


def differ_in_threads(ask):
    """How often one of four threads that ask ten times each gets other bytes than asked alone."""
    expected, wrong = ask(), []

    def again():
        wrong.extend(1 for _ in range(10) if ask() != expected)

    threads = [threading.Thread(target=again) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return len(wrong)
