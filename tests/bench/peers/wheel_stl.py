#!/usr/bin/python3
"""A closed cylinder about y through the origin as STL, for LIGGGHTS.

    wheel_stl.py RADIUS WIDTH OUT.stl [SEGMENTS]

480 sides: with 120, whose corners stand out by a grain's overlap, the wheel pulled about 1 N more.
The polygon has the cylinder's mean radius: its corners stand out as far as its sides fall short.
"""
import math
import sys


def write_wheel(radius, width, path, segments=480):
    corner = radius * 2 / (1 + math.cos(math.pi / segments))
    rim = [(corner * math.sin(2 * math.pi * k / segments),
            corner * math.cos(2 * math.pi * k / segments)) for k in range(segments)]
    half = width / 2
    triangles = []
    for (x0, z0), (x1, z1) in zip(rim, rim[1:] + rim[:1]):
        triangles.append(((x0, -half, z0), (x0, half, z0), (x1, half, z1)))
        triangles.append(((x0, -half, z0), (x1, half, z1), (x1, -half, z1)))
        triangles.append(((0, half, 0), (x1, half, z1), (x0, half, z0)))
        triangles.append(((0, -half, 0), (x0, -half, z0), (x1, -half, z1)))
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
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    write_wheel(float(sys.argv[1]), float(sys.argv[2]), sys.argv[3],
                *(int(s) for s in sys.argv[4:]))
