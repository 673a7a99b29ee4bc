#!/usr/bin/python3
"""The Python package as it is installed, and its type stubs beside what is there."""

import ast
import dataclasses
import inspect
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import grouser
from grouser import _core

SOURCE = os.environ["GROUSER_SOURCE"]
TYPES_FILE = pathlib.Path(SOURCE, "clients/python/grouser/_core.pyi")
USE = """
import grouser, pathlib
model = grouser.Model.open(grouser.MODEL_DIR / "cmu-smooth-62.5.model")
pull = model.evaluate(grouser.States.of(0.08, 0, 0.1, 24)).f_x.value[0]
names = [grouser.Vehicle.open(f).name for f in sorted(grouser.VEHICLE_DIR.glob("*.vehicle.yaml"))]
print(pathlib.Path(grouser.__file__).parent, pull, *names)
"""


def parameters(node):
    """Names of a function's parameters in a stub, without self."""
    a = node.args
    return [x.arg for x in a.posonlyargs + a.args + a.kwonlyargs if x.arg != "self"]


class PackageTest(unittest.TestCase):
    def test_stub_says_what_is_there(self):
        body = ast.parse(TYPES_FILE.read_text()).body
        classes = {c.name: c for c in body if isinstance(c, ast.ClassDef)}
        named = set(classes) | {a.target.id for a in body if isinstance(a, ast.AnnAssign)}
        self.assertEqual({n for n in vars(_core) if not n.startswith("_")}, named)
        for name, node in classes.items():
            members = {f.name if isinstance(f, ast.FunctionDef) else f.target.id: f
                       for f in node.body if not isinstance(f, ast.Expr)}
            there = {m for m in vars(getattr(_core, name)) if not m.startswith("_")}
            self.assertEqual(there, {m for m in members if not m.startswith("_")}, name)
            for member, f in members.items():
                if isinstance(f, ast.AnnAssign) or any(getattr(d, "id", "") == "property" for d in f.decorator_list):
                    continue
                text = inspect.getdoc(getattr(getattr(_core, name), member)).splitlines()[0]
                got = re.findall(r"(?:^|[(,] ?)(\w+): ", text)
                self.assertEqual([g for g in got if g != "self"], parameters(f), f"{name}.{member}: {text}")

    def test_every_public_thing_has_a_docstring(self):
        for name in grouser.__all__:
            thing = getattr(grouser, name)
            if not inspect.isclass(thing):
                continue
            self.assertTrue(thing.__doc__, name)
            for member, value in vars(thing).items():
                if inspect.isfunction(value) or type(value).__name__ == "instancemethod":
                    self.assertTrue(inspect.getdoc(value) or member.startswith("_"), f"{name}.{member}")

    def test_names_are_the_library_s(self):
        self.assertEqual(tuple(f.name for f in dataclasses.fields(grouser.OutputArrays)), _core.OUTPUT_ARRAYS)
        named = [f.name for f in dataclasses.fields(grouser.Answers) if f.type is grouser.OutputArrays]
        self.assertEqual(tuple(named), grouser.OUTPUTS)
        for enum, numbers in ((grouser.Flag, _core.FLAGS), (grouser.Reason, _core.REASONS),
                              (grouser.Binding, _core.BINDINGS)):
            self.assertEqual({m.name: m.value for m in enum}, numbers)

    def test_code_of_the_page(self):
        page = pathlib.Path(SOURCE, "docs/python.md").read_text()
        blocks = [b for b in re.findall(r"```python\n(.*?)```", page, re.S) if "grouser.client" not in b]
        self.assertGreaterEqual(len(blocks), 4)
        text = subprocess.run([sys.executable, "-c", "".join(blocks)], check=True, text=True, cwd=SOURCE,
                              stdout=subprocess.PIPE).stdout
        self.assertIn("Flag.FORM_UNKNOWN", text)
        self.assertRegex(text, r"\] [A-Z_]+ 0\n")
        self.assertRegex(text, r"\nn 1\.\d+ \S+ \S+ True\n$")

    def test_help_of_the_examples(self):
        for example in sorted(pathlib.Path(SOURCE, "clients/python/examples").glob("*.py")):
            with tempfile.TemporaryDirectory() as folder:
                done = subprocess.run([sys.executable, example, "--help"], check=False, text=True, cwd=folder,
                                      stdout=subprocess.PIPE)
                self.assertEqual((done.returncode, os.listdir(folder)), (0, []), example)
                self.assertIn(f"usage: {example.name} [-h] OUT.png", done.stdout)

    def test_installed_it_needs_nothing_of_the_build(self):
        with tempfile.TemporaryDirectory() as prefix:
            subprocess.run([os.environ["GROUSER_CMAKE"], "--install", os.environ["GROUSER_BUILD"], "--component",
                            "python", "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
            folder = next(pathlib.Path(prefix).glob("lib/python3*/dist-packages"))
            environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
            result = subprocess.run([sys.executable, "-c", USE], env=environment, cwd=prefix, check=True, text=True,
                                    stdout=subprocess.PIPE).stdout.split()
            self.assertEqual(result[0], str((folder / "grouser").resolve()))
            self.assertEqual(result[2:], ["atv", "cart", "husky", "rover", "rover_lugged", "warthog"])
            loaded = subprocess.run(["ldd", *folder.glob("grouser/_core*.so")], env=environment, check=True, text=True,
                                    stdout=subprocess.PIPE).stdout
            self.assertIn(str(folder / "grouser/libgrouser_model.so"), loaded)
            self.assertNotIn("not found", loaded)


if __name__ == "__main__":
    unittest.main()
