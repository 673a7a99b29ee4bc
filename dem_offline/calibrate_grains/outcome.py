"""From the table of runs to a calibration: its numbers, its soil and scene files, its page."""

import datetime
import hashlib
import json
import os

import check
import grains_page
import identify
import numpy
import plain_yaml
import posterior as bayes
import predict
import vary as varied
from evidence import Evidence, Runs, blocks_of
from processes import write_atomically


AT_END = 0.02  # of a range: closer to its end no uniform posterior has its quantiles


class Inference:
    """Everything that the inference finds. table: of the design; start: vary.Start; vary: as the table says."""

    def __init__(self, table, targets, start, say):
        self.table, self.targets, self.start = table, targets, start
        self.vary = varied.Vary({name: tuple(ends) for name, ends in table["ranges"].items()}, table["fixed"])
        self.radius = float(start.scene["wheel"]["radius_m"])
        self.runs = Runs(table, self.vary)
        blocks = blocks_of(targets, self.radius)
        say(f"{len(self.runs.points)} points of the design for {len(blocks)} fitted blocks of rows")
        self.evidence = Evidence(blocks, [self.runs.process(block) for block in blocks])
        self.target = bayes.Target(self.evidence)
        self.posterior = bayes.sample(self.target)

    def next_points(self, count):
        return identify.next_points(self.vary, self.evidence, self.posterior, count)

    def found(self, command):
        """As calibration.json has it."""
        parameters = identify.parameters_of(self.vary, self.posterior)
        directions = identify.directions_of(self.vary, self.posterior)
        rows = predict.rows_of(self.targets, self.runs, self.evidence, self.posterior, self.radius)
        best, how = identify.best_of(self.vary, self.target, self.posterior)
        points = self.table["points"]
        return {
            "soil": self.targets.soil, "source": self.targets.source, "command": command,
            "files": [*self.targets.files, *(self.table[name] for name in ("soil", "scene"))],
            "design": {"points": len(points), "used": len(self.runs.points), "beds": self.table["beds"],
                       "failed": [one["label"] for one in points if one["status"] == "failed"],
                       "core_hours": sum(sum(one["seconds"].values()) for one in points) / 3600},
            "fixed": self.vary.fixed, "parameters": parameters, "best": {"values": best, "is": how},
            "correlation": identify.correlation_of(self.posterior), "not_identified": directions,
            "form_errors": self._form_errors(), "runs_share": identify.runs_share(self.evidence, self.posterior),
            "next_tests": identify.next_tests(self.targets, self.runs, self.evidence, self.posterior, self.radius,
                                              directions),
            "next_points": [{"values": values, "takes": gain} for values, gain in self.next_points(3)],
            "emulators": self._left_out(), "errors": predict.errors_of(rows), "rows": rows,
            "sampling": {"samples": len(self.posterior.u), "stages": self.posterior.stages,
                         "accepted": self.posterior.accepted, "distinct": self.posterior.distinct},
            "notes": self._notes(best, parameters)}

    def _form_errors(self):
        """By group of rows: share of the value (curves), of load, load x radius, radius (wheels)."""
        found = []
        for k, group in enumerate(self.evidence.groups):
            low, middle, high = (float(one) for one in numpy.quantile(self.posterior.share[:, k], [0.05, 0.5, 0.95]))
            found.append({"group": group, "blocks": int((self.evidence.group == k).sum()), "median": middle,
                          "low90": low, "high90": high, "typical": float(self.evidence.typical[k])})
        return found

    def _left_out(self):
        """Leave-one-out of each fitted block's emulator, of the runs that the others tell; curves as logarithms."""
        found = []
        for block, process in zip(self.evidence.blocks, self.evidence.processes):
            mean, sd = process.left_out()
            told = numpy.isfinite(sd)
            run, mean, sd = process.y[told], mean[told], sd[told]
            error = mean - run
            found.append({"block": block.name, "group": block.group, "logarithm": block.is_log, "runs": len(process.y),
                          "sd_of_runs": float(process.y.std()), "rms": float((error**2).mean()**0.5),
                          "noise_sd": process.noise**0.5,
                          "lengths": dict(zip((self.vary.names[k] for k in process.columns),
                                              map(float, process.lengths))),
                          "in_90": float((abs(error) <= predict.Z90 * sd).mean()),
                          "run": run.tolist(), "predicted": mean.tolist(), "sd": sd.tolist()})
        return found

    def _notes(self, best, parameters):
        notes = [*self.targets.notes, *self.runs.notes]
        notes += [f"{block.name}: no run of the design answers it, left out of the fit"
                  for block in self.evidence.unanswered if block.kind not in self.runs.unseen]
        for one in parameters:
            for end, near in ((0, one["low90"]), (1, one["high90"])):
                at = varied.position(varied.KNOWN[one["name"]], *one["range"], near)
                if abs(at - end) < AT_END:
                    notes.append(f"{one['name']}: the 90 % interval reaches the end {one['range'][end]:g} of its "
                                 "range: the data may want more than it allows")
        tool = {**self.vary.fixed, **best}.get("tool_friction")
        if tool is not None:
            notes.append(f"tool_friction {tool:g} stands in no soil or scene file: it is of the plates alone "
                         "(./grouser bevameter --tool-friction)")
        return notes


def write(inference, command, out, checked=False):
    """calibration.json, calibrated.soil.yaml, calibrated.scene.yaml and report.html in a folder; what was found."""
    found = inference.found(command)
    if checked:
        found["dem_as_truth"] = check.dem_as_truth(inference)
    design = hashlib.sha256(json.dumps(inference.table["points"], sort_keys=True).encode()).hexdigest()
    found["design"]["sha256_of_points"] = design
    write_atomically(os.path.join(out, "calibration.json"), json.dumps(found, indent=1) + "\n")
    for name, text in soil_and_scene(inference, found).items():
        write_atomically(os.path.join(out, name), text)
    write_atomically(os.path.join(out, "report.html"), grains_page.page_of(found, inference))
    return found


def soil_and_scene(inference, found):
    """{file name: text} of the best point, with where it comes from."""
    values = {**inference.vary.fixed, **found["best"]["values"]}
    soil, scene, *_ = inference.start.made(values, inference.start.soil["name"] + "-calibrated")
    data = ", ".join(f"{one['file']} {one['sha256'][:12]}" for one in inference.targets.files)
    source = (f"./grouser calibrate grains, {datetime.date.today().isoformat()}: {found['best']['is']}; data {data}; "
              f"{found['design']['used']} points of DEM runs {found['design']['sha256_of_points'][:12]}; "
              f"start {inference.table['soil']['file']} {inference.table['soil']['sha256'][:12]}")
    soil["source"] = f"{source}; what was not varied: {soil['source']}"
    scene["soil"] = "calibrated.soil.yaml"
    scene["name"] = scene["name"] + "-calibrated"
    if "wheel_friction" in values:
        scene["wheel"]["source"] = f"friction: {source}; what was not varied: {scene['wheel'].get('source', '')}"
    known = [f"#   {one['name']}: {values[one['name']]:g} (90 %: {one['low90']:.4g} to {one['high90']:.4g}"
             + ("" if one["identified"] else "; the tests do not tell it") + ")" for one in found["parameters"]]
    head = "\n".join(["# Written by ./grouser calibrate grains from measured tests; the posterior: calibration.json of that call.",
                      *known]) + "\n"
    return {"calibrated.soil.yaml": head + plain_yaml.text_of(soil), "calibrated.scene.yaml": head + plain_yaml.text_of(scene)}


def summary(found):
    """What goes to stdout."""
    lines = [f"soil {found['soil']}: {found['design']['used']} points of the design, best: {found['best']['is']}", "",
             f"{'parameter':<24} {'best':>10} {'90 % from':>10} {'to':>10} {'range':>18} {'left':>6}"]
    for one in found["parameters"]:
        low, high = one["range"]
        lines.append(f"{one['name']:<24} {found['best']['values'][one['name']]:>10.4g} {one['low90']:>10.4g} "
                     f"{one['high90']:>10.4g} {f'{low:g} to {high:g}':>18} {100 * one['share_left']:>5.0f}%"
                     + ("" if one["identified"] else "  not identified"))
    lines += ["", f"{'test':<22} {'measured':<9} {'fitted':>7} {'rms':>10} | {'held out':>8} {'rms':>10} "
              f"{'in 90 %':>8}"]
    for one in found["errors"]:
        fitted, held = one["fitted"], one["held_out"]
        lines.append(f"{one['test']:<22} {one['measured']:<9} {fitted['n']:>7} {number(fitted['rms']):>10} | "
                     f"{held['n']:>8} {number(held['rms']):>10} {percent(held['covered90']):>8}"
                     + (f"  {one['not_run']} rows not run" if one["not_run"] else ""))
    lines += [""] + [f"- {one['text']} ({100 * one['share_left']:.0f} % of what was uncertain is left)"
                     for one in found["not_identified"]] or ["All parameters are told by the data."]
    for one in found["next_points"][:1]:
        lines.append("next DEM point: " + ", ".join(f"{name} {value:g}" for name, value in one["values"].items())
                     + f" takes {100 * one['takes']:.0f} % of the emulators' variance (--more 1)")
    if "dem_as_truth" in found:
        lines.append(grains_page.truth_words(found["dem_as_truth"]))
    lines += [f"note: {text}" for text in found["notes"]]
    return "\n".join(lines) + "\n"


def number(value):
    return "-" if value is None else f"{value:.4g}"


def percent(value):
    return "-" if value is None else f"{100 * value:.0f} %"
