"""A Python environment for one job: made, used, removed."""

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

TOOLS = Path(__file__).resolve().parent


class ToolError(Exception):
    """What went wrong, in one line for the user."""


def fail_in_one_line(main):
    """Runs main(); a ToolError becomes one line on stderr and exit code 1."""
    try:
        return main()
    except ToolError as error:
        print(f"{Path(sys.argv[0]).name}: error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def run(command, what, **options):
    """Runs a command, its output to stderr. Raises ToolError with the last line it printed."""
    tail = []
    with subprocess.Popen(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        **options,
    ) as process:
        for line in process.stdout:
            sys.stderr.write(line)
            if line.strip():
                tail = (tail + [line.strip()])[-20:]
    if process.returncode != 0:
        errors = [line for line in tail if "error" in line.lower()]
        raise ToolError(f"{what} failed: {(errors or tail or ['no message'])[-1]}")


def install(python, requirements, *pip_options):
    """Installs tools/<requirements> into the environment of `python`."""
    command = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += [*pip_options, "-r", TOOLS / requirements]
    run(command, f"installing {requirements}")


@contextlib.contextmanager
def environment(folder=None):
    """The python of a new environment: in a temporary folder that is removed afterwards, or, to be
    kept, in `folder` (used as it is where it exists already)."""
    temporary = tempfile.mkdtemp(prefix="ygslam-env-") if folder is None else None
    place = Path(temporary or folder).resolve()
    try:
        python = place / "bin" / "python"
        if not python.exists():
            run([sys.executable, "-m", "venv", place], f"making a Python environment in {place}")
        yield python
    finally:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)


def move_into_place(source, target):
    """Puts a finished file where it belongs, whole or not at all."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = target.with_name(f".{target.name}.{os.getpid()}")
        shutil.copyfile(source, partial)
        os.replace(partial, target)
    except OSError as error:
        raise ToolError(f"{target}: {error.strerror}") from error
