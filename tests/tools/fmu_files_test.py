#!/usr/bin/python3
"""FMUs as make_fmu.py packs them: files, descriptions, libraries, sources, refusals.
Usage: fmu_files_test.py ROOT BUILD FOLDER pack | files | schema | source | bundle
pack: makes the FMUs of most tests and unpacks them below FOLDER; the others read these."""

import html
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
import zipfile

ROOT, BUILD, FOLDER = (pathlib.Path(a) for a in sys.argv[1:4])
MODEL = ROOT / "surrogate/shipped/cmu-smooth-62.5.model"
PLATFORM = {"fmi3": "x86_64-linux", "hard": "x86_64-linux", "fmi2": "linux64"}
# Names as in Chrono's FMU_ForceElementTire; .x .y .z of vectors, .e0 to .e3 of the quaternion.
VECTORS = {"wheel_state.pos": "input", "wheel_state.lin_vel": "input", "wheel_state.ang_vel": "input",
           "terrain_normal": "input", "wheel_load.point": "output", "wheel_load.force": "output",
           "wheel_load.moment": "output", "query_point": "output"}
CHRONO = {"step_size": "parameter", "terrain_height": "input", "terrain_mu": "input",
          **{f"wheel_state.rot.e{i}": "input" for i in range(4)},
          **{f"{name}.{axis}": kind for name, kind in VECTORS.items() for axis in "xyz"}}
# Every function that the standards ask an FMU for co-simulation to have.
ACCESS_3 = [f"{verb}{kind}" for verb in ("Get", "Set") for kind in (
    "Float32 Float64 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean String Binary Clock "
    "IntervalDecimal IntervalFraction ShiftDecimal ShiftFraction FMUState").split()]
FUNCTIONS = {f"fmi3{name}" for name in ACCESS_3 + """GetVersion SetDebugLogging InstantiateModelExchange
    InstantiateCoSimulation InstantiateScheduledExecution FreeInstance EnterInitializationMode
    ExitInitializationMode EnterEventMode Terminate Reset GetNumberOfVariableDependencies GetVariableDependencies
    FreeFMUState SerializedFMUStateSize SerializeFMUState DeserializeFMUState GetDirectionalDerivative
    GetAdjointDerivative EnterConfigurationMode ExitConfigurationMode EvaluateDiscreteStates UpdateDiscreteStates
    EnterStepMode GetOutputDerivatives DoStep""".split()} | {f"fmi2{name}" for name in """GetTypesPlatform GetVersion
    SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode ExitInitializationMode Terminate
    Reset GetReal GetInteger GetBoolean GetString SetReal SetInteger SetBoolean SetString GetFMUstate SetFMUstate
    FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative
    SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus GetIntegerStatus
    GetBooleanStatus GetStringStatus""".split()}
# FMI 2.0.1, section 2.2.7: what an initial value may be, by causality and variability.
ALLOWED = {("independent", "continuous"): None, ("parameter", "fixed"): "exact", ("input", "continuous"): "exact",
           ("calculatedParameter", "fixed"): "calculated", ("output", "continuous"): "calculated",
           ("output", "discrete"): "calculated"}


def expect(condition, what):
    if not condition:
        sys.exit(f"failed: {what}")


def run(*command, **more):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **more)


def make(*arguments):
    return run(sys.executable, ROOT / "clients/fmi/make_fmu.py", "--bin", BUILD / "bin", *arguments)


def pack():
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    hard = FOLDER / "hard.model"
    scene = ROOT / "dem_offline/campaigns/cmu_smooth_8mm.scene.yaml"
    made = run(BUILD / "bin/grouser-fit", "make", "--wheel", scene, "--ground", "asphalt", "--load-min", "5",
               "--load-max", "100", "--out", hard)
    expect(made.returncode == 0, made.stderr)
    unpack("fmi3", MODEL, "--source")
    unpack("fmi2", MODEL, "--fmi", "2", "--source")
    unpack("hard", hard, "--tyre-stiffness", "20000")


def unpack(name, *arguments):
    """Makes FOLDER/NAME.fmu and unpacks it to FOLDER/NAME."""
    file = FOLDER / f"{name}.fmu"
    done = make(*arguments, "--out", file)
    expect(done.returncode == 0 and done.stdout.strip() == str(file), done.stderr or done.stdout)
    with zipfile.ZipFile(file) as archive:
        archive.extractall(FOLDER / name)


def variables_2(root):
    """Variables of an FMI 2.0 description, after a check of what its schema and section 2.2 say of them."""
    order = ["CoSimulation", "UnitDefinitions", "LogCategories", "DefaultExperiment", "ModelVariables",
             "ModelStructure"]
    expect([child.tag for child in root] == order, f"order of elements: {[child.tag for child in root]}")
    expect(root.get("fmiVersion") == "2.0" and root.get("guid") and root.get("modelName"), "attributes of the root")
    units = {unit.get("name") for unit in root.iter("Unit")}
    found = {}
    for index, variable in enumerate(root.find("ModelVariables"), 1):
        name, typed = variable.get("name"), list(variable)
        expect(variable.tag == "ScalarVariable" and len(typed) == 1 and typed[0].tag in ("Real", "Integer", "Boolean"),
               f"{name}: one type")
        kind = (variable.get("causality"), variable.get("variability"))
        expect(kind in ALLOWED, f"{name}: {kind}")
        initial = ALLOWED[kind]  # "exact" is understood
        expect(variable.get("initial") == (initial if initial == "calculated" else None), f"{name}: initial")
        expect((typed[0].get("start") is not None) == (initial == "exact"), f"{name}: start")
        expect(typed[0].get("unit") is None or typed[0].get("unit") in units, f"{name}: unit")
        expect(name not in found, f"{name}: twice")
        found[name] = (kind[0], variable.get("valueReference"), index)
    references = [reference for _, reference, _ in found.values()]
    expect(len(set(references)) == len(references), "value references: one each")
    unknowns = {tag: [int(u.get("index")) for u in root.find(f"ModelStructure/{tag}")]
                for tag in ("Outputs", "InitialUnknowns")}
    outputs = [index for kind, _, index in found.values() if kind == "output"]
    more = [index for kind, _, index in found.values() if kind == "calculatedParameter"]
    expect(unknowns["Outputs"] == outputs and unknowns["InitialUnknowns"] == sorted(outputs + more), "structure")
    return {name: kind for name, (kind, _, _) in found.items()}


def check_description(name):
    root = ET.parse(FOLDER / name / "modelDescription.xml").getroot()
    if name == "fmi2":
        kinds = variables_2(root)
    else:
        kinds = {v.get("name"): v.get("causality") for v in root.find("ModelVariables")}
    wrong = {n: kinds.get(n) for n, kind in CHRONO.items() if kinds.get(n) != kind}
    expect(not wrong, f"{name}: variables of Chrono's FMU: {wrong}")


def check_libraries(name):
    """Of an FMU; answers what ldd says of its library."""
    folder = FOLDER / name / "binaries" / PLATFORM.get(name, "x86_64-linux")
    module = folder / "grouser_wheel.so"
    symbols = run("nm", "-D", "--defined-only", module).stdout
    shown = {line.split()[-1] for line in symbols.splitlines()}
    expect(shown == FUNCTIONS, f"{name}: exported more or less than the standards ask: {sorted(shown ^ FUNCTIONS)}")
    expect(str(ROOT).encode() not in module.read_bytes(), f"{name}: a path of this machine")
    loaded = run("ldd", module).stdout
    expect("not found" not in loaded and str(BUILD) not in loaded.replace(str(FOLDER), ""), loaded)
    expect(f"libgrouser_model.so.0.1 => {folder}" in loaded, loaded)
    foreign = re.findall(r"\S*(?:grpc|lcm|hdf5|sqlite|ceres|boost|gtest)\S*", loaded.replace(str(FOLDER), ""))
    expect(not foreign, f"{name}: loads {foreign}")
    return loaded


def check_refusals():
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "wheel.fmu")
        out.write_text("kept")
        for what, arguments in {
            "no such file, expected a model file": ("gone.model",),
            "expected --tyre-stiffness above 0 N/m": (FOLDER / "hard.model",),
            "expected a number of 0 or more": (MODEL, "--damping-ratio", "nan"),
            str(ROOT / "LICENSE"): (ROOT / "LICENSE",),
            "invalid choice": (MODEL, "--fmi", "1"),
        }.items():
            done = make(*arguments, "--out", out)
            expect(done.returncode == 2 and what in done.stderr, f"{arguments}: {done.returncode} {done.stderr}")
        expect(out.read_text() == "kept" and len(list(out.parent.iterdir())) == 1, "a refusal leaves what was there")
        for code, what, place in ((2, "is a folder, expected a file to write", folder),
                                  (1, f"grouser: {out}: ", out / "in_a_file.fmu")):
            done = make(MODEL, "--out", place)
            expect(done.returncode == code and what in done.stderr and "Traceback" not in done.stderr,
                   f"--out {place}: {done.returncode} {done.stderr}")


def check_that_the_needed_library_is_taken():
    with tempfile.TemporaryDirectory() as folder:
        module, out = pathlib.Path(folder, "grouser_wheel.so"), pathlib.Path(folder, "wheel.fmu")
        shutil.copy(BUILD / "fmi/grouser_wheel.so", module)
        for version in ("0.0", "0.01", "0.2", "1.0", "9"):
            pathlib.Path(folder, f"libgrouser_model.so.{version}").write_text("of another version")
        done = make(MODEL, "--module", module, "--out", out)
        expect(done.returncode == 2 and "libgrouser_model.so.0.1: no such file" in done.stderr, done.stderr)
        shutil.copy(BUILD / "fmi/libgrouser_model.so.0.1", folder)
        done = make(MODEL, "--module", module, "--out", out)
        expect(done.returncode == 0, done.stderr)
        names = zipfile.ZipFile(out).namelist()
        expect([n.split("/")[-1] for n in names if "libgrouser_model" in n] == ["libgrouser_model.so.0.1"], str(names))


def files():
    for name, platform in PLATFORM.items():
        entries = zipfile.ZipFile(FOLDER / f"{name}.fmu").infolist()
        expect(all(e.compress_type == zipfile.ZIP_DEFLATED for e in entries), f"{name}: deflate alone")
        listed = {e.filename for e in entries}
        needed = {"modelDescription.xml", f"binaries/{platform}/grouser_wheel.so", "resources/wheel.model",
                  f"binaries/{platform}/libgrouser_model.so.0.1", "documentation/index.html",
                  "documentation/licenses/license.txt"}
        expect(needed <= listed, f"{name}: {needed - listed} is missing")
        expect((FOLDER / name / "resources/wheel.model").read_bytes() ==
               (FOLDER / "hard.model" if name == "hard" else MODEL).read_bytes(), f"{name}: another model")
        check_description(name)
        check_libraries(name)
    expect("sources/buildDescription.xml" in zipfile.ZipFile(FOLDER / "fmi3.fmu").namelist(), "fmi3: sources")
    check_refusals()
    check_that_the_needed_library_is_taken()


def schema():
    if shutil.which("xmllint") is None:
        print("skipped: no xmllint (Debian: libxml2-utils), so no check against the schemas of FMI 3.0")
        sys.exit(77)

    def validate(kind, file):
        return run("xmllint", "--noout", "--nonet", "--schema", ROOT / f"clients/fmi/schemas/fmi3{kind}.xsd", file)

    for name in ("fmi3", "hard"):
        done = validate("ModelDescription", FOLDER / name / "modelDescription.xml")
        expect(done.returncode == 0, done.stderr)
    done = validate("BuildDescription", FOLDER / "fmi3/sources/buildDescription.xml")
    expect(done.returncode == 0, done.stderr)
    with tempfile.NamedTemporaryFile(suffix=".xml") as wrong:
        text = (FOLDER / "fmi3/modelDescription.xml").read_text()
        wrong.write(text.replace("instantiationToken", "token").encode())
        wrong.flush()
        expect(validate("ModelDescription", wrong.name).returncode != 0, "a wrong description was not refused")


def source():
    """The sources alone, compiled as buildDescription.xml says, do what the binary does."""
    by_binary = run(BUILD / "bin/fmu_example", FOLDER / "fmi3", "1")
    expect(by_binary.returncode == 0 and "1.0 s" in by_binary.stdout, by_binary.stderr)
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder, "fmu")
        shutil.copytree(FOLDER / "fmi3", copy)
        module = copy / "binaries" / PLATFORM["fmi3"] / "grouser_wheel.so"
        module.unlink()
        build = ET.parse(copy / "sources/buildDescription.xml").getroot().find("BuildConfiguration")
        options = build.find("SourceFileSet").get("compilerOptions").split()
        sources = [f.get("name") for f in build.iter("SourceFile")]
        done = run("g++", *options, "-I.", *sources, "-shared", "-o", module, f"-L{module.parent}",
                   f"-l:{build.find('Library').get('name')}", "-Wl,-rpath,$ORIGIN", cwd=copy / "sources")
        expect(done.returncode == 0, done.stderr)
        by_source = run(BUILD / "bin/fmu_example", copy, "1")
        expect(by_source.stdout == by_binary.stdout, f"{by_source.stdout}{by_source.stderr}\n{by_binary.stdout}")
    # FMI 2.0 has no such file: the line of the documentation.
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder, "fmu")
        shutil.copytree(FOLDER / "fmi2", copy)
        (copy / "binaries/linux64/grouser_wheel.so").unlink()
        page = (copy / "documentation/index.html").read_text()
        line = html.unescape(re.search("<pre>(.*)</pre>", page, re.S)[1])
        done = run("sh", "-c", line, cwd=copy / "sources")
        expect(done.returncode == 0, f"{line}: {done.stderr}")
        by_source = run(BUILD / "bin/fmu_example", copy, "1")
        expect(by_source.returncode == 0 and "1.0 s" in by_source.stdout, by_source.stderr)


def bundle():
    """With all its libraries inside, it takes but libc's and C++'s from elsewhere."""
    unpack("bundle", MODEL, "--bundle")
    check_description("bundle")
    folder = str(FOLDER / "bundle/binaries")
    elsewhere = [f for f in re.findall(r"=> (/\S+)", check_libraries("bundle")) if not f.startswith(folder) and
                 not re.search(r"/lib(c|m|stdc\+\+|gcc_s|dl|pthread|rt)\.so", f)]
    expect(not elsewhere, f"loads {elsewhere}")
    expect((FOLDER / "bundle/documentation/licenses/libprotobuf32.txt").is_file(), "licences of what is bundled")
    runs = [run(BUILD / "bin/fmu_example", FOLDER / name, "1") for name in ("fmi3", "bundle")]
    expect(runs[0].returncode == 0 and runs[0].stdout == runs[1].stdout, f"{runs[1].stdout}{runs[1].stderr}")


if __name__ == "__main__":
    {"pack": pack, "files": files, "schema": schema, "source": source, "bundle": bundle}[sys.argv[4]]()
    print(sys.argv[4], "passed")
