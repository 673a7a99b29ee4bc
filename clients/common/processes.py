"""Child processes: each in a group of its own, all ended at exit."""

import os
import signal
import subprocess
import time


class Interrupted(BaseException):
    """SIGINT, SIGTERM or SIGHUP came; no failure of a stage."""

    def __init__(self, number):
        super().__init__(signal.Signals(number).name)
        self.number = number


class ProgramFailed(Exception):
    """A program ended with another exit code than the one wanted. exit_code: none where there is no single one."""

    def __init__(self, text, exit_code=None):
        super().__init__(text)
        self.exit_code = exit_code


def raise_on_signals():
    def handler(number, _frame):
        raise Interrupted(number)

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, handler)


def exit_code_of(work, bad_input, say):
    """What a driver ends with: 0 or 1 as work() is true or not, 2 for the exception of bad input,
    1 for a program that failed, 128 and its number after a signal; errors are said."""
    try:
        return 0 if work() else 1
    except bad_input as error:
        say(str(error))
        return 2
    except (ProgramFailed, OSError) as error:
        say(f"FAILED: {error}")
        return 1
    except Interrupted as stop:
        say(f"ended by {stop}; the same command goes on from here")
        return 128 + stop.number


class Processes:
    """Starts programs and ends them. A child also gets SIGTERM from the kernel
    when this process dies (setpriv --pdeathsig), so that not even kill -9
    leaves one behind."""

    def __init__(self, log_folder, inherited=()):
        """inherited: descriptors that children keep open, such as a lock that they share."""
        self._log_folder = log_folder
        self._inherited = inherited
        self._running = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop_all()

    def start(self, name, argv, stdout=subprocess.DEVNULL, show=False):
        """Starts a program; its stderr goes to logs/NAME.log, or where ours goes."""
        with open(self.log_path(name), "ab") as log:
            child = subprocess.Popen(
                ["setpriv", "--pdeathsig", "TERM", "--", *map(str, argv)],
                stdin=subprocess.DEVNULL, stdout=stdout, stderr=None if show else log,
                start_new_session=True, pass_fds=self._inherited)
        self._running.append(child)
        return child

    def start_with_output(self, name, argv, show=False):
        """As start(), for finish()."""
        return self.start(name, argv, stdout=subprocess.PIPE, show=show)

    def finish(self, name, child, meanwhile=None, every_s=None):
        """Waits for a program of start_with_output, returns its stdout as text. meanwhile: called every `every_s`
        seconds until then."""
        while True:
            try:
                out, _ = child.communicate(timeout=every_s if meanwhile else None)
                break
            except subprocess.TimeoutExpired:
                meanwhile()
        self._running.remove(child)
        if child.returncode != 0:
            raise ProgramFailed(f"{' '.join(child.args[4:])}\nended with {child.returncode}:\n"
                                + self.log_tail(name), child.returncode)
        return out.decode()

    def run(self, name, argv, show=False, meanwhile=None, every_s=None):
        """Runs a program to its end and returns its stdout as text; meanwhile, every_s: as for finish()."""
        return self.finish(name, self.start_with_output(name, argv, show), meanwhile, every_s)

    def stop(self, child, patience_s=15):
        """SIGTERM to the group, SIGKILL after `patience_s`; returns the exit code."""
        self._signal_group(child, signal.SIGTERM)
        try:
            child.wait(patience_s)
        except subprocess.TimeoutExpired:
            self._signal_group(child, signal.SIGKILL)
            child.wait()
        self._signal_group(child, signal.SIGKILL)  # what the leader left behind
        if child in self._running:
            self._running.remove(child)
        return child.returncode

    def stop_all(self):
        """Ends everything; signals that come meanwhile are ignored."""
        before = {number: signal.signal(number, signal.SIG_IGN)
                  for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
        for child in self._running:
            self._signal_group(child, signal.SIGTERM)
        for child in list(self._running):
            self.stop(child)
        for number, handler in before.items():
            signal.signal(number, handler)

    def log_path(self, name):
        return os.path.join(self._log_folder, name + ".log")

    def log_tail(self, name, lines=15):
        with open(self.log_path(name), errors="replace") as log:
            return "".join(log.readlines()[-lines:])

    @staticmethod
    def _signal_group(child, number):
        try:
            os.killpg(child.pid, number)
        except ProcessLookupError:
            pass


def wait_for(attempt, what, patience_s=60):
    """Calls `attempt` until it returns something; returns that."""
    deadline = time.monotonic() + patience_s
    while time.monotonic() < deadline:
        found = attempt()
        if found:
            return found
        time.sleep(0.05)
    raise ProgramFailed(f"waited {patience_s} s for {what}")


def wait_for_file(path, child, what):
    """Waits until `path` has content; fails when `child` ends before."""
    def content():
        if child.poll() is not None:
            raise ProgramFailed(f"{what} ended with {child.returncode} before it was ready")
        if not os.path.exists(path):
            return ""
        with open(path) as file:
            return file.read().strip()
    return wait_for(content, what)


def write_atomically(path, data):
    """Writes text or bytes aside, syncs, renames."""
    aside = f"{path}.tmp{os.getpid()}"
    try:
        with open(aside, "wb") as file:
            file.write(data.encode() if isinstance(data, str) else data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(aside, path)
    finally:
        if os.path.exists(aside):
            os.unlink(aside)
