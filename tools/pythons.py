"""The CPythons of a machine: what `make wheel` makes wheels with and tests/wheel_test.py tries them in."""
import os
import pathlib
import subprocess
from typing import NamedTuple

OLDEST = (3, 10)
STABLE = (3, 12)  # from there on one wheel for all (Python's stable ABI)
ASKED = ("import os, sys, sysconfig; print(sys.implementation.name, *sys.version_info[:2], sys.abiflags or '-', "
         "os.path.realpath(sys.executable), sys.base_prefix, sysconfig.get_path('include'), sep='\\n')")


class Python(NamedTuple):
    version: tuple[int, int]
    program: pathlib.Path
    prefix: pathlib.Path  # where it is installed
    headers: bool  # an extension module can be compiled for it

    @property
    def name(self) -> str:
        return f"{self.version[0]}.{self.version[1]}"

    @property
    def wheel_tag(self) -> str:
        """How the name of its wheel goes on after the package's version."""
        own = "cp" + self.name.replace(".", "")
        return "cp312-abi3" if self.version >= STABLE else f"{own}-{own}"


def ask(program: pathlib.Path) -> Python | None:
    """None where it is no CPython that a wheel can be for, or does not run."""
    try:
        done = subprocess.run([program, "-c", ASKED], capture_output=True, text=True, check=True, timeout=60)
    except (OSError, subprocess.SubprocessError):
        return None
    name, major, minor, flags, itself, prefix, include = done.stdout.splitlines()
    version = int(major), int(minor)
    if name != "cpython" or version < OLDEST or flags != "-":  # "t": without the interpreter's lock
        return None
    return Python(version, pathlib.Path(itself), pathlib.Path(prefix), pathlib.Path(include, "Python.h").exists())


def found() -> list[Python]:
    """Those in the PATH and pyenv's, one of each version, oldest first."""
    folders = [pathlib.Path(folder) for folder in os.environ["PATH"].split(":") if folder]
    pyenv = pathlib.Path(os.environ.get("PYENV_ROOT") or pathlib.Path.home() / ".pyenv")
    folders += sorted(pyenv.glob("versions/3.*/bin"))
    programs = [path for folder in folders for path in folder.glob("python3.[0-9]*")
                if path.name.removeprefix("python3.").isdigit()]
    pythons: dict[tuple[int, int], Python] = {}
    for python in filter(None, map(ask, programs)):
        known = pythons.get(python.version)
        if known is None or python.headers > known.headers:
            pythons[python.version] = python
    return [pythons[version] for version in sorted(pythons)]
