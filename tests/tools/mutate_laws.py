#!/usr/bin/python3
"""Flips one sign in each law in turn and shows that a row of verify fails.

  tests/tools/mutate_laws.py              every mutation (about ten minutes on two cores)
  tests/tools/mutate_laws.py jkr bond     those whose name holds one of the words

Works on a copy of dem_offline/engine in a temporary folder (--folder keeps
one), builds grouser-verify there and runs the cases named beside the mutation.
A flipped sign changes no struct, so only what evaluates contacts is compiled
anew, for the baseline instruction set (which gives the same bits as the rest).
Prints a table on stdout; exit status 1 when a mutant survives, or when the
unchanged engine fails.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]

# name, file below dem_offline/engine, text (must stand there once), its mutant, cases of verify
MUTATIONS = [
    ("hertz_restitution", "laws/normal_hertz.h", "return p.damping * Sqrt(stiffness",
     "return -p.damping * Sqrt(stiffness", "restitution_hertz"),
    ("linear_spring", "laws/normal_linear.h", "g.overlap + c * overlap_rate",
     "g.overlap - c * overlap_rate", "restitution_linear"),
    ("hertz_oden_martins", "laws/normal_oden_martins.h", "return p.beta * g.overlap",
     "return -p.beta * g.overlap", "restitution_oden_martins"),
    ("hertz_dashpot", "laws/normal_hertz_dashpot.h", "return p.fixed + p.share * Sqrt",
     "return -p.fixed - p.share * Sqrt", "restitution_hertz_dashpot"),
    ("elasto_plastic", "laws/normal_elasto_plastic.h", "Max(deepest - elastic_most",
     "Max(deepest + elastic_most", "restitution_elasto_plastic"),
    ("walton_braun", "laws/normal_walton_braun.h", "1.0f - p.k1 / p.k2", "1.0f + p.k1 / p.k2",
     "restitution_walton_braun"),
    ("tangential spring (mindlin, linear_history, kelvin)", "laws/tangential_spring.h",
     "kept - (kt * dt) * v_t", "kept + (kt * dt) * v_t", "tangential_stiffness"),
    ("tangential dashpot", "laws/tangential_spring.h", "trial - (slides", "trial + (slides",
     "tangential_kelvin"),
    ("mindlin", "laws/tangential_mindlin.h", "kt = p.ratio * normal", "kt = -p.ratio * normal",
     "tangential_stiffness"),
    ("linear_history", "laws/tangential_linear.h", "kt = p.ratio * normal",
     "kt = -p.ratio * normal", "tangential_stiffness"),
    ("mindlin_displacement", "laws/tangential_displacement.h", "kept - dt * v_t",
     "kept + dt * v_t", "tangential_stiffness"),
    ("mindlin_deresiewicz", "laws/tangential_deresiewicz.h", "ds = -dt * v_t", "ds = dt * v_t",
     "tangential_deresiewicz"),
    ("mindlin_deresiewicz, unloading", "laws/tangential_deresiewicz.h", "h.turn - te",
     "h.turn + te", "tangential_deresiewicz"),
    ("kelvin_regularised", "laws/tangential_kelvin.h", "p.stick - p.fall", "p.stick + p.fall",
     "tangential_kelvin"),
    ("epsd", "laws/rolling_epsd.h", "kept - (kr * dt) * w_t", "kept + (kr * dt) * w_t",
     "rolling_resistance"),
    ("epsd, dashpot", "laws/rolling_epsd.h", "h.elastic - c * w_t", "h.elastic + c * w_t",
     "epsd_holds"),
    ("constant_torque", "laws/rolling_constant.h", "return {-share * w_t", "return {share * w_t",
     "rolling_resistance"),
    ("own_spin", "laws/rolling_own_spin.h", "return {-share * g.w_own", "return {share * g.w_own",
     "rolling_resistance"),
    ("jkr", "laws/cohesion_jkr.h", "(a * a / r) - pull +", "(a * a / r) + pull +", "jkr_exact"),
    ("jkr_added", "laws/cohesion_jkr_added.h", "normal.force - (c +", "normal.force + (c +",
     "jkr_added"),
    ("capillary", "laws/cohesion_capillary.h", "normal.force - pull", "normal.force + pull",
     "capillary_bridge"),
    ("bond, normal", "world/bond_pass.cc", "Scale(-pull, s.axis)", "Scale(pull, s.axis)",
     "bond_stiffness"),
    ("bond, shear", "world/bond_pass.cc", "Scale(-kt, s.u_t)", "Scale(kt, s.u_t)",
     "bond_stiffness"),
    ("bond, bending", "world/bond_pass.cc", "Scale(-kb, s.th_b)", "Scale(kb, s.th_b)",
     "bond_stiffness"),
    ("bond, torsion", "world/bond_pass.cc", "twist = -kw * s.th_t", "twist = kw * s.th_t",
     "bond_stiffness"),
    ("bond, tensile strength", "world/bond_pass.cc", "torn = pull / e.area + Norm(bend)",
     "torn = -pull / e.area + Norm(bend)", "bond_strength"),
    ("contact, torque on the first", "contact/contact_body.h", "r.moment - (g.r_own",
     "r.moment + (g.r_own", "momentum_pair"),
    ("contact, torque on the second", "contact/contact_body.h", "moment - (g.r_other",
     "moment + (g.r_other", "momentum_pair"),
    ("body contact, torque", "world/touch_body.h", "r.moment - lever * Cross",
     "r.moment + lever * Cross", "slip_to_roll"),
]


def run(command, log, **options):
    with open(log, "a", encoding="utf-8") as out:
        return subprocess.run(command, stdout=out, stderr=subprocess.STDOUT, check=False,
                              **options).returncode


def build(folder, log):
    """Configures once, builds; False: does not compile."""
    if not (folder / "build" / "build.ninja").exists():
        if run(["cmake", "-G", "Ninja", "-S", str(folder / "dem_offline/engine"), "-B",
                str(folder / "build"), "-DCMAKE_BUILD_TYPE=Release",
                "-DCMAKE_CXX_FLAGS_RELEASE=-O1"], log):
            return False
    return run(["ninja", "-C", str(folder / "build"), "grouser-verify"], log) == 0


EVALUATE = ["isa/baseline.cc.o", "isa/generic.cc.o",
            "world/body_pass.cc.o", "world/bond_pass.cc.o"]


def put(folder, path, text):
    """Writes a source, keeps its time, and drops the objects that evaluate contacts."""
    stamp = path.stat()
    path.write_text(text, encoding="utf-8")
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    for name in EVALUATE:
        for found in (folder / "build").rglob("*.o"):
            if str(found).endswith(name):
                found.unlink()


def verdict(folder, cases, log):
    """Names of the failed rows, or None when all passed."""
    failed = []
    for case in cases.split():
        done = subprocess.run([str(folder / "build/grouser-verify"), "verify", "--case", case],
                              capture_output=True, text=True, check=False, timeout=600,
                              env={**os.environ, "GROUSER_ISA": "baseline"})
        with open(log, "a", encoding="utf-8") as out:
            out.write(done.stdout + done.stderr)
        if done.returncode != 0:
            failed += [line for line in done.stdout.splitlines() if " NO " in line] or [case]
    return failed or None


def stale(chosen):
    """Mutations whose text does not stand once in its file, as messages."""
    for name, file, old, _, _ in chosen:
        path = ROOT / "dem_offline" / "engine" / file
        times = path.read_text(encoding="utf-8").count(old) if path.exists() else 0
        if times != 1:
            yield f"{name}: {file}: '{old}' stands there {times} times, expected once"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--folder", help="build here and keep it")
    parser.add_argument("--texts", action="store_true",
                        help="only check that every mutation still finds its text")
    arguments = parser.parse_args()
    chosen = [m for m in MUTATIONS if (not arguments.words or any(w in m[0] for w in arguments.words))]
    outdated = list(stale(chosen))
    if outdated or arguments.texts:
        print("\n".join(outdated) or f"{len(chosen)} mutations find their text")
        return 1 if outdated else 0
    folder = pathlib.Path(arguments.folder or tempfile.mkdtemp(prefix="grouser-mutate-"))
    log = folder / "log"
    target = folder / "dem_offline" / "engine"
    shutil.copytree(ROOT / "dem_offline" / "engine", target, dirs_exist_ok=True)
    bad = 0
    try:
        cases = " ".join(sorted({m[4] for m in chosen}))
        if not build(folder, log) or verdict(folder, cases, log):
            sys.exit(f"mutate_laws: the unchanged engine fails; see {log}")
        print("| mutation | in | sign flipped | verdict | seconds |\n| --- | --- | --- | --- | --- |")
        for name, file, old, new, cases in chosen:
            begin = time.monotonic()
            path = target / file
            text = path.read_text(encoding="utf-8")
            put(folder, path, text.replace(old, new))
            built = build(folder, log)
            failed = verdict(folder, cases, log) if built else None
            put(folder, path, text)
            said = (f"caught: {len(failed)} rows of {cases} fail" if failed
                    else "SURVIVED" if built else "does not compile")
            bad += not failed
            print(f"| {name} | `{file}` | `{old}` -> `{new}` | {said} "
                  f"| {time.monotonic() - begin:.0f} |", flush=True)
    finally:
        if not arguments.folder:
            shutil.rmtree(folder, ignore_errors=True)
    print(f"\n{len(chosen) - bad} of {len(chosen)} caught")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
