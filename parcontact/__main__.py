"""Entry point of the program `parcontact`: runs a command line and returns its exit code."""

import errno
import gc
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import NoReturn

from .door import verbs
from .door.arguments import parse_arguments, without_restart
from .errors import BAD_INPUT, DONE, FAILED, STOPPED_EARLY, InputError, JobError, RunError
from .files import files
from .parallel.root import STOP
from .printed import describe_loss, tolerant_streams

STAGGER_SECONDS = 0.5  # delay of the other ranks before they print, so that root prints a common error first [s]
WAIT_SECONDS = 5.0  # longest time that a failing rank waits for the others to fail with the same error [s]
# verbs whose output is also in files: they succeed even if standard output is lost
LEAVE_FILES = {"run", "steady", "theory", "fit", "surface", "study", "plot", "report", "leak"}
REFUSALS = {  # errors of the system about a file that a user can correct: permission, kind, name, free space
    *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EFBIG),
    *(errno.EISDIR, errno.ENOTDIR, errno.ENAMETOOLONG),
}
UNCOLLECTED_OBJECTS = 20_000  # new objects after which Python searches for reference cycles


def program() -> int:
    """Run the command line of this process, and return the exit code.

    Python's garbage collector is slowed down and not run at the end: it would take a quarter of a short run, and steps
    leave no reference cycles.
    """
    gc.set_threshold(UNCOLLECTED_OBJECTS)
    for number in STOP:
        if signal.getsignal(number) == signal.SIG_DFL:  # excludes Ctrl-C and signals that nohup ignores
            signal.signal(number, _end_by_signal)
    try:
        return main()
    finally:
        gc.freeze()


def _end_by_signal(number: int, frame: FrameType | None) -> None:
    """Report a signal that arrives outside of a run, and end the process by its default action."""
    if all(os.environ.get(name, "0") == "0" for name in verbs.RANKS):  # without MPI, which may be starting
        os.write(2, f"parcontact: ended by {signal.Signals(number).name}, with nothing to save\n".encode())
    signal.signal(number, signal.SIG_DFL)
    signal.raise_signal(number)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line `argv` (default: the command line of this process), and return the exit code."""
    with tolerant_streams():
        return _run(list(sys.argv[1:] if argv is None else argv))


def _run(words: list[str]) -> int:
    try:
        _refuse_lost_directory()
        options = parse_arguments(words)
        code = int(options.act(options))
        return _leave_code(code if options.verb in LEAVE_FILES else code or _judge_output(), words)
    except SystemExit as asked:  # raised by --help and --version
        if asked.code or _judge_output() == DONE:
            raise
        return BAD_INPUT
    except (InputError, RunError) as error:
        code = FAILED if isinstance(error, RunError) else BAD_INPUT
        return _end_together(str(error) if isinstance(error, JobError) else f"parcontact: {error}", code)
    except OSError as error:
        if not (text := _describe_refusal(error)):
            _end_all(error)
        return _end_together(f"parcontact: {text}", BAD_INPUT)
    except (Exception, KeyboardInterrupt) as error:
        _end_all(error)


def _refuse_lost_directory() -> None:
    try:
        os.getcwd()
    except OSError as error:
        text = f"the working directory does not exist ({error.strerror}): change to another directory"
        raise InputError(text) from None


def _judge_output() -> int:
    """Return the exit code of a verb that succeeded: BAD_INPUT if its output could not be written."""
    reason = describe_loss() if verbs.is_root() else ""
    if reason:
        print(f"parcontact: cannot write to standard output: {reason}", file=sys.stderr, flush=True)
    return BAD_INPUT if reason else DONE


def _leave_code(code: int, words: Sequence[str] = ()) -> int:
    """Write the exit code, on root, to the file that PARCONTACT_EXIT_FILE names: launchers may end with their own.

    If the run can be continued, the words of the command line that does so follow, one per line.
    """
    if verbs.is_root() and (path := os.environ.get("PARCONTACT_EXIT_FILE")):
        more = without_restart(words) if code == STOPPED_EARLY else []
        with suppress(OSError):
            Path(path).write_text("".join(f"{line}\n" for line in (code, *more)))
    return code


def _end_together(text: str, code: int) -> int:
    """Print an error on root and return the exit code; abort all ranks if only some of them have the error."""
    root, world = verbs.is_root(), verbs.started()
    if root:
        print(text, file=sys.stderr, flush=True)
    if world is None:
        return _leave_code(code) if root else DONE
    arrival, deadline = world.Ibarrier(), time.monotonic() + WAIT_SECONDS
    while not arrival.Test():
        if time.monotonic() > deadline:
            if not root:
                print(f"{text} (on rank {world.rank} of {world.size} only)", file=sys.stderr, flush=True)
            world.Abort(code)
        time.sleep(1e-3)
    return _leave_code(code)


def _end_all(error: BaseException) -> NoReturn:
    """Print why this rank cannot continue, and end all ranks."""
    world = verbs.started()
    if not verbs.is_root():
        time.sleep(STAGGER_SECONDS)
    several = world is not None and world.size > 1
    code = STOPPED_EARLY if isinstance(error, KeyboardInterrupt) else FAILED
    where = f" on rank {world.rank} of {world.size}" if world is not None and several else ""
    said = f": {error}" if str(error) else ""
    reason = _describe_surroundings(error) or f"ended by {type(error).__name__}"
    if not isinstance(error, KeyboardInterrupt) and not _describe_surroundings(error):
        traceback.print_exception(error)
    print(f"parcontact: {reason}{where}{said}", file=sys.stderr, flush=True)
    if world is not None and several:
        world.Abort(code)
    sys.exit(code)


def _describe_refusal(error: OSError) -> str:
    """Return a sentence about a file that cannot be opened or written, or '' for other errors."""
    if error.errno not in REFUSALS or not isinstance(error.filename, str | Path):
        return ""
    return f"{files.without_mark(Path(error.filename))} cannot be opened or written: {error.strerror}"


def _describe_surroundings(error: BaseException) -> str:
    """Return a sentence about memory, open files or Matplotlib's settings if they caused the error, or ''."""
    limited = resource.getrlimit(resource.RLIMIT_AS)[0] != resource.RLIM_INFINITY
    if isinstance(error, MemoryError) or (limited and isinstance(error, ImportError | SystemError)):
        return "out of memory; free memory, raise the limit (ulimit -v), or use fewer points"
    if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
        return "too many open files; raise the limit (ulimit -n)"
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__) if frame.f_code.co_name == "<module>")
    if any(frame.f_globals["__name__"] == "matplotlib" for frame in frames):
        return "Matplotlib cannot start; correct MPLBACKEND, or matplotlibrc in the working directory"
    return ""


if __name__ == "__main__":
    sys.exit(program())
