"""Cone index of a soil as a row of surrogate/soils/cone_indices.csv."""

import math

COLUMNS = ("soil", "soil_sha256", "cone_index_kPa", "cone_index_se_kPa", "gradient_kPa_per_m", "gradient_se_kPa_per_m",
           "beds", "to_depth_mm", "cone_diameter_mm", "cone_angle_deg", "speed_mm_per_s", "grain_mm",
           "bevameter_sha256", "source")


def standard_error(one):
    """Of a mean over beds; none of one bed."""
    return None if one["sd_of_beds"] is None else one["sd_of_beds"] / math.sqrt(one["beds"])


def cone_row(summary, digest):
    """Cells of the row. summary: bevameter.json with a cone; digest: SHA-256 of that file."""
    cone, gradient = summary["cone_index"], summary["cone_index"]["gradient"]
    numbers = [(cone["value"], 1e-3), (standard_error(cone), 1e-3), (gradient["value"], 1e-3),
               (standard_error(gradient), 1e-3), (cone["beds"], 1), (cone["to_depth_m"], 1e3), (cone["diameter_m"], 1e3),
               (cone["angle_deg"], 1), (cone["speed_m_per_s"], 1e3), (summary["grain_diameter_m"], 1e3)]
    source = (f"virtual bevameter, {summary['soil_file']}, engine {summary['engine_version']}, friction of the cone "
              f"{summary['tool_friction']:g}")
    return [summary["soil"], summary["soil_sha256"],
            *("" if value is None else f"{scale * value:.6g}" for value, scale in numbers), digest, source]


def cell_of(text):
    """A cell that CsvCells of surrogate/soils/csv_cells.h reads as text, and that begins no comment."""
    text = " ".join(text.splitlines())
    return '"' + text.replace('"', '""') + '"' if text.startswith("#") or "," in text or '"' in text else text


def table_of(summary, digest):
    """Text of a table with that one row."""
    return ",".join(COLUMNS) + "\n" + ",".join(map(cell_of, cone_row(summary, digest))) + "\n"
