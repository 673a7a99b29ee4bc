#!/usr/bin/python3
"""Pictures of runs: the files are read as they are written, projection and cut are exact, and
what is drawn is there. A run of GROUSER_DEM gives the files, where it is set."""

import os
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "dem_offline" / "view"))
import frames  # noqa: E402
import patch  # noqa: E402
import render  # noqa: E402
import view  # noqa: E402

DROP = """name: drop
materials: {name: sand, density_kg_per_m3: 2500, youngs_modulus_pa: 5.0e6}
interfaces: {between: [any, any], restitution: 0.5, friction: 0.5}
box: {length_m: 0.2, width_m: 0.2, height_m: 0.3, material: sand}
grains: {kind: lattice, material: sand, diameter_m: 0.01, count: 20}
bodies:
  - {name: plate, material: sand, parts: {shape: box, size_m: [0.06, 0.04, 0.02]},
     position_m: [0.1, 0.1, 0.1], motion: [{do: lower, speed_m_per_s: 0.1, for_s: 0.05}]}
output: {frames: {every_s: 0.02}}
"""


class ContactPatch(unittest.TestCase):
    def test_cells_hold_all_of_the_force(self):
        rng = np.random.default_rng(1)
        point = rng.uniform(0, 0.1, (40, 3))
        normal = np.column_stack([0.3 * rng.uniform(-1, 1, (40, 2)), -np.ones(40)])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        pressed, slid = rng.uniform(1, 2, 40), np.cross(normal, [0.0, 1.0, 0.0])
        seen = patch.Patch(point, normal, -pressed[:, None] * normal + 0.5 * slid)
        np.testing.assert_allclose(seen.normal_n, pressed)
        np.testing.assert_allclose(seen.across @ seen.along, 0, atol=1e-12)
        self.assertGreater(seen.across[0], 0.9)
        self.assertGreater(seen.along[1], 0.9)
        _, pressure, shear = seen.cells(0.02)
        np.testing.assert_allclose(pressure.sum() * 0.02 ** 2, pressed.sum())
        np.testing.assert_allclose(shear.sum(axis=(0, 1)) * 0.02 ** 2,
                                   [0.5 * (slid @ seen.across).sum(), 0.5 * (slid @ seen.along).sum()])
        frame = types.SimpleNamespace(touch_body=np.zeros(40, int), touch_point=point, time=0.5,
                                      touch_normal=normal, touch_force=-pressed[:, None] * normal)
        figure = patch.draw_patch(frame, 0, "plate", 0.02)
        self.assertEqual([one.get_ylabel() for one in figure.axes[2:]],
                         ["pressure [kPa]", "shear stress [kPa]"])
        self.assertIsNone(patch.draw_patch(frame, 1, "plate", 0.02))
        with self.assertRaises(frames.BadFile):
            seen.cells(1e-300)
        around = patch.Patch(point[:2], np.array([[1.0, 0, 0], [-1, 0, 0]]),
                             np.array([[-1.0, 0, 0], [1, 0, 0]]))
        self.assertTrue(np.isfinite(around.at_m).all())


class Run(unittest.TestCase):
    """A run of the program, seen."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.stem = pathlib.Path(cls.folder.name) / "drop"
        file = cls.stem.with_suffix(".yaml")
        file.write_text(DROP)
        subprocess.run([os.environ["GROUSER_DEM"], "run", file, "--out", f"{cls.stem}.run.h5"],
                       check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_frames_come_at_their_times_and_at_the_end(self):
        times = [time for time, *_ in frames.list_frames(str(self.stem))]
        self.assertEqual(len(times), 4)
        np.testing.assert_allclose(times, [0, 0.02, 0.04, 0.05], atol=2e-4)

    def test_grains_and_bodies_stand_where_the_experiment_puts_them(self):
        files = frames.list_frames(str(self.stem))
        first, last = (frames.Frame(*files[k][1:]) for k in (0, -1))
        np.testing.assert_allclose(first.box, [0.2, 0.2, 0.3])
        self.assertEqual(sorted(first.ids), list(range(20)))
        np.testing.assert_allclose(first.radius, 0.005, rtol=1e-6)
        self.assertTrue((first.centre > 0).all())
        self.assertEqual(first.bonds.shape, (0, 2))
        np.testing.assert_allclose(first.triangles.reshape(-1, 3).min(axis=0), [0.07, 0.08, 0.09],
                                   atol=1e-6)
        np.testing.assert_allclose(first.triangles.reshape(-1, 3).max(axis=0), [0.13, 0.12, 0.11],
                                   atol=1e-6)
        np.testing.assert_allclose(last.triangles[..., 2].min(), 0.085, atol=1e-4)
        self.assertGreater(last.speed.max() + last.contacts.max(), 0)

    def test_pictures_film_and_series_are_written(self):
        out = pathlib.Path(self.folder.name) / "pictures"
        self.assertEqual(view.main([f"{self.stem}.run.h5", "--out", str(out), "--film",
                                    "--pixels", "120", "--by", "size", "--patch", "plate"]), 0)
        names = sorted(p.name for p in out.iterdir())
        self.assertEqual([n for n in names if n.startswith("size_")],
                         [f"size_{k:06}.png" for k in range(4)])
        self.assertIn("series.png", names)
        self.assertEqual(frames.read_names(str(self.stem)), ["plate"])
        self.assertTrue({"film.gif", "film.mp4"} & set(names))

    def test_bad_input_is_named(self):
        self.assertEqual(view.main([f"{self.stem}.run.h5", "--cut", "q=1"]), 2)
        self.assertEqual(view.main([f"{self.stem}_ghost.run.h5"]), 2)
        self.assertEqual(view.main([f"{self.stem}.run.h5", "--patch", "ghost"]), 2)
        self.assertEqual(view.main([f"{self.stem}.run.h5", "--patch", "plate", "--cell", "0"]), 2)
        whole = pathlib.Path(f"{self.stem}.frames/grains_000000.vtp").read_bytes()
        short = pathlib.Path(self.folder.name) / "short.vtp"
        short.write_bytes(whole[:-200])
        with self.assertRaisesRegex(frames.BadFile, "cut short"):
            frames.read_vtp(short)


class Pictures(unittest.TestCase):
    """Projection, depth and cut against closed forms."""

    def test_camera_keeps_lengths_and_is_right_handed(self):
        camera = render.Camera(35, 28)
        basis = np.stack([camera.right, camera.up, camera.towards])
        np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-12)
        self.assertAlmostEqual(np.linalg.det(basis), 1)
        self.assertGreater(camera.up[2], 0)  # z points up in the picture
        self.assertGreater(camera.towards[2], 0)  # seen from above

    def test_nearer_sphere_hides_the_other_whatever_the_order(self):
        red, blue = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
        for order in ([0, 1], [1, 0]):
            canvas = render.Canvas(-1, 1, -1, 1, 0.02)
            centres = np.array([[0, 0, 0.0], [0, 0, 1.0]])[order]
            colours = np.array([red, blue])[order]
            canvas.spheres(centres, np.array([0.5, 0.3])[order], colours)
            middle, side = canvas.colour[50, 50], canvas.colour[50, 71]
            self.assertGreater(middle[2], middle[0])
            self.assertGreater(side[0], side[2])

    def test_a_sphere_covers_its_area(self):
        canvas = render.Canvas(-1, 1, -1, 1, 0.005)
        canvas.spheres(np.zeros((1, 3)), np.array([0.5]), np.ones((1, 3)))
        area = np.isfinite(canvas.depth).sum() * 0.005 ** 2
        self.assertAlmostEqual(area, np.pi * 0.25, delta=2e-3)

    def test_triangles_lie_over_what_they_are_in_front_of(self):
        canvas = render.Canvas(-1, 1, -1, 1, 0.02)
        canvas.spheres(np.zeros((1, 3)), np.array([0.5]), np.array([[1.0, 0, 0]]))
        square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        for depth, covered in ((-1.0, False), (1.0, True)):
            corners = np.c_[square, np.full(4, depth)]
            one = render.Canvas(-1, 1, -1, 1, 0.02)
            one.spheres(np.zeros((1, 3)), np.array([0.5]), np.array([[1.0, 0, 0]]))
            one.triangles(corners[[[0, 1, 2], [0, 2, 3]]], (0, 1, 0), 1.0)
            green = one.colour[50, 50, 1] > one.colour[50, 50, 0]
            self.assertEqual(green, covered)

    def test_cut_of_a_cube_is_its_square(self):
        corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], float)
        quads = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
        faces = [t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))]
        segments = render.cut(corners[np.array(faces)], 1, 0.3)
        length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()
        self.assertAlmostEqual(length, 4)
        self.assertTrue(((segments > -1e-12) & (segments < 1 + 1e-12)).all())

    def test_columns_of_one_quantity_share_a_panel(self):
        columns = ["time_s", "a.f_x_n", "a.f_z_n", "a.sinkage_m", "a.x_m", "a.y_m"]
        panels = view.panels_of(columns)
        self.assertEqual(panels["a.f_*_n"], ["a.f_x_n", "a.f_z_n"])
        self.assertEqual(panels["a.*_m"], ["a.x_m", "a.y_m"])
        self.assertEqual(view.unit_of("a.t_x_n_m"), ("a.t_x", "N m"))


if __name__ == "__main__":
    if "GROUSER_DEM" not in os.environ:
        del Run
    unittest.main()
