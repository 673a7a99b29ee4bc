"""Jobs of grouser-jobs: refinements, campaigns, calibrations. By grouser.client."""

import os
import pathlib
import re
import uuid
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, Optional, Union

from ._core import Error
from .channel import ABOUT, Connection
from .messages import make
from .v1alpha1 import jobs_service_pb2, jobs_service_pb2_grpc, run_pb2

File = Union[str, os.PathLike[str]]
_CHECK_S = 120.0  # the server's programs read the files before it answers
_WAITS_FOR_A_PERSON = jobs_service_pb2.JOB_STATE_AWAITING_PROMOTION


class Submitted(NamedTuple):
    """What was accepted. request_id: of this subscriber, for cancel() and to submit again without doing it twice."""

    job: jobs_service_pb2.Job
    joined: bool  #: an open job does this already
    request_id: str


def _bundle(files: Iterable[File]) -> tuple[dict[str, bytes], dict[str, str]]:
    """Files and those .yaml, .yml and .csv files that they name, by names below the deepest folder that holds them all;
    and these names of the given ones. As clients/cli/file_bundle.cc."""
    found: dict[pathlib.Path, bytes] = {}

    def add(path: pathlib.Path) -> None:
        if path in found:
            return
        try:
            found[path] = path.read_bytes()
        except OSError as error:
            raise Error(f"{path}: {error.strerror}") from None
        if path.suffix not in (".yaml", ".yml"):
            return
        for line in found[path].decode("utf-8", "replace").splitlines():
            for word in re.findall(r"[\w./-]+", re.sub(r"(^|\s)#.*", "", line), re.ASCII):
                named = pathlib.Path(os.path.normpath(path.parent / word))
                if named.suffix in (".yaml", ".yml", ".csv") and named.is_file():
                    add(named)

    given = {os.fspath(file): pathlib.Path(os.path.abspath(file)) for file in files}
    for path in given.values():
        add(path)
    root = os.path.commonpath([path.parent for path in found])
    return ({path.relative_to(root).as_posix(): content for path, content in found.items()},
            {name: path.relative_to(root).as_posix() for name, path in given.items()})


class JobsClient(Connection):
    __doc__ = f"""Jobs of grouser-jobs. What a Job's fields mean: jobs_service.proto.

    {ABOUT}

    Of all submissions: priority, -10 to 10, among your own jobs; time_limit, of its programs by the
    clock [s]; request_id makes it idempotent, by default a new one.
    """

    def __init__(self, address: str = "127.0.0.1:50152", **options: Any) -> None:
        super().__init__(address, **options)
        self._jobs = jobs_service_pb2_grpc.JobsServiceStub(self._channel)

    def _submit(self, method: Any, request: Any, time_limit: Optional[float], request_id: Optional[str],
                deadline: Optional[float], default: Optional[float]) -> Submitted:
        request.MergeFrom(make(type(request), request_id=request_id or f"python-{uuid.uuid4().hex}"))
        if time_limit is not None:
            try:
                request.time_limit.FromMilliseconds(round(1000 * time_limit))
            except (ValueError, OverflowError):
                raise Error(f"time_limit: {time_limit:g} s, expected 1 s or more, and finite") from None
        response = self._call(method, request, deadline, default)
        return Submitted(response.job, response.joined, request.request_id)

    def submit_refinement(self, *, load: float, slip: float = 0.0, attack_angle: float = 0.0, model: str = "",
                          mode: str = "rim_speed", speed: float = 0.0, drawbar: float = 0.0, seed: int = 0,
                          max_time: float = 0.0, priority: int = 0, time_limit: Optional[float] = None,
                          request_id: Optional[str] = None, deadline: Optional[float] = None) -> Submitted:
        """A fresh DEM run at one state and a refit.

        load [N], slip [-], attack_angle [rad]; mode: 'rim_speed', 'towed' or 'free_slip' (with drawbar, the
        pull to overcome [N]); speed: max(|r w|, V) [m/s], 0: the model's; seed: of the bed, 0: the model's;
        max_time: simulated [s], 0: as the model's rig.
        """
        modes = [name.removeprefix("RIG_MODE_").lower() for name, number in run_pb2.RigMode.items() if number != 0]
        if mode not in modes:
            raise Error(f"mode: '{mode}', expected {', '.join(modes)}")
        state = make(run_pb2.TestState, mode=f"RIG_MODE_{mode.upper()}", slip=slip, attack_angle_rad=attack_angle,
                     load_n=load, drawbar_n=drawbar, speed_m_per_s=speed)
        request = make(jobs_service_pb2.SubmitRefinementRequest, model=model, state=state, seed=seed,
                       max_time_s=max_time, priority=priority)
        return self._submit(self._jobs.SubmitRefinement, request, time_limit, request_id, deadline, None)

    def submit_campaign(self, file: File, *, more: Iterable[File] = (), from_server: bool = False,
                        server_files: Iterable[str] = (), priority: int = 0, time_limit: Optional[float] = None,
                        request_id: Optional[str] = None, deadline: Optional[float] = None) -> Submitted:
        """A campaign of DEM wheel tests.

        file: a campaign file; the .yaml and .csv files that it names go along, and `more`. from_server: it is
        instead one of the folder that the operator allows; server_files: scenes and soils of that folder.
        """
        request = make(jobs_service_pb2.SubmitCampaignRequest, priority=priority)
        work = {"file": os.fspath(file), "from_server": True} if from_server else {
            "file": self._add_files(request, [file, *more])[os.fspath(file)], "server_files": server_files}
        request.campaign.CopyFrom(make(jobs_service_pb2.CampaignWork, **work))
        return self._submit(self._jobs.SubmitCampaign, request, time_limit, request_id, deadline, _CHECK_S)

    def submit_soil_calibration(self, data: File, *, report: bool = False, more: Iterable[File] = (),
                                priority: int = 0, time_limit: Optional[float] = None,
                                request_id: Optional[str] = None, deadline: Optional[float] = None) -> Submitted:
        """Parameters of a soil from the measured tests of a measurement file; report: report.html as well."""
        request = make(jobs_service_pb2.SubmitCalibrationRequest, priority=priority)
        names = self._add_files(request, [data, *more])
        request.calibration.kind = jobs_service_pb2.CALIBRATION_KIND_SOIL
        request.calibration.data, request.calibration.report = names[os.fspath(data)], report
        return self._submit(self._jobs.SubmitCalibration, request, time_limit, request_id, deadline, _CHECK_S)

    def submit_grain_calibration(self, data: File, *, soil: File, scene: File, budget_hours: float,
                                 vary: Optional[File] = None, points: int = 0, more: Iterable[File] = (),
                                 priority: int = 0, time_limit: Optional[float] = None,
                                 request_id: Optional[str] = None, deadline: Optional[float] = None) -> Submitted:
        """DEM grains from measured tests: hours.

        soil: file of grains to begin with; scene: of the measured wheel; vary: parameters and their ranges;
        points: that fill the space, 0: ten for each parameter.
        """
        request = make(jobs_service_pb2.SubmitCalibrationRequest, priority=priority)
        of = {"data": data, "soil": soil, "scene": scene} | ({"vary": vary} if vary is not None else {})
        names = self._add_files(request, [*of.values(), *more])
        work = {field: names[os.fspath(file)] for field, file in of.items()}
        request.calibration.CopyFrom(make(
            jobs_service_pb2.CalibrationWork, kind=jobs_service_pb2.CALIBRATION_KIND_GRAINS,
            budget_hours=budget_hours, points=points, **work))
        return self._submit(self._jobs.SubmitCalibration, request, time_limit, request_id, deadline, _CHECK_S)

    @staticmethod
    def _add_files(request: Any, files: Iterable[File]) -> Mapping[str, str]:
        contents, names = _bundle(files)
        for name, content in contents.items():
            request.files.append(make(jobs_service_pb2.NamedFile, name=name, content=content))
        return names

    def job(self, job_id: str, *, deadline: Optional[float] = None) -> jobs_service_pb2.Job:
        """One job as it stands."""
        return self._call(self._jobs.GetJob, make(jobs_service_pb2.GetJobRequest, job_id=job_id), deadline).job

    def jobs(self, limit: int = 100, *, deadline: Optional[float] = None) -> list[jobs_service_pb2.Job]:
        """The newest jobs, at most `limit`, without stress and surface of their runs. deadline: of each page."""
        if limit < 1:
            raise Error(f"limit: {limit}, expected 1 or more")
        request = jobs_service_pb2.ListJobsRequest(page_size=min(limit, 500))
        return self._all_pages(self._jobs.ListJobs, request, "jobs", deadline, limit)

    def wait(self, job_id: str, on_change: Optional[Callable[[jobs_service_pb2.Job], object]] = None, *,
             deadline: float = 3600.0) -> jobs_service_pb2.Job:
        """Waits until a job has ended or awaits promotion; returns it then, whatever its state.

        on_change: called with the job as it stands and after every change. Raises ServerError with
        DEADLINE_EXCEEDED after `deadline` [s]; the job goes on.
        """
        job = None
        request = make(jobs_service_pb2.WatchJobRequest, job_id=job_id)
        for response in self._stream(self._jobs.WatchJob, request, deadline):
            job = response.job
            if on_change is not None:
                on_change(job)
            if job.job_state == _WAITS_FOR_A_PERSON:
                break
        if job is None:
            raise Error(f"job {job_id}: the server {self.address} told nothing of it")
        return job

    def promote(self, job: jobs_service_pb2.Job, *, who: str, why: str, alias: str = "stable", override_gate: bool = False,
                deadline: Optional[float] = None) -> jobs_service_pb2.Job:
        """Points an alias at a job's candidate; returns the job as it is then.

        job: as job(), jobs() or wait() gave it. Its candidate is what is promoted: where the job has another
        one by now, ServerError with FAILED_PRECONDITION names both, and nothing moves. who, why: recorded;
        override_gate: although a check failed. Raises Error for a job without a candidate.
        """
        if not job.candidate_digest:
            raise Error(f"job {job.job_id}: has no candidate, expected one that was shown to promote")
        request = make(jobs_service_pb2.PromoteRequest, job_id=job.job_id, candidate_digest=job.candidate_digest,
                       alias=alias, who=who, why=why, override_gate=override_gate)
        return self._call(self._jobs.Promote, request, deadline).job

    def cancel(self, job_id: str, request_id: str, *, deadline: Optional[float] = None) -> jobs_service_pb2.Job:
        """Withdraws one subscriber, Submitted.request_id; work stops when none is left."""
        request = make(jobs_service_pb2.CancelJobRequest, job_id=job_id, request_id=request_id)
        return self._call(self._jobs.CancelJob, request, deadline).job

    def read_file(self, job_id: str, name: str, *, deadline: Optional[float] = None) -> bytes:
        """One of a job's results, whole. deadline: of each part of 512 KiB.

        Raises Error where the server gives more or less than the size that it said first.
        """
        content, size = bytearray(), None
        while size is None or len(content) < size:
            request = make(jobs_service_pb2.ReadJobFileRequest, job_id=job_id, name=name, offset=len(content))
            part = self._call(self._jobs.ReadJobFile, request, deadline)
            size = part.bytes if size is None else size
            content += part.data
            if part.bytes != size or len(content) > size or (not part.data and len(content) < size):
                raise Error(f"job {job_id}: {name}: the server {self.address} gave {len(content)} bytes of "
                            f"{part.bytes}, expected {size}, which it said first")
        return bytes(content)
