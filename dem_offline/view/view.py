#!/usr/bin/python3
"""Pictures of a run: frames (oblique and cut), a film, plots of the series.

  ./grouser dem view out/plate.run.h5                        # into out/plate.view
  ./grouser dem view out/plate.run.h5 --by overlap --at 1.2  # the frame nearest to 1.2 s
  ./grouser dem view out/plate.run.h5 --film                 # MP4 through ffmpeg, else GIF
  ./grouser dem view out/plate.run.h5 --patch plate          # pressure and shear on that body

Frames are there where the experiment says output: {frames: {every_s: ...}}.
Exit codes: 0 done, 1 failed, 2 bad usage or input."""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the back end is chosen first)
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection, LineCollection  # noqa: E402

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from frames import (MEASURES, BadFile, Frame, list_frames, read_names, read_series,  # noqa: E402
                    stem_of)
from patch import draw_patch  # noqa: E402
from render import Camera, Canvas, cut  # noqa: E402

STEEL = (0.47, 0.66, 0.90)
AXES = "xyz"
plt.rcParams.update({"font.size": 9, "axes.edgecolor": "#888888", "axes.axisbelow": True,
                     "grid.color": "#e6e6e6", "figure.dpi": 110})


class Scale:
    """Colours of a measure, the same in all frames."""

    def __init__(self, frames, by):
        values = np.concatenate([frame.values(by) for frame in frames])
        values = values[np.isfinite(values)]
        self.by, self.label = by, MEASURES[by]
        if values.size == 0:
            values = np.zeros(1)
        zero = by in ("speed", "force", "overlap", "contacts")
        low = 0.0 if zero else float(values.min())
        high = float(np.percentile(values, 99.5)) if zero else float(values.max())
        self.clipped = high < float(values.max()) * (1 - 1e-9)
        self.norm = plt.Normalize(low, high if high > low else low + max(abs(low), 1e-9))
        self.map = plt.get_cmap("viridis" if by in ("size", "height") else "plasma")

    def colours(self, values):
        return self.map(self.norm(values))[:, :3]

    def bar(self, figure, place):
        figure.colorbar(plt.cm.ScalarMappable(self.norm, self.map), cax=figure.add_axes(place),
                        label=self.label, extend="max" if self.clipped else "neither")


class Region:
    """What is shown in all frames: where there are grains, and the bodies as far as they are no
    higher over them than that is wide."""

    def __init__(self, frames):
        box = frames[0].box
        full = [f for f in frames if f.radius.size]
        low = np.min([(f.centre - f.radius[:, None]).min(axis=0) for f in full] or [0 * box],
                     axis=0)
        high = np.max([(f.centre + f.radius[:, None]).max(axis=0) for f in full] or [box],
                      axis=0)
        margin = 0.25 * (high - low)
        self.low = np.append(np.maximum(0, low - margin)[:2], 0.0)
        self.high = np.minimum(box, high + margin)
        bodies = max((float(f.triangles[..., 2].max()) for f in frames if f.triangles.size),
                     default=0.0)
        wide = float((self.high - self.low)[:2].max())
        self.high[2] = max(high[2], min(bodies, max(0.6 * wide, 1.3 * high[2])))
        self.reach = max((float(f.radius.max()) for f in full), default=0.0)

    def corners(self):
        """The i-th has the high end along x, y, z where its bits 1, 2, 4 are set."""
        bits = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)])
        return self.low + bits * (self.high - self.low)


def nice_ticks(low, high):
    """Some round places from one to the other."""
    length = high - low
    step = 10.0 ** np.floor(np.log10(length / 2))
    for factor in (5, 2.5, 2, 1):
        if length / (factor * step) >= 2:
            step *= factor
            break
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) + 0.0


def draw_box(axes, camera, region):
    """Floor and rear edges of what is shown, with metres along three of them."""
    corners = region.corners()
    flat = camera.project(corners)
    hidden = int(np.argmin(flat[:, 2]))  # the corner that is furthest from the eye
    for i in range(8):
        for j in (i ^ 1, i ^ 2, i ^ 4):
            if i < j:
                rear = hidden in (i, j) or (not i & 4 and not j & 4)
                axes.plot(*flat[[i, j], :2].T, color="#999999", lw=0.8 if rear else 0.5,
                          zorder=0, ls="-" if rear else ":")
    front = np.where(camera.towards < 0, region.low, region.high)
    front[2] = region.low[2]
    upright = corners[int(np.argmin(flat[:4, 0]))]  # the edge at the left of the picture
    middle = camera.project((region.low + region.high)[None] / 2)[0, :2]
    for axis in range(3):
        ticks = nice_ticks(region.low[axis], region.high[axis])
        for value in ticks:
            point = np.array(upright if axis == 2 else front)
            point[axis] = value
            at = camera.project(point[None])[0, :2]
            if axis == 2:
                out = np.array([-1.0, 0.0])
            else:
                along = camera.project(np.eye(3)[axis][None])[0, :2]
                across = np.array([-along[1], along[0]])
                out = across * np.sign(across @ (at - middle))
            out = out / np.linalg.norm(out)
            # The corner has the end of x already.
            if axis == 1 and abs(value - front[1]) < 0.02 * (region.high - region.low)[1]:
                continue
            label = f"{value:.3g}" + (f" m\n{AXES[axis]}" if value == ticks[-1] else "")
            axes.annotate(label, at, xytext=(9 + 5 * (axis == 2)) * out,
                          textcoords="offset points", fontsize=7.5, ha="center", va="center",
                          color="#444444", zorder=5)


def draw_oblique(axes, frame, scale, camera, region, alpha, pixels):
    draw_box(axes, camera, region)
    box = camera.project(region.corners())
    low, high = box.min(axis=0) - region.reach, box.max(axis=0) + region.reach
    low, high = low - 0.03 * (high - low), high + 0.03 * (high - low)
    canvas = Canvas(low[0], high[0], low[1], high[1], (high - low)[:2].max() / pixels)
    canvas.spheres(camera.project(frame.centre), frame.radius,
                   scale.colours(frame.values(scale.by)))
    if frame.triangles.size:
        canvas.triangles(camera.project(frame.triangles), STEEL, alpha)
    axes.imshow(canvas.image(), extent=canvas.extent, origin="lower", interpolation="antialiased",
                zorder=2)
    axes.set_aspect("equal")
    margin = 0.09 * (high - low)[:2].max()
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.axis("off")


def draw_cut(axes, frame, scale, axis, at, region):
    """Grains that a plane cuts, as they are cut there; outlines of bodies."""
    others = [k for k in range(3) if k != axis]
    off = frame.centre[:, axis] - at
    met = np.abs(off) < frame.radius
    radius = np.sqrt(frame.radius[met] ** 2 - off[met] ** 2)
    discs = EllipseCollection(2 * radius, 2 * radius, np.zeros_like(radius), units="xy",
                              offsets=frame.centre[met][:, others], transOffset=axes.transData,
                              facecolors=scale.colours(frame.values(scale.by)[met]),
                              edgecolors="#333333", linewidths=0.2)
    axes.add_collection(discs)
    both = [bond for bond in frame.bonds if met[bond].all()]
    if both:
        axes.add_collection(LineCollection(frame.centre[np.array(both)][..., others],
                                           colors="black", linewidths=0.6))
    if frame.triangles.size:
        axes.add_collection(LineCollection(cut(frame.triangles, axis, at), colors="#1b4965",
                                           linewidths=1.4))
    axes.set_aspect("equal")
    low, high = region.low[others], region.high[others]
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1] + 0.02 * (high - low)[1])
    axes.set_xlabel(f"{AXES[others[0]]} [m]")
    axes.set_ylabel(f"{AXES[others[1]]} [m]")
    axes.set_title(f"cut at {AXES[axis]} = {at:.3g} m", fontsize=9)


def draw_frame(frame, scale, name, options, region):
    axis, at = options.cut(frame)
    if frame.planar:
        figure = plt.figure(figsize=(9, 5))
        axes = figure.add_axes((0.08, 0.1, 0.78, 0.8))
        draw_cut(axes, frame, scale, 1, 0.5 * frame.box[1], region)
        axes.set_title("")
    else:
        figure = plt.figure(figsize=(11, 4.9))
        left = figure.add_axes((0.0, 0.02, 0.48, 0.88))
        axes = figure.add_axes((0.54, 0.11, 0.35, 0.76))
        draw_oblique(left, frame, scale, options.camera, region, options.body_alpha,
                     options.pixels)
        draw_cut(axes, frame, scale, axis, at, region)
    scale.bar(figure, (0.905, 0.18, 0.014, 0.62))
    figure.suptitle(f"{name}, {frame.time:.3f} s", fontsize=11)
    return figure


def unit_of(column):
    """(quantity, unit) of the name of a column."""
    for ending, unit in (("_n_m", "N m"), ("_m_per_s", "m/s"), ("_rad_per_s", "rad/s"),
                         ("_m2_per_s2", "m²/s²"), ("_pa", "Pa"), ("_rad", "rad"), ("_n", "N"),
                         ("_j", "J"), ("_m", "m"), ("_s", "s")):
        if column.endswith(ending):
            return column[:-len(ending)], unit
    return column, "-"


def panels_of(columns):
    """Columns that differ by their axis alone share a panel."""
    panels = {}
    for column in columns[1:]:
        key = re.sub(r"(?<![a-z])[xyz](?=_)", "*", column)
        panels.setdefault(key, []).append(column)
    return panels


def draw_series(columns, rows, name):
    """All columns that are not 0 throughout against time, and the vertical force of a body
    against its sinkage."""
    panels = {key: members for key, members in panels_of(columns).items()
              if np.any(rows[:, [columns.index(c) for c in members]])}
    curves = [(body, f"{body}.sinkage_m", f"{body}.f_z_n")
              for body in {c.split(".")[0] for c in columns if "." in c}
              if {f"{body}.sinkage_m", f"{body}.f_z_n"} <= set(columns)]
    count = max(1, len(panels) + len(curves))
    wide = min(3, count)
    tall = -(-count // wide)
    figure, axes = plt.subplots(tall, wide, figsize=(3.9 * wide, 2.5 * tall), squeeze=False,
                                layout="constrained")
    for one in axes.flat[count:]:
        one.axis("off")
    time = rows[:, 0]
    for one, (key, members) in zip(axes.flat, panels.items()):
        for column in members:
            label = re.search(r"(?<![a-z])([xyz])(?=_)", column)
            one.plot(time, rows[:, columns.index(column)], lw=1.1,
                     label=label.group(1) if label else None)
        quantity, unit = unit_of(key)
        one.set_ylabel(f"{quantity.replace('_*', '').replace('.*', '')} [{unit}]")
        one.set_xlabel("time [s]")
        one.grid(True)
        if len(members) > 1:
            one.legend(frameon=False, fontsize=8, ncol=3)
    for one, (body, across, up) in zip(axes.flat[len(panels):], curves):
        one.plot(rows[:, columns.index(across)], rows[:, columns.index(up)], lw=1.1)
        one.set_xlabel(f"{body} sinkage [m]")
        one.set_ylabel(f"{body} f_z [N]")
        one.grid(True)
    figure.suptitle(name, fontsize=11)
    return figure


def save(figure, path):
    """Written aside and renamed."""
    aside = path.with_suffix(".tmp" + path.suffix)
    figure.savefig(aside)
    plt.close(figure)
    os.replace(aside, path)


def make_film(pictures, folder, rate):
    """Path of the film, and what made it; nothing: neither of the two is there."""
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg:
        listed = folder / "film.txt"
        listed.write_text("".join(f"file '{p.name}'\nduration {1 / rate}\n" for p in pictures))
        target = folder / "film.mp4"
        done = subprocess.run(
            [ffmpeg, "-y", "-loglevel", "error", "-f", "concat", "-i", str(listed), "-vf",
             "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", str(target)], check=False)
        listed.unlink()
        if done.returncode == 0:
            return target, "ffmpeg"
    try:
        from PIL import Image  # pylint: disable=import-outside-toplevel
    except ImportError:
        return None, "neither ffmpeg nor pillow"
    images = [Image.open(p).convert("RGB").quantize(128) for p in pictures]
    target = folder / "film.gif"
    images[0].save(target, save_all=True, append_images=images[1:],
                   duration=max(20, round(1000 / rate)), loop=0)
    return target, "pillow"


class Options:
    """What the arguments mean."""

    def __init__(self, arguments):
        self.camera = Camera(arguments.azimuth_deg, arguments.elevation_deg)
        self.body_alpha, self.pixels = arguments.body_alpha, arguments.pixels
        self._cut = None
        if arguments.cut:
            match = re.fullmatch(r"([xyz])=([-+.\deE]+)", arguments.cut)
            if not match:
                raise BadFile(f"--cut {arguments.cut}: expected x=, y= or z= and metres")
            try:
                self._cut = AXES.index(match.group(1)), float(match.group(2))
            except ValueError as error:
                raise BadFile(f"--cut {arguments.cut}: {error}") from error

    def cut(self, frame):
        """(axis, place): as asked for, else across the middle of the box along y."""
        return self._cut or (1, 0.5 * frame.box[1])


def parse(arguments):
    parser = argparse.ArgumentParser(prog="grouser dem view", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", metavar="RUN", help="OUT.run.h5, as given to `dem run --out`")
    parser.add_argument("--out", help="folder of the pictures; default: OUT.view")
    parser.add_argument("--by", choices=MEASURES, default="speed", help="colour of the grains")
    parser.add_argument("--at", type=float, action="append", metavar="SECONDS",
                        help="only the frames nearest to these times")
    parser.add_argument("--cut", metavar="AXIS=METRES", help="plane of the cut, as y=0.09")
    parser.add_argument("--azimuth-deg", type=float, default=35.0)
    parser.add_argument("--elevation-deg", type=float, default=28.0)
    parser.add_argument("--body-alpha", type=float, default=0.7, help="0: bodies are clear")
    parser.add_argument("--pixels", type=int, default=700, help="of the longer side of the view")
    parser.add_argument("--patch", metavar="BODY", help="pressure and shear on its contact patch")
    parser.add_argument("--cell", type=float, metavar="METRES",
                        help="side of the cells of the patch; default: two diameters of the largest grain")
    parser.add_argument("--film", action="store_true", help="of all frames")
    parser.add_argument("--rate", type=float, default=10.0, help="frames of the film per second")
    return parser.parse_args(arguments)


def view_patch(frame, stem, arguments, path):
    names = read_names(stem)
    if arguments.patch not in names:
        raise BadFile(f"--patch {arguments.patch}: no such body, expected one of {', '.join(names)}")
    side = arguments.cell if arguments.cell is not None else 4 * float(frame.radius.max(initial=0.0))
    if not side > 0:
        raise BadFile(f"--cell {side:g}: expected more than 0")
    figure = draw_patch(frame, names.index(arguments.patch),
                        f"{pathlib.Path(stem).name}, {arguments.patch}", side)
    if figure is None:
        print(f"{frame.time:.3f} s: nothing touches {arguments.patch}", file=sys.stderr)
        return
    save(figure, path)
    print(path)


def view(arguments):
    options, stem = Options(arguments), stem_of(arguments.run)
    name = pathlib.Path(stem).name
    series = read_series(stem)
    has_frames = pathlib.Path(stem + ".frames").is_dir()
    if series is None or has_frames or arguments.at or arguments.film:
        files = list_frames(stem)
    else:
        files = []
        print(f"{stem}.frames: no frames; the series alone is drawn", file=sys.stderr)
    if arguments.at:
        times = np.array([time for time, *_ in files])
        files = [files[k] for k in sorted({int(np.abs(times - t).argmin())
                                           for t in arguments.at})]
    folder = pathlib.Path(arguments.out or stem + ".view")
    folder.mkdir(parents=True, exist_ok=True)
    pictures = []
    if files:
        frames = [Frame(*parts) for _, *parts in files]
        scale, region = Scale(frames, arguments.by), Region(frames)
        for (_, grains, *_), frame in zip(files, frames):
            number = re.search(r"(\d+)\.vtp$", grains.name).group(1)
            pictures.append(folder / f"{arguments.by}_{number}.png")
            save(draw_frame(frame, scale, name, options, region), pictures[-1])
            print(pictures[-1])
            if arguments.patch:
                view_patch(frame, stem, arguments, folder / f"patch_{number}.png")
    if series:
        save(draw_series(*series, name), folder / "series.png")
        print(folder / "series.png")
    if arguments.film:
        target, by = make_film(pictures, folder, arguments.rate)
        if target is None:
            print(f"no film: {by} is installed; the pictures are there", file=sys.stderr)
            return 1
        print(f"{target} (by {by})")
    return 0


def main(arguments):
    try:
        return view(parse(arguments))
    except BadFile as error:
        print(f"grouser dem view: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"grouser dem view: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
