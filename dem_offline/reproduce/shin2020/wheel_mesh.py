#!/usr/bin/python3
"""Prints wheel.obj, the wheel of wheel.yaml as a closed mesh (tenths of millimetres, axle y):
wheel_mesh.py > wheel.obj"""

import math

RIM, TIP, HALF_WIDTH, HALF_TOOTH, TEETH = 900.0, 1000.0, 500.0, 88.5, 16
ARC, SLICES = 9, 12  # points of the rim between two teeth, slices along the axle


def profile():
    """Corners (x, z), counter-clockwise."""
    out = []
    half = math.asin(HALF_TOOTH / RIM)
    for k in range(TEETH):
        a = 2 * math.pi * k / TEETH
        low = RIM * math.cos(half)
        for along, across in ((low, -HALF_TOOTH), (TIP, -HALF_TOOTH), (TIP, HALF_TOOTH), (low, HALF_TOOTH)):
            out.append((along * math.cos(a) - across * math.sin(a), along * math.sin(a) + across * math.cos(a)))
        gap = 2 * math.pi / TEETH - 2 * half
        for i in range(1, ARC + 1):
            b = a + half + gap * i / (ARC + 1)
            out.append((RIM * math.cos(b), RIM * math.sin(b)))
    return out


def main():
    corners = profile()
    n = len(corners)
    print("# wheel_mesh.py; tenths of millimetres")
    for s in range(SLICES + 1):
        y = -HALF_WIDTH + 2 * HALF_WIDTH * s / SLICES
        for x, z in corners:
            print(f"v {x:.2f} {y:.2f} {z:.2f}")
    print(f"v 0 {-HALF_WIDTH:g} 0\nv 0 {HALF_WIDTH:g} 0")
    first, last = n * (SLICES + 1) + 1, n * (SLICES + 1) + 2
    for k in range(n):
        j = (k + 1) % n
        for s in range(SLICES):
            a, b, c, d = n * s + k + 1, n * s + j + 1, n * (s + 1) + j + 1, n * (s + 1) + k + 1
            print(f"f {a} {d} {c}\nf {a} {c} {b}")
        print(f"f {first} {k + 1} {j + 1}\nf {last} {n * SLICES + j + 1} {n * SLICES + k + 1}")


if __name__ == "__main__":
    main()
