#!/usr/bin/python3
"""Maps as grids of Nav2's costmap filters: rasters written here, and one of ./grouser map. Exit code 77: no
python3-gdal."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np

try:
    from osgeo import gdal, osr
except ImportError:
    print("skipped: no osgeo.gdal, which the package python3-gdal has")
    sys.exit(77)
from definitions import skip
from grouser_ros.speed_mask import HEADINGS, fill_grid, percent_of, read_speed_mask

import grouser

SOURCE = pathlib.Path(os.environ["GROUSER_SOURCE"])
BANDS = ("up", "down", "across", *HEADINGS)
UTM = 32632
NAN = np.nan


def write_map(folder, speeds, limit=0.8, epsg=UTM, transform=(500000, 2, 0, 5300000, 0, -2), bands=BANDS, text=None):
    """As ./grouser map writes it: speed.tif with a band for each way, map.json. speeds: {band: array}, "": the rest."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    first = speeds[""]
    raster = gdal.GetDriverByName("GTiff").Create(str(folder / "speed.tif"), first.shape[1], first.shape[0], len(bands),
                                                  gdal.GDT_Float32)
    raster.SetGeoTransform(transform)
    if epsg:
        reference = osr.SpatialReference()
        reference.ImportFromEPSG(epsg)
        raster.SetProjection(reference.ExportToWkt())
    for i, name in enumerate(bands):
        band = raster.GetRasterBand(i + 1)
        band.SetDescription(name)
        band.SetNoDataValue(NAN)
        band.WriteArray(speeds.get(name, first).astype(np.float32))
    raster.FlushCache()
    (folder / "map.json").write_text(text or json.dumps({"options": {"speed_limit_m_per_s": limit}}))
    return folder


class MaskTest(unittest.TestCase):
    def setUp(self):
        gdal.UseExceptions()
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def refuses(self, pattern, folder, **named):
        with self.assertRaisesRegex(grouser.Error, pattern):
            read_speed_mask(folder, **named)

    def test_percent(self):
        limit = 0.7
        speeds = np.array([[0.7, 0.699, 0.35, 0.007, 0.0069, 0.0, NAN]])
        percent, keepout = percent_of(speeds.astype(np.float32), limit)
        self.assertEqual(percent.tolist(), [[100, 99, 50, 1, 1, 1, 1]])  # what is not known is not driven
        self.assertEqual(keepout.tolist(), [[0, 0, 0, 0, 100, 100, 100]])
        percent, keepout = percent_of(speeds.astype(np.float32), limit, drive_unknown=True)
        self.assertEqual(percent.tolist(), [[100, 99, 50, 1, 1, 1, -1]])
        self.assertEqual(keepout.tolist(), [[0, 0, 0, 0, 100, 100, -1]])
        for v in np.random.default_rng(1).uniform(0.01 * limit, limit, 2000).astype(np.float32):
            (p,), (k,) = percent_of(np.array([v]), limit)
            self.assertLessEqual(p / 100 * limit, v * (1 + 1e-6))
            self.assertGreater((p + 1) / 100 * limit, v * (1 - 1e-6))
            self.assertEqual(k, 0)

    def test_rows_from_the_south(self):
        speed = np.array([[0.8, 0.4, NAN], [0.2, 0.0, 0.8]])  # north first
        mask = read_speed_mask(write_map(self.folder / "map", {"": speed}), datum=(499990, 5299000),
                               drive_unknown=True)
        self.assertEqual(mask.speed.tolist(), [[25, 1, 100], [100, 50, -1]])
        self.assertEqual(mask.keepout.tolist(), [[0, 100, 0], [0, 0, -1]])
        self.assertEqual((mask.limit, mask.resolution, mask.origin), (0.8, 2.0, (10.0, 996.0)))
        grid = types.SimpleNamespace(header=types.SimpleNamespace(), info=types.SimpleNamespace(
            origin=types.SimpleNamespace(position=types.SimpleNamespace(), orientation=types.SimpleNamespace())))
        fill_grid(grid, mask, mask.speed, "site")
        self.assertEqual((grid.info.width, grid.info.height, grid.data), (3, 2, [25, 1, 100, 100, 50, -1]))
        self.assertEqual((grid.header.frame_id, grid.info.origin.position.x, grid.info.origin.orientation.w),
                         ("site", 10.0, 1.0))

    def test_ways(self):
        speeds = {"": np.full((3, 3), 0.4), "090": np.full((3, 3), 0.1), "225": np.full((3, 3), 0.6),
                  "up": np.zeros((3, 3))}
        folder = write_map(self.folder / "map", speeds)
        for way, percent in (("least", 12), ("most", 75), ("up", 1), ("000", 50)):
            self.assertEqual(np.unique(read_speed_mask(folder, way).speed).tolist(), [percent], way)
        speeds["090"][1, 1] = NAN  # unknown on one heading
        folder = write_map(self.folder / "hole", speeds)
        got = [int(read_speed_mask(folder, way, drive_unknown=True).speed[1, 1]) for way in ("least", "most", "225")]
        self.assertEqual(got, [-1, -1, 75])

    def test_refusals(self):
        flat = {"": np.full((3, 3), 0.4)}
        self.refuses("gone: got .*expected a folder of ./grouser map", self.folder / "gone")
        for number, (epsg, got) in enumerate(((0, "no reference system"), (4326, "WGS 84"), (2225, "NAD83.*ftUS."))):
            self.refuses(f"speed.tif: got {got}, expected a projected reference system in metres",
                         write_map(self.folder / f"1{number}", flat, epsg=epsg))
        self.refuses("got cells of 2.0 x 3.0 m.*expected square ones",
                     write_map(self.folder / "3", flat, transform=(5e5, 2, 0, 53e5, 0, -3)))
        self.refuses("got cells of .*turned by 0.1, 0.0",
                     write_map(self.folder / "4", flat, transform=(5e5, 2, 0.1, 53e5, 0, -2)))
        self.refuses("got no band 'sideways', expected a way of least, most or up, down, across, 000",
                     write_map(self.folder / "5", flat), way="sideways")
        self.refuses("got no band '000'", write_map(self.folder / "6", flat, bands=("up", "down")))
        self.refuses("speed_limit_m_per_s: got -1, expected a number above 0",
                     write_map(self.folder / "7", flat, limit=-1))
        self.refuses("expected a folder of ./grouser map", write_map(self.folder / "8", flat, text="{"))
        self.refuses("expected a folder of ./grouser map", write_map(self.folder / "9", flat, text="{}"))
        (write_map(self.folder / "10", flat) / "speed.tif").write_text("no raster")
        self.refuses("10: got .*expected a folder of ./grouser map", self.folder / "10")

    def test_a_map_of_grouser(self):
        program = pathlib.Path(os.environ["GROUSER_BIN"], "grouser-map")
        if not program.exists():
            skip(self, "no grouser-map: it needs libgdal-dev")
        cells, size = np.full((12, 20), 100.0), 12
        cells += 0.4 * np.arange(20) ** 2 / 10  # steeper and steeper to the east: 0.08 to 1.5 m a metre
        cells[:3, :3] = -9999
        elevation = self.folder / "elevation.tif"
        raster = gdal.GetDriverByName("GTiff").Create(str(elevation), 20, size, 1, gdal.GDT_Float32)
        raster.SetGeoTransform((500000, 1, 0, 5300000, 0, -1))
        reference = osr.SpatialReference()
        reference.ImportFromEPSG(UTM)
        raster.SetProjection(reference.ExportToWkt())
        raster.GetRasterBand(1).SetNoDataValue(-9999)
        raster.GetRasterBand(1).WriteArray(cells)
        raster.FlushCache()
        out = self.folder / "map"
        subprocess.run([program, grouser.VEHICLE_DIR / "husky.vehicle.yaml", "--elevation", elevation, "--soil",
                        "asphalt", "--limit", "0.8", "--no-pictures", "--out", out], check=True, timeout=240,
                       stdout=subprocess.DEVNULL)
        mask, closed = read_speed_mask(out, drive_unknown=True), read_speed_mask(out)
        self.assertEqual(closed.speed[mask.speed < 0].tolist(), [1] * (mask.speed < 0).sum())
        self.assertEqual(closed.keepout[mask.speed < 0].tolist(), [100] * (mask.speed < 0).sum())
        self.assertEqual((mask.speed.shape, mask.limit, mask.resolution, mask.origin),
                         ((12, 20), 0.8, 1.0, (500000.0, 5299988.0)))
        self.assertEqual(set(mask.speed[0]), {-1})  # the outermost cells have no slope
        self.assertEqual(mask.speed[10, 2], -1)  # beside the hole in the north-west
        row, kept = mask.speed[5, 1:-1], mask.keepout[5, 1:-1]
        self.assertEqual((row[0], kept[0]), (99, 0))  # a slope of 0.04: made good is v cos(grade)
        self.assertEqual((row[-1], kept[-1]), (1, 100))  # of 1.5: not driven
        self.assertTrue((np.diff(row.astype(int)) <= 0).all() and (np.diff(kept.astype(int)) >= 0).all(), row)
        self.assertGreaterEqual(len(set(row.tolist())), 3)


if __name__ == "__main__":
    unittest.main()
