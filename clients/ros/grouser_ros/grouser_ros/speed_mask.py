"""The rasters of ./grouser map as grids of Nav2's costmap filters: where to drive, and how fast. No ROS here."""

import dataclasses
import json
import math
import pathlib

import numpy as np
from grouser import Error

HEADINGS = ("000", "045", "090", "135", "180", "225", "270", "315")
UNKNOWN, FREE, NOT_DRIVEN, SLOWEST = -1, 0, 100, 1


@dataclasses.dataclass
class SpeedMask:
    """Two grids of int8, rows from south to north, columns from west to east.

    speed: 1 to 100, percent of `limit`. Never 0, which means "no limit" to Nav2's speed filter.
    keepout: 100: not driven at the risk of the map, or slower than 1 % of the limit; 0: driven.
    Both -1 where the map knows nothing, if that may be driven: Nav2's filters pass over -1.
    """

    speed: np.ndarray
    keepout: np.ndarray
    limit: float  #: the map's --limit [m/s]; Nav2's filter of type 2: base 0, multiplier limit/100
    resolution: float  #: of the square cells [m]
    origin: tuple  #: of the south-west corner: easting and northing less those of the datum [m]


def percent_of(speed, limit, drive_unknown=False):
    """(speed, keepout) of speeds made good [m/s], NaN: unknown. Rounded down: no cell is faster than the map."""
    share = np.floor(100.0 * (speed.astype(np.float32) / np.float32(limit)).astype(float))
    unknown = np.isnan(share) & drive_unknown
    share = np.nan_to_num(share, nan=0.0)
    percent = np.where(unknown, UNKNOWN, np.clip(share, SLOWEST, 100)).astype(np.int8)
    keepout = np.where(unknown, UNKNOWN, np.where(share < 1, NOT_DRIVEN, FREE)).astype(np.int8)
    return percent, keepout


def _bands_of(way, known, file):
    """The bands that `way` takes, and how they go together."""
    wanted = HEADINGS if way in ("least", "most") else (way,)
    for band in wanted:
        if band not in known:
            raise Error(f"{file}: got no band '{band}', expected a way of least, most or {', '.join(known)}")
    return [known.index(band) + 1 for band in wanted], np.maximum if way == "most" else np.minimum


def read_speed_mask(folder, way="least", datum=(0.0, 0.0), drive_unknown=False):
    """The SpeedMask of a folder of ./grouser map.

    way: a band of its rasters, or of all headings the slowest ('least': driven whichever way one goes) or the fastest.
    datum: easting and northing of the origin of ROS's map frame, in the map's reference system [m].
    drive_unknown: cells of which the map knows nothing are unknown, not kept out.
    Raises Error for a folder without a map, a raster without projection, cells that are not square, unknown bands.
    """
    try:
        from osgeo import gdal
    except ImportError:
        raise Error("speed mask: there is no osgeo.gdal, expected the package python3-gdal") from None
    gdal.UseExceptions()
    folder, file = pathlib.Path(folder), pathlib.Path(folder, "speed.tif")
    try:
        limit = json.loads((folder / "map.json").read_text())["options"]["speed_limit_m_per_s"]
        raster = gdal.Open(str(file))
    except (OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise Error(f"{folder}: got {error}, expected a folder of ./grouser map") from None
    if not (isinstance(limit, (int, float)) and math.isfinite(limit) and limit > 0):
        raise Error(f"{folder / 'map.json'}: speed_limit_m_per_s: got {limit}, expected a number above 0")
    reference = raster.GetSpatialRef()
    if reference is None or not reference.IsProjected() or reference.GetLinearUnits() != 1:
        got = "no reference system" if reference is None else reference.GetName()
        raise Error(f"{file}: got {got}, expected a projected reference system in metres")
    x, width, turn_x, y, turn_y, height = raster.GetGeoTransform()
    if turn_x or turn_y or not math.isclose(width, -height, rel_tol=1e-6) or width <= 0:
        raise Error(f"{file}: got cells of {width} x {-height} m, turned by {turn_x}, {turn_y}, expected square ones, "
                    "north up")
    known = [raster.GetRasterBand(b + 1).GetDescription() for b in range(raster.RasterCount)]
    bands, together = _bands_of(way, known, file)
    speed = None
    for band in bands:
        cells = raster.GetRasterBand(band).ReadAsArray()
        speed = cells if speed is None else together(speed, cells)
    percent, keepout = percent_of(speed[::-1], limit, drive_unknown)
    return SpeedMask(percent, keepout, float(limit), width,
                     (x - datum[0], y + height * raster.RasterYSize - datum[1]))


def fill_grid(grid, mask, cells, frame):
    """Writes `cells` of a mask into a nav_msgs/OccupancyGrid."""
    grid.header.frame_id = frame
    grid.info.resolution = mask.resolution
    grid.info.height, grid.info.width = cells.shape
    grid.info.origin.position.x, grid.info.origin.position.y = mask.origin
    grid.info.origin.orientation.w = 1.0
    grid.data = cells.ravel().tolist()
    return grid
