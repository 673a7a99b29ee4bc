#!/usr/bin/python3
"""A regular prism about y through the origin as STL, for LIGGGHTS.

    wheel_stl.py RADIUS WIDTH OUT.stl SIDES

The mesh of PrismWheel in dem_offline/engine/bench/wheel.h: its corners stand out as far as its
sides fall short.
"""
import math
import sys


def write_wheel(radius, width, path, sides):
    corner = radius * 2 / (1 + math.cos(math.pi / sides))
    rim = [(corner * math.sin(2 * math.pi * k / sides),
            corner * math.cos(2 * math.pi * k / sides)) for k in range(sides)]
    half = width / 2
    triangles = []
    for (x0, z0), (x1, z1) in zip(rim, rim[1:] + rim[:1]):
        triangles.append(((x0, -half, z0), (x1, half, z1), (x0, half, z0)))
        triangles.append(((x0, -half, z0), (x1, -half, z1), (x1, half, z1)))
        triangles.append(((0, half, 0), (x0, half, z0), (x1, half, z1)))
        triangles.append(((0, -half, 0), (x1, -half, z1), (x0, -half, z0)))
    with open(path, "w", encoding="ascii") as f:
        f.write("solid wheel\n")
        for t in triangles:
            u = [t[1][i] - t[0][i] for i in range(3)]
            v = [t[2][i] - t[0][i] for i in range(3)]
            n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
            size = math.sqrt(sum(c * c for c in n))
            f.write("facet normal " + " ".join(f"{c / size:.9g}" for c in n) + "\nouter loop\n")
            for p in t:
                f.write("vertex " + " ".join(f"{c:.12g}" for c in p) + "\n")
            f.write("endloop\nendfacet\n")
        f.write("endsolid wheel\n")


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    write_wheel(float(sys.argv[1]), float(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
