"""The commands of the program, as functions: each runs it and raises ygslam.Error with its line."""
from __future__ import annotations

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
from typing import Any, TypeAlias

from ._core import ConfigError, Error, InputError, MapError, ModelError, OutputError, UsageError

Path: TypeAlias = str | bytes | os.PathLike[str] | os.PathLike[bytes]
LOST = 7  # exit code of a run whose files are there, but that was lost for long
KINDS: dict[int, type[Error]] = {2: UsageError, 3: ConfigError, 4: InputError, 5: ModelError, 6: MapError, 9: OutputError}


def _program() -> str:
    beside = pathlib.Path(__file__).parent / "ygslam"
    found = os.environ.get("YGSLAM_BINARY") or (str(beside) if beside.exists() else shutil.which("ygslam"))
    if not found:
        raise FileNotFoundError("the program `ygslam` is neither beside this package nor in the PATH")
    return found


def _environment() -> dict[str, str]:
    """A wheel brings the Python programs of `bench` and `eval --plot` along: where they lie, and what runs them."""
    report = pathlib.Path(__file__).parent / "report"
    ours = {"YGSLAM_REPORT": str(report), "YGSLAM_PYTHON": sys.executable} if report.is_dir() else {}
    return {**ours, **os.environ}


def path_of(path: Path) -> str:
    """str, bytes or os.PathLike as str. Bytes that are no UTF-8 stay what they are, as os.fsdecode has it."""
    text = os.fsdecode(path)
    if "\0" in text:
        raise ValueError("path: holds a zero byte")
    return text


def _word(value: Any) -> str:
    return path_of(value) if isinstance(value, (bytes, os.PathLike)) else str(value)


def _file(name: str, path: Path) -> str:
    """An argument of a call, which is no option even where it looks like one."""
    if not isinstance(path, (str, bytes, os.PathLike)):
        raise TypeError(f"{name}: str, bytes or os.PathLike is expected, not {type(path).__name__}")
    text = path_of(path)
    return f"./{text}" if text.startswith("-") and text != "-" else text


def _options(options: dict[str, Any]) -> list[str]:
    """out_dir=1 -> --out-dir 1; True -> the flag alone; a dict under `set` -> --set key=value."""
    words = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if name in ("help", "version"):
            raise UsageError(f"{name}: is not for calls")
        if getattr(value, "dtype", None) == bool and not getattr(value, "ndim", 0):
            value = bool(value)  # of NumPy
        if name == "set" and value is not None:
            if not isinstance(value, dict):
                raise TypeError(f"set: a dict is expected, not {type(value).__name__}")
            words += [f"--set={key}={text}" for key, text in value.items()]
        elif value is True:
            words.append(flag)
        elif isinstance(value, (list, tuple)):
            for item in value:
                words += [flag, _word(item)]
        elif value is not False and value is not None:
            words += [flag, _word(value)]
    return words


def _call(*words: Any) -> str:
    # In a session of its own: Ctrl-C is handed on once, for a second one ends it without writing.
    with subprocess.Popen([_program(), "--quiet", *map(_word, words)], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, encoding="utf-8", errors="replace",
                          start_new_session=True, env=_environment()) as child:
        try:
            output, said = child.communicate()
        except KeyboardInterrupt:
            child.send_signal(signal.SIGINT)
            child.communicate()
            raise
    if child.returncode in (0, LOST):
        return output
    lines = [line for line in said.splitlines() if line.startswith("error: ")]
    kind = KINDS.get(child.returncode, Error)
    told = lines[-1].removeprefix("error: ") if lines else said.strip()
    error = kind(told or f"the program ended with {child.returncode}")
    error.code = child.returncode
    raise error


def _object(text: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(text)
    return content


def _metrics(out: Path) -> dict[str, Any]:
    return _object((pathlib.Path(path_of(out)) / "metrics.json").read_text(encoding="utf-8"))


def run(sequence: Path, out: Path, **options: Any) -> dict[str, Any]:
    """`ygslam run`: options as on the command line (`deterministic=True`, `model="..."`,
    `set={"run.seed": 2}`). @return what metrics.json says."""
    _call("run", _file("sequence", sequence), "--out", _file("out", out), *_options(options))
    return _metrics(out)


def localize(sequence: Path, map_file: Path, out: Path, **options: Any) -> dict[str, Any]:
    """`ygslam localize`: where a recording was taken in a map, which stays as it is."""
    _call("localize", _file("sequence", sequence), "--map", _file("map_file", map_file), "--out", _file("out", out),
          *_options(options))
    return _metrics(out)


def evaluate(ground_truth: Path, estimate: Path, **options: Any) -> dict[str, Any]:
    """`ygslam eval --json`: ATE, RPE and more of a TUM trajectory."""
    return _object(_call("eval", "--gt", _file("ground_truth", ground_truth), "--est", _file("estimate", estimate),
                         "--json", *_options(options)))


def simulate(world: str, out: Path, **options: Any) -> None:
    """`ygslam simulate`: renders a sequence with exact truth (`seconds=8`, `size="640x480"`)."""
    _call("simulate", _file("world", world), "--out", _file("out", out), *_options(options))
