"""What a bevameter finds of a soil as lines of surrogate/soils/cone_indices.csv and bevameter_soils.csv.

summary: bevameter.json; digest: SHA-256 of that file."""

import math

CONE_COLUMNS = ("soil", "soil_sha256", "cone_index_kPa", "cone_index_se_kPa", "gradient_kPa_per_m",
                "gradient_se_kPa_per_m", "beds", "to_depth_mm", "cone_diameter_mm", "cone_angle_deg", "speed_mm_per_s",
                "grain_mm", "bevameter_sha256", "source")
# Of surrogate/soils/bevameter_table.cc: (name, column, of SI units in one of the column's).
BEKKER = (("n", "n", 1), ("k_c", "k_c_kN_per_m_n_plus_1", 1e3), ("k_phi", "k_phi_kN_per_m_n_plus_2", 1e3),
          ("cohesion", "cohesion_kPa", 1e3), ("friction_angle", "friction_angle_deg", math.pi / 180),
          ("shear_modulus", "shear_modulus_K_mm", 1e-3))
REECE = (("reece_n", "reece_n", 1), ("reece_k_c", "reece_k_c", 1), ("reece_k_phi", "reece_k_phi", 1),
         ("reece_cohesion", "reece_cohesion_kPa", 1e3))
PARAMETER_COLUMNS = ("soil", "soil_sha256", *(column + end for _, column, _ in BEKKER + REECE
                                              for end in ("", "_low90", "_high90")),
                     "density_kg_per_m3", "form", "not_identified", "beds", "grain_mm", "bevameter_sha256", "source")


def cell_of(text):
    """A cell that CsvCells of surrogate/soils/csv_cells.h reads as text, and that begins no comment."""
    text = " ".join(text.splitlines())
    return '"' + text.replace('"', '""') + '"' if text.startswith("#") or "," in text or '"' in text else text


def table_of(columns, cells):
    """Text of a table with that one row."""
    return ",".join(columns) + "\n" + ",".join(map(cell_of, cells)) + "\n"


def standard_error(one):
    """Of a mean over beds; none of one bed."""
    return None if one["sd_of_beds"] is None else one["sd_of_beds"] / math.sqrt(one["beds"])


def number(value, unit=1):
    """In that unit; none: nothing."""
    return "" if value is None else f"{value / unit:.6g}"


def source_of(summary, what):
    return (f"virtual bevameter, {summary['soil_file']}, engine {summary['engine_version']}, friction of the {what} "
            f"{summary['tool_friction']:g}")


def cone_table(summary, digest):
    """Of a summary with a cone."""
    cone, gradient = summary["cone_index"], summary["cone_index"]["gradient"]
    cells = [number(cone["value"], 1e3), number(standard_error(cone), 1e3), number(gradient["value"], 1e3),
             number(standard_error(gradient), 1e3), number(cone["beds"]), number(cone["to_depth_m"], 1e-3),
             number(cone["diameter_m"], 1e-3), number(cone["angle_deg"]), number(cone["speed_m_per_s"], 1e-3),
             number(summary["grain_diameter_m"], 1e-3)]
    return table_of(CONE_COLUMNS, [summary["soil"], summary["soil_sha256"], *cells, digest,
                                   source_of(summary, "cone")])


def parameter_table(summary, digest):
    """Of a summary with parameters: each with its interval of 90 %, an end that is unbounded left empty."""
    found = {one["name"]: one for one in summary["parameters"]}
    found.update({"reece_" + one["name"].removeprefix("reece_"): one for one in summary["reece_parameters"] or []})
    cells, typical = [], []
    for name, _, unit in BEKKER + REECE:
        one = found.get(name, {})
        cells += [number(one.get(key), unit) for key in ("value", "low90", "high90")]
        typical += [] if one.get("identified", True) else [name]
    source = source_of(summary, "tools") + ", tests " + " ".join(summary["tests"]) + (", quick" * summary["quick"])
    return table_of(PARAMETER_COLUMNS, [
        summary["soil"], summary["soil_sha256"], *cells, number(summary["bulk_density"]["bed"]["value"]),
        summary["form"], " ".join(typical), number(summary["beds"]), number(summary["grain_diameter_m"], 1e-3), digest,
        source])
