"""Campaigns, fits and calibrations by Grouser's programs, which these functions start and wait for.

The files are those of the command line, as are what the programs check and say. The programs are
looked for in `programs` (a folder), else in the build that this package is of, then in the PATH. What
ends early, by an exception of a callback or Ctrl-C, ends its program too.
"""

import json
import numbers
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from typing import Any, Optional, Union

from ._core import Error, Model

File = Union[str, os.PathLike[str]]
Say = Optional[Callable[[str], object]]
Progress = Optional[Callable[[float, Optional[float], str], object]]

_BUILT = pathlib.Path(__file__).absolute().parents[2] / "bin"
_PROGRESS = re.compile(r"progress ([\d.]+)(?: eta=([\d.]+))? ?(.*)")
_LINES_OF_ERROR = 15
_END_S = 10.0


class ProgramError(Error):
    """A program ended with another exit code than 0: exit_code; its last lines are in the text."""

    def __init__(self, text: str, exit_code: int) -> None:
        super().__init__(text)
        self.exit_code = exit_code

    def __reduce__(self) -> tuple[Any, ...]:  # by default unpickled with the text alone
        return type(self), (str(self), self.exit_code), self.__dict__


def _program(name: str, programs: Optional[File]) -> str:
    places = [os.fspath(programs)] if programs is not None else [str(_BUILT), os.environ.get("PATH", "")]
    found = shutil.which(name, path=os.pathsep.join(places))
    if found is None:
        raise Error(f"{name}: not in {programs if programs is not None else 'the PATH'}; "
                    "expected Grouser's programs there, or their folder as programs=")
    return found


def _end(child: "subprocess.Popen[str]") -> None:
    """Ends a program and its own children; it is gone when this returns or raises."""
    try:
        os.killpg(child.pid, signal.SIGTERM)
        child.wait(_END_S)
    except subprocess.TimeoutExpired:
        pass
    finally:  # also where Ctrl-C is pressed again
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()


def _run(argv: list[str], say: Callable[[str], object]) -> str:
    """Runs a program, hands each line of its stderr to `say`, returns its stdout."""
    last: list[str] = []
    with tempfile.TemporaryFile("w+", encoding="utf-8") as out:
        # Also ended where this process is killed: the kernel sends it SIGTERM then.
        with subprocess.Popen(["setpriv", "--pdeathsig", "TERM", "--", *argv], stdin=subprocess.DEVNULL, stdout=out,
                              stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True) as child:
            try:
                for line in child.stderr or ():
                    last = [*last[1 - _LINES_OF_ERROR:], line.rstrip("\n")]
                    say(last[-1])
                child.wait()
            finally:
                if child.poll() is None:
                    _end(child)
        if child.returncode != 0:
            raise ProgramError("\n".join([f"{' '.join(argv)}: ended with {child.returncode}:", *last]),
                               child.returncode)
        out.seek(0)
        return out.read()


def _word(value: Any) -> str:
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    # repr of NumPy's own numbers is np.float64(0.5) in its later versions.
    return repr(int(value)) if isinstance(value, numbers.Integral) else repr(float(value))


def _options(**options: Any) -> list[str]:
    """--name=value of what is not None; a list is several of one name, True a flag."""
    argv = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is True:
            argv.append(flag)
        elif value is not None and value is not False:
            several = value if isinstance(value, (list, tuple)) else [value]
            argv += [f"{flag}={_word(v)}" for v in several]
    return argv


def _files(files: Union[File, Iterable[File]]) -> list[str]:
    return [os.fspath(f) for f in ([files] if isinstance(files, (str, os.PathLike)) else files)]


def _nobody(_: str) -> None:
    pass


def run_campaign(file: File, out: File, *, jobs: Optional[int] = None, device: Optional[str] = None,
                 known: Iterable[File] = (), programs: Optional[File] = None, on_progress: Progress = None,
                 on_line: Say = None) -> dict[str, Any]:
    """`grouser-dem campaign run`: a campaign of DEM wheel tests into the folder `out`; goes on where it stopped.

    jobs: runs at a time, by default all cores; device: 'cpu', 'cuda', 'auto'; known: summaries of runs that
    are not run again. on_progress: called with the share that is done, the seconds to go (or None) and what
    runs; on_line: with every other line that the program says. Returns the campaign's status (name, total,
    done, steady, unsteady, overload, ...). Raises ProgramError.
    """
    def take(line: str) -> None:
        match = _PROGRESS.fullmatch(line)
        if match is None:
            (on_line or _nobody)(line)
        elif on_progress is not None:
            on_progress(float(match[1]), float(match[2]) if match[2] else None, match[3])

    argv = [_program("grouser-dem", programs), "campaign", "run", os.fspath(file), "--json", "--progress-lines",
            *_options(out=out, jobs=jobs, device=device, known=_files(known))]
    return dict(json.loads(_run(argv, take)))


def fit(runs: Union[File, Iterable[File]], name: str, out: File, *, kind: Optional[str] = None,
        measured: Optional[File] = None, accept_unusual: bool = False, profile_weight: Optional[float] = None,
        reason: Optional[str] = None, programs: Optional[File] = None, on_line: Say = None) -> Model:
    """`grouser-fit fit`: a model of the runs of campaign folders or summaries; written to `out`, and opened.

    kind: 'hybrid' (default), 'bekker' or 'lookup'; measured: CSV of measured tests, kept in the model, which
    gives it intervals for a measurement. Other options as on the command line. Raises ProgramError.
    """
    argv = [_program("grouser-fit", programs), "fit",
            *_options(runs=_files(runs), name=name, out=out, kind=kind, measured=measured,
                      accept_unusual=accept_unusual, profile_weight=profile_weight, reason=reason)]
    _run(argv, on_line or _nobody)
    return Model.open(out)


def calibrate_soil(data: Union[File, Iterable[File]], *, out: Optional[File] = None, name: Optional[str] = None,
                   form: Optional[str] = None, published: Optional[File] = None, programs: Optional[File] = None,
                   on_line: Say = None) -> dict[str, Any]:
    """`grouser-calibrate soil`: parameters of a soil from measured tests, with intervals and what they do not tell.

    data: measurement files (YAML, docs/calibration.md); out: folder for soil.csv and calibration.json; name:
    of the soil; form: 'auto' (default), 'bekker' or 'reece'; published: table of soils that says what is
    typical, by default Grouser's. Returns what calibration.json holds: parameters,
    observations, errors, next_tests, ... Raises ProgramError.
    """
    argv = [_program("grouser-calibrate", programs), "soil", *_files(data), "--json",
            *_options(out=out, name=name, form=form, published=published)]
    return dict(json.loads(_run(argv, on_line or _nobody)))
