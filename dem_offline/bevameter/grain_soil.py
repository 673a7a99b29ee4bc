"""A soil file of DEM grains (*.soil.yaml), and its values as keys of an experiment file.

This is the one place from which a soil reaches the experiments of the bevameter."""

import hashlib
import math
import os

import yaml
from experiment_runs import Refused

EXAMPLE = "dem_offline/campaigns/cmu_loose.soil.yaml"
TOP_KEYS = ("name", "bulk_density_kg_per_m3", "gravity_m_per_s2", "source", "grains")
GRAIN_NUMBERS = ("grain_density_kg_per_m3", "youngs_modulus_pa", "poisson_ratio", "restitution", "friction",
                 "rolling_friction", "solid_fraction")
GRAIN_KEYS = (*GRAIN_NUMBERS, "sizes", "preparation", "top_layer", "contact")


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def identity_of(soil):
    """SHA-256 of all that a soil of grains is: of its values a line "PATH=VALUE" each, sorted, numbers to 9 digits; without
    name, source and zeros. soil: a mapping as in a soil file or a run's record. The same in C++: SoilIdentity
    (surrogate/fit/soil_card.h)."""
    lines = []

    def walk(path, node):
        if isinstance(node, dict):
            for key, one in node.items():
                walk(f"{path}.{key}" if path else key, one)
        elif isinstance(node, list):
            for k, one in enumerate(node):
                walk(f"{path}[{k}]", one)
        elif is_number(node):
            if node != 0:
                lines.append(f"{path}={node:.9g}\n")
        elif node not in (None, ""):
            lines.append(f"{path}={node}\n")

    walk("", {key: one for key, one in soil.items() if key not in ("name", "source")})
    return hashlib.sha256("".join(sorted(lines)).encode()).hexdigest()


class GrainSoil:
    """As read and checked."""

    def __init__(self, path):
        self.path = path
        file = self._load()
        self._expect_keys(file, TOP_KEYS, TOP_KEYS, "")
        self.name, self.source = str(file["name"]), str(file["source"])
        self.bulk_density = self._number(file, "bulk_density_kg_per_m3", "")
        self.gravity = self._number(file, "gravity_m_per_s2", "")
        grains = file["grains"]
        self._expect_keys(grains, (*GRAIN_NUMBERS, "sizes"), GRAIN_KEYS, "grains.")
        for key in GRAIN_NUMBERS:
            self._number(grains, key, "grains.")
        self.grains = grains
        self.sizes = self._sizes(grains["sizes"])
        self.identity = identity_of(file)

    def _fail(self, where, got, expected):
        raise Refused(f"{self.path}: {where}: got {got}, expected {expected}")

    def _load(self):
        if not os.path.exists(self.path):
            raise Refused(f"{self.path}: no such file, expected a soil file as {EXAMPLE}")
        try:
            with open(self.path, encoding="utf-8") as file:
                text = yaml.safe_load(file)
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise Refused(f"{self.path}: no YAML: {' '.join(str(error).split())}") from None
        if not isinstance(text, dict):
            self._fail("the file", "no mapping", f"a soil file as {EXAMPLE}")
        if "grains" not in text:
            self._fail("grains", "none", f"a soil of DEM grains as {EXAMPLE}: others have nothing to press")
        return text

    def _expect_keys(self, section, needed, known, at):
        if not isinstance(section, dict):
            self._fail(at.rstrip("."), repr(section), "a mapping with " + ", ".join(needed))
        for key in needed:
            if key not in section:
                self._fail(at + key, "none", "it, as in " + EXAMPLE)
        for key in section:
            if key not in known:
                self._fail(at + str(key), "an unknown key", "one of " + ", ".join(known))

    def _number(self, section, key, at):
        try:
            value = float(section[key])  # YAML reads 1e7 as a text
        except (TypeError, ValueError):
            value = math.nan
        if isinstance(section[key], bool) or not math.isfinite(value):
            self._fail(at + key, repr(section[key]), "a number")
        section[key] = value
        return value

    def _sizes(self, bins):
        if not isinstance(bins, list) or not bins:
            self._fail("grains.sizes", repr(bins), "a list of {diameter_m, mass_fraction}")
        keys = ("diameter_m", "mass_fraction")
        for k, one in enumerate(bins):
            self._expect_keys(one, keys, keys, f"grains.sizes[{k}].")
            for key in keys:
                if not self._number(one, key, f"grains.sizes[{k}].") > 0:
                    self._fail(f"grains.sizes[{k}].{key}", one[key], "more than 0")
        return bins

    @property
    def diameter(self):
        """Mean by mass [m]."""
        whole = sum(one["mass_fraction"] for one in self.sizes)
        return sum(one["mass_fraction"] * one["diameter_m"] for one in self.sizes) / whole

    @property
    def largest(self):
        return max(one["diameter_m"] for one in self.sizes)

    def settings(self, tool_friction=None):
        """Keys of every experiment: materials, interfaces, laws, gravity. The grains are `sand`, floor
        and walls `steel`, what is pressed into them `tool`."""
        grains, contact = self.grains, dict(self.grains.get("contact") or {})
        at_wheel, at_floor = contact.pop("wheel", None) or {}, contact.pop("floor", None) or {}
        base = {key: grains[key] for key in ("restitution", "friction", "rolling_friction")}
        friction = grains["friction"] if tool_friction is None else tool_friction
        interfaces = [{"between": ["sand", "any"], **base},
                      {"between": ["sand", "tool"], **base, "friction": friction, **at_wheel}]
        if at_floor:
            interfaces.append({"between": ["sand", "steel"], **base, **at_floor})
        sand = {"name": "sand", "density_kg_per_m3": grains["grain_density_kg_per_m3"],
                "youngs_modulus_pa": grains["youngs_modulus_pa"], "poisson_ratio": grains["poisson_ratio"]}
        steel = [{"name": name, "density_kg_per_m3": 7800} for name in ("steel", "tool")]
        result = {"gravity_m_per_s2": self.gravity, "materials": [sand, *steel], "interfaces": interfaces}
        if contact:
            result["laws"] = contact
        return result

    def bed(self, depth, packed_with=None):
        """Key `grains` of a bed [m]. packed_with: frictions that made the same bed before and, where they are known,
        those of its top layer."""
        grains = {"kind": "bed", "material": "sand", "depth_m": depth, "sizes": self.sizes,
                  "solid_fraction": self.grains["solid_fraction"]}
        preparation = packed_with[0] if packed_with else self.grains.get("preparation")
        if preparation:
            grains["preparation"] = preparation
        if self.grains.get("top_layer"):
            again = {"preparation": packed_with[1]} if packed_with and len(packed_with) > 1 else {}
            grains["top_layer"] = {**self.grains["top_layer"], **again}
        return grains

    def poured(self, count, **more):
        """Key `grains` of grains that are poured, and pack by their own friction."""
        return {"kind": "poured", "material": "sand", "sizes": self.sizes, "count": count, **more}
