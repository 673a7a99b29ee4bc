#!/usr/bin/python3
"""Draws the rasters of a map over a hillshade: speed.png, energy.png, go_least.png, binding.png, each up,
across and down the slope. grouser-map calls it with its unfinished folder.
Usage: map_pictures.py FOLDER"""

import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["text.parse_math"] = False  # a "$" in a name is one
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.colors import BoundaryNorm, ListedColormap  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

WAYS = ("up", "across", "down")
NOT_DRIVEN = "#5a2a2a"


def hillshade(z, width, height):
    """Lambert's law with the light from the north-west, 45 degrees high."""
    north, east = np.gradient(z, height, width)
    north = -north  # rows go south
    light = np.array([-0.5, 0.5, np.sqrt(0.5)])
    return (-east * light[0] - north * light[1] + light[2]) / np.sqrt(1 + east**2 + north**2)


class Map:
    def __init__(self, folder):
        self.folder = folder
        self.info = json.loads((folder / "map.json").read_text(encoding="utf-8"))
        x, width, _, y, _, height = self.info["grid"]["geotransform"]
        columns, rows = self.info["grid"]["columns"], self.info["grid"]["rows"]
        self.extent = np.array([0, columns * width, rows * height, 0])
        self.label = f"m east of {x:.0f}", f"m north of {y:.0f}"
        z = self.read("elevation")[0]
        self.shade = hillshade(z, columns * width / z.shape[1], -rows * height / z.shape[0])
        self.speed = self.read("speed")

    def read(self, name):
        return np.load(self.folder / "thinned" / f"{name}.npy")

    def band(self, cells, way):
        return cells[self.info["bands"].index(way)]

    def figure(self, title):
        figure, axes = plt.subplots(1, 3, figsize=(15, 5.8), sharey=True, constrained_layout=True)
        soils = ", ".join(s["soil"] for s in self.info["soils"])
        figure.suptitle(f"{title}: {self.info['vehicle']['name']} on {soils}")
        for way, axis in zip(WAYS, axes):
            axis.imshow(self.shade, cmap="gray", vmin=0, vmax=1, extent=self.extent)
            axis.set_title(f"{way} the slope")
            axis.set_xlabel(self.label[0])
        axes[0].set_ylabel(self.label[1])
        return figure, axes

    def show(self, axis, cells, **options):
        return axis.imshow(cells, extent=self.extent, alpha=0.75, interpolation="nearest", **options)

    def not_driven(self, axis, way):
        stops = np.where(self.band(self.speed, way) == 0, 1.0, np.nan)
        self.show(axis, stops, cmap=ListedColormap([NOT_DRIVEN]), vmin=0, vmax=1)

    def save(self, figure, name):
        figure.savefig(self.folder / f"{name}.png", dpi=90)
        plt.close(figure)

    def numbers(self, name, title, label, cmap, limits, cover=True):
        cells = self.read(name)
        figure, axes = self.figure(title)
        low, high = limits(cells)
        for way, axis in zip(WAYS, axes):
            band = self.band(cells, way)
            image = self.show(axis, np.where(band == 0, np.nan, band) if cover else band, cmap=cmap, vmin=low,
                              vmax=high)
            if cover:
                self.not_driven(axis, way)
        figure.colorbar(image, ax=axes, label=label, shrink=0.85)
        if cover:
            figure.legend(handles=[Patch(color=NOT_DRIVEN, label="not driven")], loc="upper right")
        self.save(figure, name)

    def binding(self):
        cells, names = self.read("binding"), self.info["binding"]
        there = [int(v) for v in names if int(v) != 255 and (cells == int(v)).any()]
        colours = plt.get_cmap("tab10")(np.arange(len(there)) % 10)
        norm = BoundaryNorm(np.arange(len(there) + 1) - 0.5, len(there))
        figure, axes = self.figure("What binds")
        for way, axis in zip(WAYS, axes):
            band = self.band(cells, way)
            index = np.full(band.shape, np.nan)
            for i, value in enumerate(there):
                index[band == value] = i
            self.show(axis, index, cmap=ListedColormap(colours), norm=norm)
            stops = np.where(self.band(self.speed, way) == 0, 1.0, 0.0)
            if 0 < stops.mean() < 1:
                axis.contour(np.linspace(*self.extent[:2], stops.shape[1]),
                             np.linspace(self.extent[3], self.extent[2], stops.shape[0]), stops, [0.5],
                             colors="black", linewidths=0.8)
        handles = [Patch(color=c, label=names[str(v)]) for c, v in zip(colours, there)]
        handles.append(plt.Line2D([], [], color="black", label="edge of what is driven"))
        figure.legend(handles=handles, loc="lower center", ncol=len(handles))
        figure.get_layout_engine().set(rect=(0, 0.06, 1, 0.94))
        self.save(figure, "binding")


def main(arguments):
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    drawn = Map(pathlib.Path(arguments[0]))
    drawn.numbers("speed", "Speed made good", "m/s", "viridis", 
                  lambda c: (0, np.nanmax(c)) if np.isfinite(c).any() else (0, 1))
    drawn.numbers("energy", "Energy per metre of the map", "J/m", "magma_r",
                  lambda c: np.nanpercentile(c, [1, 99]) if np.isfinite(c).any() else (0, 1))
    drawn.numbers("go_least", "P(GO), creeping", "probability", "RdYlGn", lambda c: (0, 1), cover=False)
    drawn.binding()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
