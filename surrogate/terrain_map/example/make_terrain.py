#!/usr/bin/python3
"""Makes a synthetic terrain of 200 x 200 cells of 2 m as GeoTIFF (UTM zone 32 north): elevation.tif (hills
of a power-law spectrum, noise of 4 cm, a hill with steep sides, a valley, a few cells without data), soil.tif (class
1: firm ground, 2: ice on the valley's floor), p_firm.tif and p_ice.tif (the same as probabilities, unsure
along the edge). Nothing in it was measured.
Usage: make_terrain.py FOLDER [--cells N] [--seed K]"""

import argparse
import pathlib

import numpy as np
from PIL import Image, TiffImagePlugin

CELL_M = 2.0
ORIGIN = (500000.0, 5300000.0)  # of the north-west corner
EPSG = 32632
NODATA = -9999.0


def write_geotiff(path, cells):
    """One band, north up. GeoTIFF 1.1: ModelPixelScale, ModelTiepoint, GeoKeyDirectory, GDAL's nodata."""
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    keys = (1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, EPSG)
    for tag, kind, value in ((33550, 12, (CELL_M, CELL_M, 0.0)), (33922, 12, (0.0, 0.0, 0.0, *ORIGIN, 0.0)),
                             (34735, 3, keys), (42113, 2, f"{NODATA:g}" if cells.dtype != np.uint8 else "0")):
        tags.tagtype[tag] = kind
        tags[tag] = value
    Image.fromarray(cells).save(path, tiffinfo=tags)


def rough(n, random, exponent, longest):
    """Heights of unit variance whose spectrum falls as frequency^-exponent, none longer than `longest` cells."""
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(n), np.fft.rfftfreq(n), indexing="ij"))
    f[0, 0] = 1
    wave = random.normal(size=f.shape) + 1j * random.normal(size=f.shape)
    z = np.fft.irfft2(wave * np.where(f < 1 / longest, 0, f ** (-exponent / 2)), s=(n, n))
    return z / z.std()


def terrain(n, seed):
    random = np.random.default_rng(seed)
    y, x = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    scale = n * CELL_M / 400
    hill = 45 * np.exp(-((x - 0.62) ** 2 + (y - 0.42) ** 2) / 0.012) * scale
    valley_at = 0.75 + 0.06 * np.sin(7 * x)
    valley = -9 * (0.2 + 0.8 * np.sin(5 * x) ** 2) * np.exp(-((y - valley_at) / 0.11) ** 2) * scale
    z = 400 + 5 * scale * rough(n, random, 4.6, n) + 0.04 * random.normal(size=(n, n)) + hill + valley
    ice = 1 / (1 + np.exp((np.abs(y - valley_at) - 0.045) / 0.008))
    z[int(0.08 * n):int(0.11 * n), int(0.2 * n):int(0.27 * n)] = NODATA
    return z.astype(np.float32), ice.astype(np.float32)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cells", type=int, default=200, help="a side")
    parser.add_argument("--seed", type=int, default=7)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    z, ice = terrain(arguments.cells, arguments.seed)
    write_geotiff(arguments.folder / "elevation.tif", z)
    write_geotiff(arguments.folder / "soil.tif", np.where(ice > 0.5, 2, 1).astype(np.uint8))
    write_geotiff(arguments.folder / "p_ice.tif", ice)
    write_geotiff(arguments.folder / "p_firm.tif", 1 - ice)


if __name__ == "__main__":
    main()
