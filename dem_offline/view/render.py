"""Spheres and triangles into a picture, through a depth buffer."""

import numpy as np


class Camera:
    """Oblique, without perspective: azimuth about z (0: from -y), elevation above the floor."""

    def __init__(self, azimuth_deg=35.0, elevation_deg=28.0):
        a, e = np.radians(azimuth_deg), np.radians(elevation_deg)
        self.right = np.array([np.cos(a), np.sin(a), 0.0])
        away = np.array([-np.sin(a) * np.cos(e), np.cos(a) * np.cos(e), -np.sin(e)])
        self.up = np.cross(self.right, away)
        self.towards = -away

    def project(self, points):
        """(right, up, towards the eye) [m]."""
        return np.stack([points @ self.right, points @ self.up, points @ self.towards], axis=-1)


class Canvas:
    """Pixels over [left, right] x [low, high] metres of the picture's plane."""

    LIGHT = np.array([-0.45, 0.55, 0.70])  # right, up, towards the eye

    def __init__(self, left, right, low, high, metres_per_pixel):
        self.left, self.low, self.scale = left, low, metres_per_pixel
        self.width = max(2, int(np.ceil((right - left) / metres_per_pixel)))
        self.height = max(2, int(np.ceil((high - low) / metres_per_pixel)))
        self.extent = (left, left + self.width * metres_per_pixel,
                       low, low + self.height * metres_per_pixel)
        self.light = self.LIGHT / np.linalg.norm(self.LIGHT)
        self.colour = np.ones((self.height, self.width, 3))
        self.depth = np.full((self.height, self.width), -np.inf)

    def _window(self, x0, x1, y0, y1):
        """Pixels whose middles lie in a rectangle: slices and the middles' coordinates."""
        i0 = max(0, int(np.ceil((x0 - self.left) / self.scale - 0.5)))
        i1 = min(self.width, int(np.floor((x1 - self.left) / self.scale - 0.5)) + 1)
        j0 = max(0, int(np.ceil((y0 - self.low) / self.scale - 0.5)))
        j1 = min(self.height, int(np.floor((y1 - self.low) / self.scale - 0.5)) + 1)
        if i0 >= i1 or j0 >= j1:
            return None
        x = self.left + (np.arange(i0, i1) + 0.5) * self.scale
        y = self.low + (np.arange(j0, j1) + 0.5) * self.scale
        return slice(j0, j1), slice(i0, i1), x, y

    def spheres(self, centres, radii, colours):
        """centres: projected; nearest first, so that most of what is hidden is never painted."""
        for k in np.argsort(-centres[:, 2]):
            x, y, z = centres[k]
            r = radii[k]
            window = self._window(x - r, x + r, y - r, y + r)
            if window is None:
                continue
            rows, columns, px, py = window
            dx, dy = (px - x)[None, :] / r, (py - y)[:, None] / r
            rest = 1.0 - dx * dx - dy * dy
            depth = z + r * np.sqrt(np.maximum(rest, 0.0))
            seen = (rest > 0) & (depth > self.depth[rows, columns])
            if not seen.any():
                continue
            nz = np.sqrt(np.maximum(rest, 0.0))
            shade = dx * self.light[0] + dy * self.light[1] + nz * self.light[2]
            shade = 0.45 + 0.55 * np.clip(shade, 0, 1)
            self.depth[rows, columns][seen] = depth[seen]
            self.colour[rows, columns][seen] = (shade[..., None] * colours[k])[seen]

    def triangles(self, corners, colour, alpha):
        """corners: projected [n, 3, 3]. What is in front of the spheres is mixed over them once."""
        front = np.full_like(self.depth, -np.inf)
        paint = np.zeros_like(self.colour)
        edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normals = np.cross(*edges)
        size = np.linalg.norm(normals, axis=1)
        for t in np.flatnonzero(size > 0):
            a, b, c = corners[t]
            normal = normals[t] / size[t]
            shade = 0.45 + 0.55 * abs(normal @ self.light)
            low, high = corners[t].min(axis=0), corners[t].max(axis=0)
            window = self._window(low[0], high[0], low[1], high[1])
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if window is None or area == 0:
                continue
            rows, columns, px, py = window
            x, y = px[None, :], py[:, None]
            u = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
            v = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
            depth = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
            seen = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & \
                (depth > front[rows, columns])
            front[rows, columns][seen] = depth[seen]
            paint[rows, columns][seen] = shade * np.asarray(colour)
        seen = front > self.depth
        self.colour[seen] = (1 - alpha) * self.colour[seen] + alpha * paint[seen]
        # A step of depth or its end is an edge.
        deep = np.where(np.isfinite(front), front, self.depth.min(initial=0, where=np.isfinite(
            self.depth)) - 1)
        edge = np.zeros_like(seen)
        jump = 6 * self.scale
        edge[:, 1:] |= np.abs(np.diff(deep, axis=1)) > jump
        edge[1:, :] |= np.abs(np.diff(deep, axis=0)) > jump
        edge &= seen | ~np.isfinite(self.depth)
        self.colour[edge & seen] = 0.25
        self.depth = np.maximum(self.depth, front)

    def image(self):
        """RGBA, nothing where nothing was painted."""
        alpha = np.isfinite(self.depth).astype(float)
        return np.concatenate([np.clip(self.colour, 0, 1), alpha[..., None]], axis=-1)


def cut(triangles, axis, at):
    """Segments in which triangles meet a plane, without that axis: [n, 2, 2]."""
    off = triangles[:, :, axis] - at
    # What touches the plane counts as above: every triangle then meets it in a segment or not.
    off = np.where(np.abs(off) < 1e-12, 1e-12, off)
    crosses = (off.min(axis=1) < 0) & (off.max(axis=1) > 0)
    others = [k for k in range(3) if k != axis]
    segments = []
    for corner, d in zip(triangles[crosses], off[crosses]):
        ends = []
        for k in range(3):
            l = (k + 1) % 3
            if d[k] * d[l] < 0:
                ends.append((corner[k] + d[k] / (d[k] - d[l]) * (corner[l] - corner[k]))[others])
        segments.append(ends)
    return np.array(segments).reshape(-1, 2, 2)
