#!/usr/bin/python3
"""The wheel: pip installs it without a network into an environment of its own, where it works and is removed whole.
Exit code 77: python3-wheel, python3-pip or python3-venv is not here."""

import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import zipfile

from common import SOURCE

NOT_HERE = 77
USE = """
import pathlib, sys
import grouser
model = grouser.Model.open(grouser.MODEL_DIR / "cmu-smooth-62.5.model")
print(pathlib.Path(grouser.__file__).parent, model.evaluate(grouser.States.of(0.06, 0, 0.1, 12)).f_x.value[0])
try:
    import grpc
except ImportError:
    print("no grpc")
else:
    from grouser.client import Client
    print(Client("unix:/nobody").address)
"""


def run(*argv, **options):
    return subprocess.run([str(a) for a in argv], check=True, text=True, stdout=subprocess.PIPE, **options).stdout


def main():
    lacking = [name for name in ("wheel", "pip", "venv") if importlib.util.find_spec(name) is None]
    if lacking:
        print(f"skipped: no Python module {' or '.join(lacking)} here")
        return NOT_HERE
    with tempfile.TemporaryDirectory() as folder:
        script = SOURCE / "clients/python/make_wheel.py"
        wheel = pathlib.Path(run(sys.executable, script, os.environ["GROUSER_BUILD"], f"{folder}/wheels").strip())
        assert [f.name for f in wheel.parent.iterdir()] == [wheel.name], "more than the wheel is left"
        archive = zipfile.ZipFile(wheel)
        names = archive.namelist()
        for wanted in ("grouser/client.py", "grouser/v1alpha1/state_pb2.py", "grouser/google/rpc/status_pb2.py",
                       "grouser/py.typed", "grouser/vehicles/husky.vehicle.yaml"):
            assert wanted in names, f"{wanted}: not in {names}"
        assert not [n for n in names if "__pycache__" in n]
        metadata = archive.read(next(n for n in names if n.endswith(".dist-info/METADATA"))).decode()
        assert "\nRequires-Dist: numpy<2\n" in metadata, metadata  # pybind11 2.10 knows no other

        environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PIP"))}
        run(sys.executable, "-m", "venv", "--without-pip", "--system-site-packages", f"{folder}/venv")
        python = f"{folder}/venv/bin/python3"
        pip = (sys.executable, "-m", "pip", "--python", python)
        run(*pip, "install", "--no-index", "--quiet", wheel, env=environment)  # checks the hashes of RECORD
        place, pull, client = run(python, "-c", USE, env=environment, cwd=folder).split(maxsplit=2)
        assert place.startswith(str(pathlib.Path(folder).resolve())), f"{place}: not what pip installed"
        assert 0 < float(pull) < 12, pull
        assert client.strip() in ("no grpc", "unix:/nobody"), client
        run(*pip, "uninstall", "--yes", "--quiet", "grouser", env=environment)
        left = [str(f) for f in pathlib.Path(place).rglob("*") if f.is_file() and f.suffix != ".pyc"]
        assert not left, f"uninstalling leaves {left}"

        done = subprocess.run([sys.executable, script, folder, folder], check=False, capture_output=True, text=True)
        assert done.returncode == 1 and "expected the folder of a build" in done.stderr, done.stderr
    return 0


if __name__ == "__main__":
    sys.exit(main())
