"""Pressure and shear on the contact patch of a body."""

import matplotlib.pyplot as plt
import numpy as np

from frames import BadFile

MOST_CELLS = 1e6


class Patch:
    """The contacts of one body, seen along the mean of their normal forces and summed in square
    cells.

    across, along: unit vectors of the picture's axes (world). normal_n [n]: force that presses a
    contact point in; shear_n [n, 2]: the rest of the force on the body, in the picture's axes."""

    def __init__(self, point_m, normal, force_n):
        self.normal_n = -np.sum(force_n * normal, axis=1)
        mean = np.sum(self.normal_n[:, None] * normal, axis=0)
        size = np.linalg.norm(mean)
        out = mean / size if size > 0 else normal[0]  # pressed from all sides alike
        axis = np.eye(3)[0 if abs(out[0]) < 0.9 else 1]
        self.across = axis - out * (axis @ out)
        self.across /= np.linalg.norm(self.across)
        self.along = np.cross(out, self.across) * (1 if out[2] > 0 else -1)
        plane = np.stack([self.across, self.along], axis=1)  # [xyz, 2]
        self.at_m = point_m @ plane
        self.shear_n = (force_n + self.normal_n[:, None] * normal) @ plane

    def cells(self, side_m):
        """(low corner [2], pressure [nx, ny], shear stress [nx, ny, 2]) [Pa] of cells that wide."""
        low = side_m * np.floor(self.at_m.min(axis=0) / side_m)
        wide = np.ptp(self.at_m, axis=0) / side_m + 2
        if not np.prod(wide) <= MOST_CELLS:
            raise BadFile(f"--cell {side_m:g}: {wide[0]:.0f} by {wide[1]:.0f} cells, expected at most "
                          f"{MOST_CELLS:g}")
        place = np.floor((self.at_m - low) / side_m).astype(int)
        size = place.max(axis=0) + 1
        sums = np.zeros((*size, 3))
        np.add.at(sums, (place[:, 0], place[:, 1]),
                  np.column_stack([self.normal_n, self.shear_n]))
        sums /= side_m ** 2
        return low, sums[..., 0], sums[..., 1:]


def axis_name(vector):
    """A world axis where it is one, else its direction."""
    for k, name in enumerate("xyz"):
        if abs(vector[k]) > 0.999:
            return f"{name} [m]"
    return "along (" + ", ".join(f"{v:.2f}" for v in vector) + ") [m]"


def draw_patch(frame, body, title, side_m):
    """Two maps; None where nothing touches the body."""
    own = frame.touch_body == body
    if not own.any():
        return None
    patch = Patch(frame.touch_point[own], frame.touch_normal[own], frame.touch_force[own])
    low, pressure, shear = patch.cells(side_m)
    high = low + side_m * np.array(pressure.shape)
    size = np.linalg.norm(shear, axis=-1)
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained", sharey=True)
    for one, values, label in zip(axes, (pressure, size), ("pressure [kPa]", "shear stress [kPa]")):
        shown = np.ma.masked_where((pressure == 0) & (size == 0), values / 1e3)
        image = one.imshow(shown.T, origin="lower", cmap="viridis",
                           extent=(low[0], high[0], low[1], high[1]))
        figure.colorbar(image, ax=one, label=label, shrink=0.8)
        one.set_xlabel(axis_name(patch.across))
        margin = 0.05 * (high - low).max()
        one.set_xlim(low[0] - margin, high[0] + margin)
        one.set_ylim(low[1] - margin, high[1] + margin)
    axes[0].set_ylabel(axis_name(patch.along))
    x, y = (low[k] + side_m * (np.arange(pressure.shape[k]) + 0.5) for k in (0, 1))
    far = size > 0.02 * size.max()
    place = np.argwhere(far)
    axes[1].quiver(x[place[:, 0]], y[place[:, 1]], shear[far][:, 0], shear[far][:, 1],
                   color="white", width=0.004)
    total = frame.touch_force[own].sum(axis=0)
    figure.suptitle(f"{title}, {frame.time:.3f} s: {own.sum()} contacts in cells of "
                    f"{1e3 * side_m:.3g} mm, force ({total[0]:.3g}, {total[1]:.3g}, "
                    f"{total[2]:.3g}) N", fontsize=10)
    return figure
