#!/usr/bin/python3
"""docs/scene-files.md beside the readers in Python: the table and the example of a vary file, the keys of a soil file.
(Those of the readers in C++: tests/unit/campaign/scene_files_test.cc.) Usage: scene_files_test.py"""

import os
import re
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path[:0] = [os.path.join(ROOT, *folder) for folder in (
    ("dem_offline", "calibrate_grains"), ("dem_offline", "bevameter"), ("dem_offline", "validate"), ("clients", "common"))]

import grain_soil  # noqa: E402
import vary  # noqa: E402

with open(os.path.join(ROOT, "docs", "scene-files.md"), encoding="utf-8") as file:
    PAGE = file.read()


def keys(section):
    """Those of the page's table of a section."""
    table = PAGE.partition(f"\n### `{section}`\n")[2].partition("\n#")[0]
    return set(re.findall(r"^\| `(\w+)` \|", table, re.M))


class SceneFiles(unittest.TestCase):
    def example(self, name):
        """The example of the page, as a file."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = os.path.join(folder.name, name)
        with open(path, "w", encoding="utf-8") as out:
            out.write(re.search(rf"^```yaml\n# {re.escape(name)}\n(.*?)^```", PAGE, re.M | re.S)[1])
        return path

    def test_table_of_parameters_is_the_printed_one(self):
        self.assertIn(f"\n\n{vary.markdown()}\n", PAGE, "./grouser calibrate grains --parameters prints it")

    def test_example_of_a_vary_file(self):
        read = vary.read(self.example("my.vary.yaml"))
        self.assertEqual(read.names, ["friction", "rolling_friction", "solid_fraction"])
        self.assertEqual(read.fixed, {"tool_friction": 0.5})

    def test_soil_file(self):
        self.assertEqual(grain_soil.GrainSoil(self.example("my.soil.yaml")).name, "my-sand")
        self.assertEqual(keys("soil"), set(grain_soil.TOP_KEYS))
        self.assertEqual(keys("soil.grains"), set(grain_soil.GRAIN_KEYS))


if __name__ == "__main__":
    unittest.main()
