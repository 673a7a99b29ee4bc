#!/usr/bin/python3
"""Checks the one-way street: who may include whom, and the house rules that a
compiler does not check. Usage: check_includes.py ROOT | --self-test"""

import pathlib
import re
import sys
import tempfile

MAX_LINES = 600
CODE_SUFFIXES = {".h", ".cc", ".cu", ".cuh"}
TEXT_SUFFIXES = CODE_SUFFIXES | {".proto", ".lcm", ".py", ".sh", ".cmake"}
SKIPPED_FOLDERS = {".git", ".cache", "build", "out", "__pycache__"}

# Headers of the C++20 library and of the C library behind it.
STANDARD = set("""
algorithm any array atomic barrier bit bitset cassert cctype cerrno cfenv cfloat charconv chrono
cinttypes climits clocale cmath codecvt compare complex concepts condition_variable coroutine
csetjmp csignal cstdarg cstddef cstdint cstdio cstdlib cstring ctime cuchar cwchar cwctype deque
exception execution filesystem forward_list fstream functional future initializer_list iomanip ios
iosfwd iostream istream iterator latch limits list locale map memory memory_resource mutex new
numbers numeric optional ostream queue random ranges ratio regex scoped_allocator semaphore set
shared_mutex source_location span sstream stack stdexcept stop_token streambuf string string_view
strstream syncstream system_error thread tuple type_traits typeindex typeinfo unordered_map
unordered_set utility valarray variant vector version
""".split())
# The machine: threads, vector units, clocks, the GPU.
MACHINE = re.compile(
    r"(immintrin|x86intrin|pthread|sched|unistd|time|signal|fenv|stdint|stddef|math)\.h"
    r"|(sys|linux)/\w+\.h|cuda\w*\.h|cooperative_groups\.h|cub/.*|thrust/.*|cuda/.*")

HEAVY = r"hdf5|H5|sqlite3|SQLiteCpp/|ceres/|openturns|yaml-cpp/"
# folder: (own headers it may include, third-party headers it may not include;
# None: only the standard library and the machine). The longest folder counts.
RULES = {
    "proto": (r"proto/|grouser/v1alpha1/\w+\.pb\.h", r"grpc|lcm/|boost/|ceres/|yaml-cpp/"),
    "proto/records/yaml": (r"proto/records/|grouser/v1alpha1/\w+\.pb\.h", r"grpc|lcm/|boost/|ceres/|google/"),
    "proto/lcm": (r"proto/lcm/", r"grpc|lcm/|boost/|google/|" + HEAVY),
    "dem_offline": (r"dem_offline/|proto/records/|grouser/v1alpha1/(?!\w*service)",
                    r"grpc|lcm/|ceres/|openturns"),
    "dem_offline/engine": (r"dem_offline/engine/", None),
    "dem_offline/multibody": (r"dem_offline/(engine|multibody)/", HEAVY + "|grpc|lcm/|boost/|google/"),
    "surrogate": (r"surrogate/|proto/records/|grouser/v1alpha1/(?!\w*service)",
                  r"grpc|lcm/|sqlite3|SQLiteCpp/"),
    "surrogate/models": (r"surrogate/models/", None),
    "surrogate/model_io": (r"surrogate/(models|model_io)/|proto/records/model_file\.h"
                           r"|grouser/v1alpha1/(?!\w*service)", HEAVY + "|grpc|lcm/"),
    "surrogate/vehicle": (r"surrogate/(models|model_io|vehicle)/|proto/records/yaml/"
                          r"|grouser/v1alpha1/(?!\w*service)",
                          HEAVY + "|grpc|lcm/"),
    "surrogate/terrain_map": (r"surrogate/(models|model_io|vehicle|terrain_map)/|proto/records/(sha256|command_line)\.h",
                              HEAVY + "|grpc|lcm/|boost/"),
    "server/core": (r"server/core/|surrogate/(models|model_io)/"
                    r"|proto/records/((model|durable)_file\.h|model_bytes\.h|sha256\.h|status_code\.h|os/)|grouser/v1alpha1/(?!\w*service)",
                    HEAVY + "|grpc|lcm/|boost/"),
    "server/net": (r"server/(core|net)/|proto/records/(model_file\.h|sha256\.h|message_json\.h|status_code\.h|os/|yaml/)"
                   r"|google/rpc/|surrogate/models/isa\.h|grouser/v1alpha1/operator_service", HEAVY + "|lcm/"),
    "server/vehicle": (r"server/(core|net|vehicle)/|surrogate/(models|vehicle)/|grouser/v1alpha1/", HEAVY + "|lcm/"),
    "server/query": (r"server/(core|net|query|vehicle)/|surrogate/(models|model_io|vehicle)/"
                     r"|proto/records/((model_file|command_line)\.h|os/)|proto/lcm/|grouser/v1alpha1/|grouser_lcm/", HEAVY),
    "server/jobs": (r"server/(core|net|jobs)/|surrogate/(models|model_io|vehicle)/|proto/records/"
                    r"|grouser/v1alpha1/", r"lcm/|ceres/|openturns|yaml-cpp/"),
    "clients": (r"clients/|surrogate/(models|vehicle)/|surrogate/model_io/explanation_text\.h|proto/lcm/|proto/records/(command_line|message_json|status_code)\.h"
                r"|grouser/v1alpha1/|google/rpc/|grouser_lcm/", HEAVY),
    "clients/replay": (r"clients/(cpp|replay)/|server/(core|query)/|surrogate/(models|model_io)/|proto/records/(command_line\.h|os/)"
                       r"|grouser/v1alpha1/", HEAVY),
    "clients/in_process": (r"clients/in_process/|surrogate/(models|model_io|terrain_map|vehicle)/"
                           r"|proto/records/model_file\.h|grouser/v1alpha1/(?!\w*service)",
                           HEAVY + "|grpc|lcm/"),
    # What is installed, and what a stranger writes.
    "clients/in_process/grouser": (r"grouser/(model|vehicle)\.h", None),
    "clients/in_process/example": (r"grouser/(map|model|vehicle)\.h|\w+\.h", None),
    "clients/fmi": (r"grouser/(contact|model)\.h|(fmi3_instance|fmi_types|variables|wheel_fmu)\.h", None),
    "clients/fmi/loader": (r"clients/fmi/(fmi_types|loader/\w+)\.h", HEAVY + "|grpc|lcm/|google/"),
    "clients/fmi/examples": (r"clients/fmi/loader/fmu\.h", None),
    # Adapters to others' simulators: the public headers and the simulator's own.
    "clients/mujoco": (r"grouser/(contact|model|mujoco|vehicle)\.h", HEAVY + "|grpc|lcm/|boost/|google/"),
    "clients/hosts": (r"grouser/(contact|model|timed_wheel|vti)\.h", HEAVY + "|grpc|lcm/|boost/|google/"),
    "clients/python": (r"clients/python/|grouser/(model|model_selector|vehicle)\.h", HEAVY + "|grpc|lcm/|boost/|google/"),
}
# The engine's folders from below: each includes its own and those before it.
ENGINE = "dem_offline/engine/"
ENGINE_LAYERS = ["core", "laws", "bodies", "contact", "isa", "world", "rig", "experiment", "gpu", "bench", "verify",
                 "gpu/check", "tools"]
# Only the owner of the run files' format names HDF5.
HDF5_FILES = re.compile(r"proto/records/(run_file|tile_file|hdf5_file)\.(h|cc)")

# Simbody's headers are C++17 and take seconds: no public header has them.
SIMBODY = re.compile(r"Simbody|SimTK|simbody/|simmath/")
SIMBODY_FILE = "dem_offline/multibody/simbody_model.h"

# GDAL comes in by few doors: the rest builds without it.
GDAL = re.compile(r"(gdal|ogr|cpl)_\w+\.h|gdal\.h")
GDAL_FILES = re.compile(r"surrogate/terrain_map/(raster_input|map_output)\.cc|clients/examples/map_route\.cc")

# Only this opens databases for everybody; their owners then speak SQL.
SQLITE_FILES = re.compile(r"proto/records/os/database\.(h|cc)")

INCLUDE = re.compile(r'^\s*#\s*include\s+(["<])([^">]+)[">]', re.M)
IMPORT = re.compile(r'^\s*import\s+(?:public\s+)?"([^"]+)"', re.M)
UNFINISHED = re.compile(r"\b(TO" r"DO|FIX" r"ME)\b")


def rule_for(path):
    """The rule of the longest folder that holds `path`; None for tests."""
    folders = [f for f in RULES if path.startswith(f + "/")]
    return RULES[max(folders, key=len)] if folders else None


def layer_of(path):
    """Number of the engine's layer that holds `path`; None outside of the engine's folders."""
    held = [l for l in ENGINE_LAYERS if path.startswith(ENGINE + l + "/")]
    return ENGINE_LAYERS.index(max(held, key=len)) if held else None


def check_include(path, bracket, header):
    """What is wrong with one include of `path`, or None."""
    own, forbidden = rule_for(path)
    layer = layer_of(path)
    if bracket == '"' and layer is not None:
        below = layer_of(header)
        return None if below is not None and below <= layer else f'may not include "{header}"'
    if bracket == '"':
        return None if re.match(own, header) else f'may not include "{header}"'
    if header in STANDARD or MACHINE.fullmatch(header):
        return None
    if forbidden is None:
        return f"may include the standard library alone, not <{header}>"
    if SIMBODY.match(header):
        return None if path == SIMBODY_FILE else f"may not include <{header}>"
    if GDAL.fullmatch(header):
        return None if GDAL_FILES.fullmatch(path) else f"may not include <{header}>"
    if re.match(r"hdf5|H5", header) and path.startswith("proto/"):
        return None if HDF5_FILES.fullmatch(path) else f"may not include <{header}>"
    if re.match(r"sqlite3|SQLiteCpp/", header) and path.startswith("proto/"):
        return None if SQLITE_FILES.fullmatch(path) else f"may not include <{header}>"
    return f"may not include <{header}>" if re.match(forbidden, header) else None


def check_file(path, text):
    """Problems of one file as a list of texts."""
    problems = []
    suffix = pathlib.PurePosixPath(path).suffix
    lines = text.count("\n")
    if lines > MAX_LINES:
        problems.append(f"{lines} lines, at most {MAX_LINES}")
    if UNFINISHED.search(text):
        problems.append("unfinished: " + UNFINISHED.search(text).group(0))
    if suffix in {".h", ".cuh"} and "#pragma once" not in text:
        problems.append("no #pragma once")
    if suffix in CODE_SUFFIXES and rule_for(path):
        for bracket, header in INCLUDE.findall(text):
            problems.append(check_include(path, bracket, header))
    if suffix == ".proto":
        for name in IMPORT.findall(text):
            if not re.match(r"grouser/v1alpha1/|google/(protobuf|rpc)/", name):
                problems.append(f'may not import "{name}"')
    return [f"{path}: {p}" for p in problems if p]


def check_tree(root):
    """Number of files looked at and all problems."""
    root = pathlib.Path(root)
    count, problems = 0, []
    for file in sorted(root.rglob("*")):
        parts = file.relative_to(root).parts
        if SKIPPED_FOLDERS & set(parts) or file.suffix not in TEXT_SUFFIXES or not file.is_file():
            continue
        count += 1
        problems += check_file("/".join(parts), file.read_text(encoding="utf-8"))
    return count, problems


GOOD = {
    "dem_offline/engine/a.h": "#pragma once\n#include <vector>\n#include \"dem_offline/engine/b.h\"\n",
    "dem_offline/engine/core/a.cc": "#include \"dem_offline/engine/core/a.h\"\n",
    "dem_offline/engine/gpu/check/a.cc": "#include \"dem_offline/engine/bench/a.h\"\n",
    "dem_offline/multibody/simbody_model.h": "#pragma once\n#include <simbody/internal/Motion.h>\n",
    "dem_offline/engine/world/a.cc": "#include \"dem_offline/engine/contact/a.h\"\n",
    "surrogate/terrain_map/map_output.cc": "#include <gdal_priv.h>\n",
    "server/query/a.cc": "#include <grpcpp/server.h>\n#include \"server/core/evaluator.h\"\n",
    "tests/unit/a.cc": "#include \"dem_offline/x.h\"\n#include \"server/core/x.h\"\n",
}
BAD = {
    "dem_offline/engine/a.cc": "#include <yaml-cpp/yaml.h>\n",
    "dem_offline/engine/b.cc": "#include \"grouser/v1alpha1/run.pb.h\"\n",
    "dem_offline/engine/core/b.h": "#pragma once\n#include \"dem_offline/engine/laws/a.h\"\n",
    "dem_offline/engine/contact/b.cc": "#include \"dem_offline/engine/world/a.h\"\n",
    "dem_offline/engine/gpu/b.cc": "#include \"dem_offline/engine/bench/a.h\"\n",
    "dem_offline/engine/rig/b.cc": "#include \"proto/records/run_file.h\"\n",
    "dem_offline/campaign/a.cc": "#include \"surrogate/models/wheel_model.h\"\n",
    "dem_offline/campaign/b.cc": "#include <Simbody.h>\n",
    "dem_offline/multibody/a.cc": "#include \"dem_offline/campaign/executor.h\"\n",
    "dem_offline/multibody/b.h": "#pragma once\n#include <simbody/internal/Motion.h>\n",
    "surrogate/models/a.cc": "#include \"grouser/v1alpha1/model.pb.h\"\n",
    "surrogate/fit/a.cc": "#include \"dem_offline/engine/rig/wheel_test.h\"\n",
    "surrogate/terrain_map/slope.cc": "#include <gdal_priv.h>\n",
    "surrogate/model_io/a.cc": "#include \"proto/records/run_file.h\"\n",
    "server/core/a.cc": "#include <grpcpp/grpcpp.h>\n",
    "server/core/b.cc": "#include \"grouser/v1alpha1/terrain_service.pb.h\"\n",
    "server/net/a.cc": "#include \"server/query/terrain_server.h\"\n",
    "server/query/a.cc": "#include \"surrogate/fit/fit.h\"\n",
    "server/query/b.cc": "#include <hdf5.h>\n",
    "server/jobs/a.cc": "#include \"dem_offline/engine/rig/wheel_test.h\"\n",
    "proto/lcm/a.cc": "#include <lcm/lcm.h>\n",
    "proto/records/b.cc": "#include <yaml-cpp/yaml.h>\n",
    "proto/records/a.cc": "#include \"server/core/status.h\"\n",
    "proto/records/model_file.cc": "#include <hdf5.h>\n",
    "proto/records/run_file.cc": "#include <sqlite3.h>\n",
    "proto/grouser/v1alpha1/a.proto": "import \"server/a.proto\";\n",
    "clients/cpp/a.cc": "#include \"server/core/status.h\"\n",
    "clients/cpp/b.h": "int x;\n",
    "clients/in_process/a.cc": "#include \"clients/cpp/terrain_client.h\"\n",
    "clients/in_process/grouser/a.h": "#pragma once\n#include \"surrogate/models/wheel_model.h\"\n",
    "clients/in_process/example/a.cc": "#include \"surrogate/models/wheel_model.h\"\n",
    "clients/mujoco/a.cc": "#include \"clients/in_process/contact_load.h\"\n",
    "clients/python/a.cc": "#include \"clients/in_process/parts.h\"\n",
    "tests/a.py": "\n" * (MAX_LINES + 1),
    "surrogate/fit/b.cc": "// TO" "DO later\n",
}


def self_test():
    """Every planted mistake must be found, and nothing else."""
    with tempfile.TemporaryDirectory() as folder:
        for path, text in {**GOOD, **BAD}.items():
            file = pathlib.Path(folder, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, encoding="utf-8")
        found = [p.split(":")[0] for p in check_tree(folder)[1]]
    if sorted(found) != sorted(BAD):
        print(f"planted: {sorted(BAD)}\nfound: {sorted(found)}")
        return 1
    return 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    if len(arguments) != 1 or not pathlib.Path(arguments[0]).is_dir():
        print(__doc__, file=sys.stderr)
        return 2
    count, problems = check_tree(arguments[0])
    print("\n".join(problems + [f"{count} files, {len(problems)} problems"]))
    return 1 if problems or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
