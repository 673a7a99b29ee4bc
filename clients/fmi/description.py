#!/usr/bin/python3
"""What variables.csv says, as modelDescription.xml of FMI 2 and 3, as buildDescription.xml and as the C++ table
variables.h. Usage: description.py --header OUT.h"""

import argparse
import csv
import pathlib
import sys
import xml.etree.ElementTree as ET

HERE = pathlib.Path(__file__).resolve().parent
IDENTIFIER = "grouser_wheel"
# Exponents of the base units.
UNITS = {"m": {"m": 1}, "s": {"s": 1}, "m/s": {"m": 1, "s": -1}, "rad": {"rad": 1}, "rad/s": {"rad": 1, "s": -1},
         "N": {"kg": 1, "m": 1, "s": -2}, "Nm": {"kg": 1, "m": 2, "s": -2}, "N/m": {"kg": 1, "s": -2}, "1": {}}
VARIABILITY = {"independent": "continuous", "input": "continuous", "parameter": "fixed", "calculatedParameter": "fixed"}
TYPES_OF_FMI_2 = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean"}
SOURCES = ["fmi2.cc", "fmi3.cc", "fmi3_not_offered.cc", "wheel_fmu.cc", "wheel_fmu_state.cc"]
COMPILER_OPTIONS = "-std=c++20 -O2 -fPIC -fvisibility=hidden"
HEADERS = ["fmi3_instance.h", "fmi_types.h", "variables.h", "wheel_fmu.h"]


def variables():
    """Rows of variables.csv as dictionaries, checked; the value reference is the place in the list."""
    lines = [line for line in (HERE / "variables.csv").read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    for row in rows:
        if None in row or None in row.values() or row["type"] not in TYPES_OF_FMI_2 or \
                (row["unit"] and row["unit"] not in UNITS):
            sys.exit(f"variables.csv: {row['name']}: expected name,type,causality,unit,start,description")
        row["variability"] = VARIABILITY.get(row["causality"], "continuous" if row["type"] == "Float64" else "discrete")
    return rows


def header(rows):
    """The same as a C++ table."""
    identifier = lambda name: "k" + "".join(part[:1].upper() + part[1:] for part in name.replace(".", "_").split("_"))
    references = "".join(f"  {identifier(r['name'])},\n" for r in rows)
    table = "".join(f'    {{"{r["name"]}", Type::k{r["type"]}, Causality::k{r["causality"][:1].upper()}'
                    f'{r["causality"][1:]}, {r["start"] or 0}}},\n' for r in rows)
    causalities = sorted({r["causality"] for r in rows})
    names = ", ".join("k" + c[:1].upper() + c[1:] for c in causalities)
    return f"""#pragma once
// Made of variables.csv by description.py.
#include <array>

namespace grouser::fmi {{

enum class Type {{ kFloat64, kInt32, kBoolean }};
enum class Causality {{ {names} }};
/// Value references.
namespace at {{
enum Reference : unsigned {{
{references}}};
}}
inline constexpr unsigned kVariables = {len(rows)};
struct Variable {{
  const char* name;
  Type type;
  Causality causality;
  double start;
}};
inline constexpr std::array<Variable, kVariables> kTable = {{{{
{table}}}}};

}}  // namespace grouser::fmi
"""


def start_of(row, start):
    """Start value as a text; None for what the FMU calculates. `start`: other values by name."""
    return str(start.get(row["name"], row["start"])) if row["causality"] in ("input", "parameter") else None


def text_of(root):
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def add_common(root):
    """Units and categories of messages, which both versions have alike."""
    units = ET.SubElement(root, "UnitDefinitions")
    for name, exponents in UNITS.items():
        ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit",
                      {base: str(power) for base, power in exponents.items()})
    ET.SubElement(ET.SubElement(root, "LogCategories"), "Category", name="logStatusError",
                  description="why a call failed")
    ET.SubElement(root, "DefaultExperiment", startTime="0", stepSize="0.001")


def calculated(rows):
    """Value references of what is known after initialisation alone."""
    return [i for i, r in enumerate(rows) if r["causality"] in ("output", "calculatedParameter")]


def model_description_3(rows, about, start):
    """modelDescription.xml of FMI 3.0. about: modelName, description, generationTool, token."""
    root = ET.Element("fmiModelDescription", fmiVersion="3.0", modelName=about["modelName"],
                      instantiationToken=about["token"], description=about["description"],
                      generationTool=about["generationTool"], variableNamingConvention="structured")
    ET.SubElement(root, "CoSimulation", modelIdentifier=IDENTIFIER, canGetAndSetFMUState="true",
                  canSerializeFMUState="true", canHandleVariableCommunicationStepSize="true")
    add_common(root)
    table = ET.SubElement(root, "ModelVariables")
    for i, row in enumerate(rows):
        of = {"name": row["name"], "valueReference": str(i), "description": row["description"],
              "causality": row["causality"], "variability": row["variability"]}
        if i in calculated(rows):
            of["initial"] = "calculated"
        if row["unit"]:
            of["unit"] = row["unit"]
        if start_of(row, start) is not None:
            of["start"] = start_of(row, start)
        ET.SubElement(table, row["type"], of)
    structure = ET.SubElement(root, "ModelStructure")
    for i in calculated(rows):
        if rows[i]["causality"] == "output":
            ET.SubElement(structure, "Output", valueReference=str(i))
    for i in calculated(rows):
        ET.SubElement(structure, "InitialUnknown", valueReference=str(i))
    return text_of(root)


def model_description_2(rows, about, start, with_sources):
    """modelDescription.xml of FMI 2.0."""
    root = ET.Element("fmiModelDescription", fmiVersion="2.0", modelName=about["modelName"], guid=about["token"],
                      description=about["description"], generationTool=about["generationTool"],
                      variableNamingConvention="structured", numberOfEventIndicators="0")
    kind = ET.SubElement(root, "CoSimulation", modelIdentifier=IDENTIFIER, canGetAndSetFMUstate="true",
                         canSerializeFMUstate="true", canHandleVariableCommunicationStepSize="true",
                         canNotUseMemoryManagementFunctions="true")
    if with_sources:
        files = ET.SubElement(kind, "SourceFiles")
        for name in SOURCES:
            ET.SubElement(files, "File", name=name)
    add_common(root)
    table = ET.SubElement(root, "ModelVariables")
    for i, row in enumerate(rows):
        of = {"name": row["name"], "valueReference": str(i), "description": row["description"],
              "causality": row["causality"], "variability": row["variability"]}
        if i in calculated(rows):
            of["initial"] = "calculated"
        typed = {"unit": row["unit"]} if row["unit"] else {}
        if start_of(row, start) is not None:
            typed["start"] = start_of(row, start)
        ET.SubElement(ET.SubElement(table, "ScalarVariable", of), TYPES_OF_FMI_2[row["type"]], typed)
    structure = ET.SubElement(root, "ModelStructure")
    outputs = ET.SubElement(structure, "Outputs")
    for i in calculated(rows):
        if rows[i]["causality"] == "output":
            ET.SubElement(outputs, "Unknown", index=str(i + 1))
    unknowns = ET.SubElement(structure, "InitialUnknowns")
    for i in calculated(rows):
        ET.SubElement(unknowns, "Unknown", index=str(i + 1))
    return text_of(root)


def build_description(library):
    """sources/buildDescription.xml of FMI 3.0; `library`: file name of Grouser's library."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=IDENTIFIER, platform="x86_64-linux",
                          description="g++ 12 or later; sources alone, Grouser's models come from its library")
    files = ET.SubElement(build, "SourceFileSet", language="C++20", compiler="g++",
                          compilerOptions=COMPILER_OPTIONS)
    for name in SOURCES:
        ET.SubElement(files, "SourceFile", name=name)
    ET.SubElement(files, "IncludeDirectory", name=".")
    ET.SubElement(build, "Library", name=library, external="false",
                  description="in binaries/x86_64-linux, and with the package libgrouser-dev")
    return text_of(root)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--header", type=pathlib.Path, required=True, help="variables.h to write")
    parser.parse_args().header.write_text(header(variables()))
