"""The mission stage: a planner, an energy estimate and a calibration job use one server at once, and each gives the
answer that it gives alone."""

import json
import os

from demo_context import expect
from processes import write_atomically

VEHICLE = "husky"
PATH = "s_m,curvature_per_m,grade_deg,soil\n0,0,0,asphalt\n4,0.2,4,asphalt\n8,0.5,0,floor\n12,0,-4,floor\n"
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MEASURED = os.path.join(ROOT, "surrogate", "calibrate", "measured", "cmu_plates.yaml")


def mission(demo):
    path_file = demo.path("state", "path.csv")
    write_atomically(path_file, PATH)
    server = ["--server", demo.address("server"), "--json"]

    def plan():
        return demo.run("mission", "grouser-vehicle", "speed", VEHICLE, path_file, "--limit", "1", *server)

    def energy():
        return demo.run("mission", "grouser-vehicle", "energy", VEHICLE, "--soil", "asphalt", "--speed", "0.5",
                        "--radius", "1", *server)

    alone = plan(), energy()
    demo.run("mission", "grouser-calibrate", "soil", MEASURED, "--out", demo.path("state", "soil_alone"))
    child = demo.processes.start_with_output(
        "calibrate", [demo.program("grouser-client"), "calibrate", "soil", MEASURED, "--watch", "--json",
                      *demo.addresses])
    asked = 0
    while child.poll() is None or asked == 0:
        expect((plan(), energy()) == alone, "a plan or an energy estimate beside a calibration job is another than alone")
        asked += 1
    job = json.loads(demo.processes.finish("calibrate", child))
    expect(job["job_state"] == "JOB_STATE_DONE", f"job {job['job_id']} is {job['job_state']}: {job['message']}")
    demo.client("fetch", job["job_id"], "--out", demo.path("calibration"))
    rows = rows_of(demo.path("calibration", "soil.csv"))
    expect(rows == rows_of(demo.path("state", "soil_alone", "soil.csv")),
           "the soil that the job has found is another than that of grouser-calibrate alone")
    demo.data["mission"] = {"asked": asked, "vehicle": VEHICLE, "job": job["job_id"], "soil": rows}
    demo.print(f"beside calibration {job['job_id']}: {asked} plans and energy estimates, all as alone; soil as alone\n")


def rows_of(path):
    """A table of soils without its comments, which name the command."""
    with open(path, encoding="utf-8") as file:
        return [line for line in file.read().splitlines() if not line.startswith("#")]
