"""The refinement stage: doubt one answer, let DEM settle it, promote."""

import hashlib
import json
import math

from demo_context import distance, expect
from processes import wait_for, write_atomically
from records import OUTPUTS, Run, number

STATE = {"slip": 0.55, "angle_deg": 42.0}  # away from every run of the campaign
HELD_OUT_SEED = 2                          # another bed than the model's own


def refine(demo):
    state = dict(STATE, load=demo.load_n)
    nearest = min(distance(run, state) for run in demo.runs)
    expect(nearest > 0.5, f"a run of the campaign stands at the state to refine ({nearest:.2f})")
    before = demo.query([state])
    submitted = demo.client_json("submit", *demo.state_options(state))["job"]
    held_out = demo.processes.start_with_output("held_out", held_out_command(demo, state))
    job = demo.client_json("watch", submitted["job_id"])
    expect(job["job_state"] == "JOB_STATE_AWAITING_PROMOTION",
           f"job {job['job_id']} is {job['job_state']}: {job['message']}")
    expect(demo.query([state])["model"] == before["model"],
           "a candidate answered before its promotion")
    check_provenance(demo, job)
    truth = json.loads(demo.processes.finish("held_out", held_out))
    expect(Run(truth).steady, f"the held-out run is {truth['status']}: {truth['reason']}")
    promotion = promote(demo, job)
    after = answer_of_candidate(demo, state, job["candidate_digest"])
    demo.data["refinement"] = {"before": before["responses"], "after": after["responses"],
                               "held_out": truth, "job": job, "promotion": promotion}
    print_outcome(demo, before, after, Run(truth))


def held_out_command(demo, state):
    """A DEM run at the same state on another bed, which no fit ever sees."""
    spec = dict(next(run for run in demo.runs if run.steady).record["spec"])
    spec["state"] = {"mode": "RIG_MODE_RIM_SPEED", "slip": state["slip"], "load_n": state["load"],
                     "attack_angle_rad": math.radians(state["angle_deg"])}
    spec["seed"] = HELD_OUT_SEED
    write_atomically(demo.path("state", "held_out.spec.json"), json.dumps(spec))
    return [demo.program("grouser-dem"), "run", "--spec", demo.path("state", "held_out.spec.json"),
            "--tiles", demo.path("campaign", "tiles"), "--out", demo.path("state", "held_out.run.h5"),
            "--json"]


def check_provenance(demo, job):
    """The worker's run file has the hash that the job and the candidate name."""
    with open(demo.path("state", "runs", job["run_file"]), "rb") as file:
        digest = hashlib.sha256(file.read()).hexdigest()
    expect(digest == job["run_sha256"],
           f"{job['run_file']} hashes to {digest}, the job says {job['run_sha256']}")
    candidate = demo.run_json("fit", "grouser-fit", "show",
                              demo.path("state", "models", job["candidate_digest"] + ".model"))["model"]
    provenance = candidate["provenance"]
    named = [run for run in provenance["runs"] if run["sha256"] == digest]
    expect(len(named) == 1 and named[0]["file"] == job["run_file"],
           f"the candidate's provenance does not name {job['run_file']} with its hash")
    base = job["model"].partition("@sha256:")[2]
    expect(provenance["base_digest"] == base, "the candidate does not name the model it refines")
    demo.print(f"run {job['run_file']}, sha256 {digest}, is in the provenance of candidate "
               f"{job['candidate_digest'][:12]}\n")


def promote(demo, job):
    """By hand, as a person would; says when the gate had to be overridden."""
    failed = [check["name"] for check in job["gate"] if not check["passed"]]
    for check in job["gate"]:
        demo.print(f"gate {check['name']}: {'passed' if check['passed'] else 'FAILED'} ({check['detail']})\n")
    why = "demo: refined where the campaign had no run"
    options = ["--override-gate"] if failed else []
    demo.client_json("promote", job["job_id"], "--candidate", job["candidate_digest"], "--who", "demo", "--why", why, *options)
    if failed:
        return f"by hand, overriding the gate, which refused it for {', '.join(failed)}"
    return "by hand, with every gate check passed"


def answer_of_candidate(demo, state, digest):
    """Waits until the server answers with the promoted model."""
    def answer():
        found = demo.query([state])
        return found if digest in found["model"] else None
    return wait_for(answer, "the server to answer with the promoted model")


def print_outcome(demo, before, after, truth):
    demo.print(f"{'output':9}{'held-out DEM':>18}{'before [interval]':>34}{'error':>10}"
               f"{'after [interval]':>34}{'error':>10}\n")
    for output, mean in truth.mean.items():
        if output not in OUTPUTS:
            continue
        line = f"{output:9}{mean:>10.4g} ± {truth.standard_error[output]:<5.2g}"
        for answer in (before, after):
            array = answer["responses"][output]
            value, low, high = (number(array[key][0]) for key in ("value", "low", "high"))
            line += f"{value:>13.4g} [{low:8.4g}, {high:8.4g}]{value - mean:>+10.3g}"
        demo.print(line + "\n")
