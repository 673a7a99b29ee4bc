"""Frames of a run: the VTK XML files that `grouser-dem run` writes beside it."""

import pathlib
import re

import numpy as np

TYPES = {"Float32": "<f4", "Float64": "<f8", "Int32": "<i4"}
ARRAY = re.compile(r'<DataArray Name="([^"]+)" type="(\w+)" NumberOfComponents="(\d+)"[^>]*'
                   r'offset="(\d+)"/>')


class BadFile(Exception):
    """A file that is not what it should be; the message names it."""


def read_vtp(path):
    """{name: array} of a PolyData file with raw appended data."""
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError as error:
        raise BadFile(f"{path}: {error.strerror}") from error
    mark = b'<AppendedData encoding="raw">\n_'
    begin = data.find(mark)
    if begin < 0:
        raise BadFile(f"{path}: no raw appended data, expected a file of 'grouser-dem run'")
    arrays = {}
    for name, kind, components, offset in ARRAY.findall(data[:begin].decode()):
        at = begin + len(mark) + int(offset)
        size = int.from_bytes(data[at:at + 8], "little")
        if at + 8 + size > len(data):
            raise BadFile(f"{path}: cut short in '{name}'")
        array = np.frombuffer(data, TYPES[kind], size // np.dtype(TYPES[kind]).itemsize, at + 8)
        arrays[name] = array.reshape(-1, int(components)) if int(components) > 1 else array
    return arrays


class Frame:
    """Grains and bodies at one time. SI; arrays by grain."""

    def __init__(self, grains, bodies, contacts=None):
        grains, bodies = read_vtp(grains), read_vtp(bodies)
        contacts = read_vtp(contacts) if contacts else {}
        self.time = float(grains["TimeValue"][0])
        self.box = grains["box_m"].reshape(3)
        self.planar = bool(grains["planar"][0])
        self.centre = grains["points"].reshape(-1, 3).astype(float)
        self.radius = grains["radius_m"].astype(float)
        self.speed = np.linalg.norm(grains["velocity_m_per_s"].reshape(-1, 3), axis=1)
        self.force = np.linalg.norm(grains["force_n"].reshape(-1, 3), axis=1)
        self.overlap = grains["overlap_over_radius"]
        self.contacts = grains["contacts"]
        self.ids = grains["id"]
        self.bonds = grains["connectivity"].reshape(-1, 2)  # of the lines, which come last
        vertices = bodies["points"].reshape(-1, 3).astype(float)
        self.triangles = vertices[bodies["connectivity"].reshape(-1, 3)]  # [n, corner, xyz]
        self.body = bodies["body"]
        # Contacts of bodies; none in frames of runs before there were any.
        self.touch_body = contacts.get("body", np.zeros(0, int))
        self.touch_point, self.touch_normal, self.touch_force = (
            contacts.get(key, np.zeros(0)).reshape(-1, 3).astype(float)
            for key in ("points", "normal", "force_n"))

    def values(self, by):
        """Of every grain, by one of MEASURES."""
        return {"speed": self.speed, "force": self.force, "overlap": self.overlap,
                "contacts": self.contacts, "size": 2 * self.radius,
                "height": self.centre[:, 2]}[by]


MEASURES = {"speed": "speed [m/s]", "force": "sum of contact forces [N]",
            "overlap": "deepest overlap / radius [-]", "contacts": "contacts of a grain [-]",
            "size": "diameter [m]", "height": "height [m]"}


def stem_of(run):
    """What the names of a run's files begin with: of OUT.run.h5, OUT.frames or OUT itself."""
    text = str(run).rstrip("/")
    for ending in (".run.h5", ".frames"):
        text = text.removesuffix(ending)
    return text


def list_frames(stem):
    """[(time, grains file, bodies file, contacts file or None)] by frames.pvd, which is written
    last."""
    folder = pathlib.Path(stem + ".frames")
    try:
        text = (folder / "frames.pvd").read_text()
    except OSError as error:
        raise BadFile(f"{folder}/frames.pvd: {error.strerror}; "
                      "give the experiment output: {frames: {every_s: ...}}") from error
    files = {}
    for time, name, file in re.findall(
            r'timestep="([^"]+)" part="\d" name="(\w+)" file="([^"]+)"', text):
        files.setdefault(float(time), {})[name] = folder / file
    return [(time, entry["grains"], entry["bodies"], entry.get("contacts"))
            for time, entry in sorted(files.items())]


def read_names(stem):
    """Names of the bodies by number."""
    path = pathlib.Path(stem + ".frames") / "bodies.csv"
    try:
        lines = path.read_text().splitlines()[1:]
    except OSError as error:
        raise BadFile(f"{path}: {error.strerror}; run the experiment again for it") from error
    return [line.split(",", 1)[1] for line in lines]


def read_series(stem):
    """(columns, rows) of the series; None where there is none."""
    path = pathlib.Path(stem + ".series.csv")
    if not path.exists():
        return None
    columns = path.read_text().split("\n", 1)[0].split(",")
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, ndmin=2)
    return (columns, rows) if rows.size else None
