#!/usr/bin/python3
"""./grouser ladder docs: what it replaces in the page, in the results and in the picture."""

import datetime
import json
import os
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DOCS = os.path.join(ROOT, "surrogate", "accuracy_benchmark", "write_docs.py")
LADDER = """#!/usr/bin/python3
import json, sys
open(sys.argv[sys.argv.index("--markdown") + 1], "w").write(
    "### wheel: rms error against time (states)\\n| new |\\n\\n### wheel: targets\\n| other |\\n")
row = {"pair": "wheel", "kind": "hybrid", "ns_per_answer": 40.0, "output": "f_x", "p95_over_load": 0.1}
print(json.dumps([{**row, "reference": "dem", "region": "all"},
                  {**row, "reference": "measured", "region": "not locked", "p95_over_load": 0.3}]))
"""
PAGE = "# Page\n[tables](results/speed-vs-error-2001-01-01.md)\n<!-- written by ./grouser ladder docs -->\nold\n<!-- end -->\nrest\n"


class Docs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        os.makedirs(os.path.join(self.folder, "results"))
        self.write("speed-vs-error.md", PAGE)
        self.write("results/speed-vs-error-2001-01-01.md", "old tables")
        self.write("grouser-ladder", LADDER)
        os.chmod(os.path.join(self.folder, "grouser-ladder"), 0o755)

    def write(self, name, text):
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.write(text)

    def read(self, name):
        with open(os.path.join(self.folder, name), encoding="utf-8") as file:
            return file.read()

    def run_it(self):
        return subprocess.run([sys.executable, DOCS, "--docs", self.folder, "--pairs", self.folder, "--bin", self.folder],
                              capture_output=True, text=True, check=False)

    def test_replaces_page_results_and_picture(self):
        os.makedirs(os.path.join(self.folder, "wheel"))
        self.write("wheel/converge.json", json.dumps({"campaign": "c.yaml", "beds": 2, "rows": [
            {"state": {"slip": 0.1, "attack_angle_deg": 0, "load_n": 20}, "variant": "as_it_is", "beds": 2,
             "f_x": {"value": 1.5, "standard_error": 0.2}}]}))
        done = self.run_it()
        self.assertEqual(done.returncode, 0, done.stderr)
        name = f"speed-vs-error-{datetime.date.today().isoformat()}"
        page = self.read("speed-vs-error.md")
        self.assertIn("### wheel: rms error against time (states)\n| new |\n\n<!-- end -->\nrest", page)
        self.assertNotIn("old", page)
        self.assertNotIn("| other |", page)
        self.assertIn(f"results/{name}.md", page)
        self.assertEqual(os.listdir(os.path.join(self.folder, "results")), [name + ".md"])
        self.assertIn("## wheel: targets\n| other |", self.read(f"results/{name}.md"))
        self.assertIn("## wheel: time step, box and window of its runs (differences)\n`./grouser campaign converge c.yaml "
                      "--at=0.1,0,20 --beds 2 --out out/converge`\n\n| state |", self.read(f"results/{name}.md"))
        self.assertIn("| slip 0.1, 0 deg, 20 N | as it is | 2 | 1.5 +- 0.2 | - |", self.read(f"results/{name}.md"))
        picture = self.read("speed-vs-error.svg")
        self.assertIn("wheel: against the measured wheel, not locked", picture)

    def test_a_page_without_its_marks_is_left_alone(self):
        self.write("speed-vs-error.md", "# Page\n")
        done = self.run_it()
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("expected the lines", done.stderr)
        self.assertEqual(self.read("speed-vs-error.md"), "# Page\n")
        self.assertEqual(self.read("results/speed-vs-error-2001-01-01.md"), "old tables")


if __name__ == "__main__":
    unittest.main()
