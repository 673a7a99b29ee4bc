#!/usr/bin/python3
"""Packs a model of one wheel on one soil into an FMU for co-simulation (FMI 3.0 or 2.0, Linux on x86-64): how it
behaves stands in docs/fmi.md.

Example: ./grouser fmu surrogate/shipped/cmu-smooth-62.5.model --out wheel.fmu"""

import argparse
import html
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

import description

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT / "clients/common"))
import picture_options  # noqa: E402
# Of every Linux with a C++ program; the rest of what the library loads goes in with --bundle.
EVERYWHERE = re.compile(r"ld-linux|linux-vdso|lib(c|m|dl|pthread|rt|stdc\+\+|gcc_s)\.so")
PARAMETERS = {"tyre_stiffness": "of the tyre, in series with the soil [N/m]; 0: rigid. Hard ground needs one",
              "damping_ratio": "of the normal motion; 0: none",
              "relaxation_over_radius": "travel over radius within which slip follows the motion; 0: at once",
              "shear_damping_ratio": "of the motion along the ground of a wheel that is held"}


def refuse(text):
    print(f"fmu: {text}", file=sys.stderr)
    sys.exit(2)


def value_of(text):
    number = float(text)
    if not (math.isfinite(number) and number >= 0):
        raise argparse.ArgumentTypeError(f"got {text}, expected a number of 0 or more")
    return number


def read_model(asked):
    """What `grouser-fit show` says of the model, which it checks."""
    shown = subprocess.run([str(asked.bin / "grouser-fit"), "show", str(asked.model), "--json"], capture_output=True,
                           text=True, check=False)
    if shown.returncode != 0:
        refuse(shown.stderr.strip() or f"{asked.model}: not a model")
    read = json.loads(shown.stdout)
    if read["model"]["kind"] == "MODEL_KIND_HARD" and asked.tyre_stiffness == 0:
        refuse(f"{asked.model}: hard ground, on which a wheel does not sink; expected --tyre-stiffness above 0 N/m")
    return read


def libraries(module, bundle):
    """Names and files that lie beside the module: Grouser's library, and all that it loads with `bundle`."""
    def loaded(by):
        done = subprocess.run(["ldd", str(by)], capture_output=True, text=True, check=False)
        return re.findall(r"^\s*(\S+) => (\S+)", done.stdout, re.M)

    needed = next((name for name, _ in loaded(module) if name.startswith("libgrouser_model.so.")), None)
    if needed is None:
        refuse(f"{module}: expected a library that loads libgrouser_model.so.*; ./grouser build makes it")
    library = module.parent / needed
    if not library.is_file():
        refuse(f"{library}: no such file, which {module.name} needs; ./grouser build makes it")
    found = {library.name: library.resolve()}
    if bundle:
        for name, file in loaded(library):
            if file.startswith("/") and not EVERYWHERE.search(name):
                found[name] = pathlib.Path(file)
    return library.name, found


def licences(files):
    """Debian's copyright files of bundled libraries, by package."""
    found = {}
    for file in files:
        below = str(file).removeprefix("/usr")  # /lib is a link to /usr/lib; dpkg knows one of the names
        for at in (below, f"/usr{below}"):
            owner = subprocess.run(["dpkg-query", "-S", at], capture_output=True, text=True, check=False).stdout
            package = owner.split(":")[0]
            text = pathlib.Path("/usr/share/doc", package, "copyright")
            if package and text.is_file():
                found[package] = text
    return found


def compiling(library, platform):
    """How sources are compiled, for the page of the FMU. FMI 3.0 has a file for that as well."""
    line = f"g++ {description.COMPILER_OPTIONS} -shared -I. {' '.join(description.SOURCES)} \\\n" \
           f"  -o ../binaries/{platform}/{description.IDENTIFIER}.so -L../binaries/{platform} -l:{library} '-Wl,-rpath,$ORIGIN'"
    return f"<p>The sources are compiled in the folder <code>sources</code> by</p>\n<pre>{html.escape(line)}</pre>\n"


def contents(asked, read):
    """Files of the FMU, by their names in it: paths or texts."""
    model, rows = read["model"], description.variables()
    start = {name: getattr(asked, name) for name in PARAMETERS}
    version = re.search(r"project\(grouser VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    wheel, soil = model["wheel"], model["soil"]
    about = {"modelName": model["name"], "token": f"grouser-{read['digest']}", "generationTool": f"Grouser {version}",
             "description": f"wheel {wheel['name']} on {soil['name']}: forces of the soil on the wheel"}
    library, beside = libraries(asked.module, asked.bundle)
    platform = "x86_64-linux" if asked.fmi == 3 else "linux64"
    page = "".join(f"<tr><td>{html.escape(r['name'])}</td><td>{r['causality']}</td><td>{r['unit']}</td>"
                   f"<td>{html.escape(r['description'])}</td></tr>\n" for r in rows)
    files = {
        "modelDescription.xml": description.model_description_3(rows, about, start) if asked.fmi == 3 else
        description.model_description_2(rows, about, start, asked.source),
        f"binaries/{platform}/{description.IDENTIFIER}.so": asked.module,
        **{f"binaries/{platform}/{name}": file for name, file in beside.items()},
        "resources/wheel.model": asked.model,
        "resources/parameters.csv": "".join(f"{name},{value!r}\n" for name, value in start.items()),
        "documentation/index.html": f"<!DOCTYPE html>\n<html><head><meta charset=\"utf-8\"><title>"
        f"{html.escape(about['modelName'])}</title></head><body>\n<h1>{html.escape(about['description'])}</h1>\n"
        f"<p>{about['generationTool']}; model {html.escape(about['modelName'])}, SHA-256 {read['digest']}. "
        f"Radius {wheel['radius_m']} m, width {wheel['width_m']} m; fitted for loads of "
        f"{model['domain']['load_min_n']:.4g} to {model['domain']['load_max_n']:.4g} N.</p>\n"
        f"{compiling(library, platform) if asked.source else ''}"
        f"<table>\n<tr><th>variable</th><th></th><th>unit</th><th></th></tr>\n{page}</table>\n</body></html>\n",
        "documentation/licenses/license.txt": ROOT / "LICENSE",
        "documentation/licenses/NOTICE.txt": ROOT / "NOTICE",
    }
    for package, text in licences(f for n, f in beside.items() if n != library).items():
        files[f"documentation/licenses/{package}.txt"] = text
    if asked.source:
        for name in description.SOURCES + description.HEADERS:
            files[f"sources/{name}"] = description.header(rows) if name == "variables.h" else HERE / name
        for name in ("model.h", "contact.h"):
            files[f"sources/grouser/{name}"] = ROOT / "clients/in_process/grouser" / name
        if asked.fmi == 3:
            files["sources/buildDescription.xml"] = description.build_description(library)
    return files


def main():
    parser = argparse.ArgumentParser(prog="grouser fmu", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=pathlib.Path, help="model file")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("wheel.fmu"),
                        help="file to write (%(default)s)")
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=3, help="version of the standard (%(default)s)")
    parser.add_argument("--source", action="store_true", help="the sources of the adapter too")
    parser.add_argument("--bundle", action="store_true",
                        help="all libraries but libc and libstdc++ too, for machines without Debian 12's")
    defaults = {r["name"]: float(r["start"]) for r in description.variables() if r["name"] in PARAMETERS}
    for name, what in PARAMETERS.items():
        parser.add_argument("--" + name.replace("_", "-"), type=value_of, default=defaults[name], metavar="X",
                            help=f"start value of the parameter {name}: {what} (%(default)s)")
    parser.add_argument("--bin", type=pathlib.Path, default=ROOT / "build/release/bin", help=argparse.SUPPRESS)
    parser.add_argument("--module", type=pathlib.Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    asked.module = asked.module or asked.bin.parent / f"fmi/{description.IDENTIFIER}.so"
    if not asked.model.is_file():
        refuse(f"{asked.model}: no such file, expected a model file")
    if not asked.module.is_file():
        refuse(f"{asked.module}: no such file; ./grouser build makes it")
    if asked.out.is_dir():
        refuse(f"--out: {asked.out} is a folder, expected a file to write")
    files = contents(asked, read_model(asked))
    asked.out.absolute().parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=asked.out.absolute().parent, delete=False) as aside:
        try:
            with zipfile.ZipFile(aside, "w", zipfile.ZIP_DEFLATED) as archive:
                for name, content in files.items():
                    data = content.read_bytes() if isinstance(content, pathlib.Path) else content.encode()
                    archive.writestr(zipfile.ZipInfo(name, (2000, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
            aside.flush()
            os.fsync(aside.fileno())
            os.chmod(aside.name, 0o644)
            os.replace(aside.name, asked.out)
        except BaseException:
            os.unlink(aside.name)
            raise
    print(asked.out)


if __name__ == "__main__":
    picture_options.end_with(main)
