#!/usr/bin/python3
"""Checks that no identifier and no file name uses a word that the glossary (docs/glossary.md)
replaced. Comments, strings and documents are not read: ordinary English stays allowed.
Usage: check_words.py ROOT | --self-test"""

import pathlib
import re
import sys
import tempfile

CODE_SUFFIXES = {".h", ".cc", ".inl", ".cu"}
ENGINE = ("dem_offline/engine", "tests/unit/engine")
DEM = ("dem_offline", "tests/unit/engine", "tests/unit/campaign")
SERVING = ("surrogate", "server", "clients")

# (folders, pattern, word to use, an identifier that the pattern refuses). The pattern of WORDS
# matches whole words of an identifier in snake case (HandOver and hand_over are one), that of
# NAMES the identifier as it is written.
WORDS = [
    (DEM, r"(far|near)_(first|second|of|count|partner|slots?|pairs?|stale|lists?|full)"
          r"|(find|most)_(far|near)", "outer list, inner list", "near_pairs"),
    (ENGINE, r"refresh(es)?", "prune", "RefreshLists"),
    (DEM, r"leash(es)?|tie_grain", "displacement bound", "leashes_"),
    (DEM, r"parked|asleep|awake|born_frozen", "inactive, frozen, active", "parked_j_"),
    (DEM, r"recipes?", "law combination", "kRecipeName"),
    (DEM, r"menu", "law registry", "LawMenu"),
    (DEM, r"homes?", "tile place", "by_home"),
    (DEM, r"plough(s|ed|ing)?", "bulldozing", "kPloughing"),
    (DEM, r"hand_?over|take_back", "export state, import state, device state", "BodyHandover"),
    (DEM, r"everything_simulated|only_what_is_needed|what_is_needed", "full domain, reduced domain",
     "OnlyWhatIsNeeded"),
    (DEM, r"chaos", "diverge", "ChaosParts"),
    (SERVING, r"rungs?", "kind of model", "rung_of"),
    (SERVING, r"cascade|climb", "model selection", "cascade_test"),
    (SERVING, r"hull_box", "training domain", "HullBox"),
    (SERVING, r"patch_noise", "bed variability", "PatchNoise"),
    (SERVING, r"ploughing", "bulldozing", "Ploughing"),
]
NAMES = [
    (DEM, r"Tie", "displacement bound", "Tie"),
    (DEM, r"Meet(ing)?", "EvaluateContact", "Meet"),
    (DEM, r"(Set|has_)?Interface|has_interface", "ContactProperties", "Interface"),
    (SERVING, r"Judge", "accuracy benchmark", "Judge"),
    (SERVING, r"Ladder", "accuracy benchmark, model selection", "Ladder"),
    (SERVING, r"Demand", "accuracy request", "Demand"),
    (("surrogate",), r"Row", "sample", "Row"),
]
# Names of fields in files and messages keep their spelling until the next major version.
WIRE = re.compile(r"(set_|mutable_|clear_|has_|add_)?(awake_particle_steps)(_size)?")

NOT_CODE = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.[^\'\n]{0,3}|[^\'\\\n])\'',
    re.S)
IDENTIFIER = re.compile(r"\b[A-Za-z_]\w*")
PART = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


def snake(identifier):
    """kFarFull, far_full_ -> k_far_full, far_full."""
    return "_".join(PART.findall(identifier)).lower()


def in_folders(path, folders):
    return any(path.startswith(f + "/") for f in folders)


def refused(identifier, words, names):
    """The word to use in place of one of the identifier's, or None."""
    if WIRE.fullmatch(identifier):
        return None
    for _, pattern, better, _ in words:
        if re.search(rf"(^|_)({pattern})(_|$)", snake(identifier)):
            return better
    for _, pattern, better, _ in names:
        if re.fullmatch(pattern, identifier):
            return better
    return None


def check_file(path, text):
    """Problems of one file as a list of texts; each identifier once, where it stands first."""
    words = [r for r in WORDS if in_folders(path, r[0])]
    names = [r for r in NAMES if in_folders(path, r[0])]
    if not words and not names:
        return []
    problems = []
    better = refused(pathlib.PurePosixPath(path).stem, words, names)
    if better:
        problems.append(f"{path}: the file's name; use: {better}")
    code = NOT_CODE.sub(lambda m: "\n" * m.group(0).count("\n"), text)
    seen = set()
    for found in IDENTIFIER.finditer(code):
        name = found.group(0)
        if name in seen:
            continue
        seen.add(name)
        better = refused(name, words, names)
        if better:
            line = code.count("\n", 0, found.start()) + 1
            problems.append(f"{path}:{line}: {name}; use: {better}")
    return problems


def check_tree(root):
    """Number of files read and all problems."""
    root = pathlib.Path(root)
    count, problems = 0, []
    for top in sorted({f.split("/")[0] for r in WORDS + NAMES for f in r[0]}):
        for file in sorted((root / top).rglob("*")):
            if file.suffix in CODE_SUFFIXES and file.is_file():
                count += 1
                problems += check_file(file.relative_to(root).as_posix(),
                                       file.read_text(encoding="utf-8"))
    return count, problems


GOOD = """\
// A leash, a recipe and a menu; what sleeps is parked and asleep, Meet me at home.
#include "x/recipe.h"
const char* text = "Tie the recipe" R"(awake
menu)"; char c = '"'; /* HandOver
refresh */ int nearest = 0, near_body = 0, homework = 0; long big = 1'000'000;
std::tie(a, b); meet(InterfaceChoice{}); record.set_awake_particle_steps(1); int far = 0;
"""


def self_test():
    """Each rule refuses its example and nothing in GOOD; lines and file names are right."""
    wrong = []
    for folders, _, better, example in WORDS + NAMES:
        path = folders[0] + "/a.cc"
        found = check_file(path, f"// {example}\nint {example};\n")
        if found != [f"{path}:2: {example}; use: {better}"]:
            wrong.append((example, found))
    for folder in {f for r in WORDS + NAMES for f in r[0]}:
        wrong += check_file(folder + "/good.cc", GOOD)
    with tempfile.TemporaryDirectory() as root:
        for path, text in {"dem_offline/engine/leash_body.h": "int a;\n",
                           "server/query/a.cc": "struct Demand;\n",
                           "tests/integration/a.cc": "int leash;\n"}.items():
            file = pathlib.Path(root, path)
            file.parent.mkdir(parents=True)
            file.write_text(text, encoding="utf-8")
        count, found = check_tree(root)
        if count != 3 or [f.split(":")[0] for f in found] != ["dem_offline/engine/leash_body.h",
                                                             "server/query/a.cc"]:
            wrong.append((count, found))
    print("\n".join(map(str, wrong)), end="\n" if wrong else "")
    return 1 if wrong else 0


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
