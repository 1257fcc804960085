#!/usr/bin/env python3
"""Wheels in dist/ that install without a compiler: Debian's libraries are put into them, with their licences.

    .venv/bin/python tools/wheel.py                          (`make wheel`)
    .venv/bin/python tools/wheel.py --python 3.12            the one for that alone
    .venv/bin/python tools/wheel.py --arm64                  for 64-bit ARM, after `tools/setup.sh arm64` (`make arm64`)

One wheel serves CPython 3.12 and all later ones (stable ABI), older ones have one each: it is made with every
CPython of this machine that such a wheel needs. With ccache, library and program are compiled once for all of them.

OpenVINO and the thread pool (TBB) that comes with it stay out: they are a dependency, a wheel of their own.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib
from typing import NamedTuple

from pythons import Python, found

ROOT = pathlib.Path(__file__).resolve().parent.parent
NOT_OURS = ("libopenvino*", "libtbb*")
# Debian's OpenCV asks GLX for its context, and GLX wants X11, which a robot does not have. Nothing here draws
# by OpenGL: without GLX the answer would be the same.
NO_GLX = """
void* glXGetCurrentContext(void) { return 0; }
void* glXGetCurrentDisplay(void) { return 0; }
void* glXGetProcAddressARB(const unsigned char* name) { (void)name; return 0; }
"""


class Target(NamedTuple):
    """What a wheel is for, and how it is built where that is not this machine."""
    name: str = ""
    compiler: str = "cc"
    environment: dict[str, str] = {}  # of the build
    libraries: tuple[pathlib.Path, ...] = ()  # where those of that machine lie


HERE = Target()
ARM_ROOT = ROOT / ".venv" / "arm64-root"


def arm64() -> tuple[Target, str]:
    """The target, and the version of the Python whose headers are there."""
    headers = max((ARM_ROOT / "usr" / "include").glob("python3.*"), default=None)
    if not (ARM_ROOT / "ready").exists() or headers is None:
        sys.exit("error: nothing of 64-bit ARM is here: run `tools/setup.sh arm64` first")
    version = headers.name.removeprefix("python")
    toolchain = ROOT / "cmake" / "toolchains" / "aarch64-linux-gnu.cmake"
    usual = [ARM_ROOT / lib / "aarch64-linux-gnu" for lib in ("usr/lib", "lib")]
    return Target("arm64", "aarch64-linux-gnu-gcc", {
        "_PYTHON_HOST_PLATFORM": "linux-aarch64",
        "SETUPTOOLS_EXT_SUFFIX": f".cpython-{version.replace('.', '')}-aarch64-linux-gnu.so",
        "CMAKE_ARGS": f"-DCMAKE_TOOLCHAIN_FILE={toolchain} -DPython_INCLUDE_DIR={headers} "
                      "-DYGSLAM_WERROR=ON",  # as the preset has it: ccache knows what `make arm64` compiled
    }, (*usual, usual[0] / "blas", usual[0] / "lapack")), version


def call(*command, **how) -> str:
    """What it prints; its own words and a clear end where it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, **how)
    if done.returncode:
        sys.exit(f"error: {' '.join(map(str, command[:4]))} ...: {(done.stderr or done.stdout).strip()[-2000:]}")
    return done.stdout


def with_libraries(wheel: pathlib.Path, folder: pathlib.Path, target: Target) -> pathlib.Path:
    """The wheel that brings its libraries along; its tag says from which glibc on it runs."""
    tools = {**os.environ, "PATH": f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"}
    if target.libraries:
        tools["AUDITWHEEL_LD_LIBRARY_PATH"] = ":".join(map(str, target.libraries))
    exclusions = [word for name in NOT_OURS for word in ("--exclude", name)]
    call(sys.executable, "-m", "auditwheel", "repair", *exclusions, "-w", folder, wheel, env=tools)
    repaired, = folder.glob("*.whl")
    return repaired


def source_package(library: pathlib.Path) -> str:
    """Debian's package that a library put into the wheel (name-HASH.so.N) came from; for ARM it has the same name."""
    name, _, version = library.name.partition(".so")
    stem = name.rpartition("-")[0]
    owners = call("dpkg", "-S", f"*/{stem}.so{version}").splitlines()
    return owners[0].split(":")[0]


def replace_glx(libraries: pathlib.Path, folder: pathlib.Path, compiler: str) -> None:
    """Puts NO_GLX in the place of GLX and leaves out what only GLX needs."""
    source = folder / "no_glx.c"
    source.write_text(NO_GLX, encoding="utf-8")
    for glx in libraries.glob("libGLX-*"):
        call(compiler, "-shared", "-fPIC", "-O1", "-s", f"-Wl,-soname,{glx.name}", source, "-o", glx)
    for dispatch in libraries.glob("libGLdispatch-*"):
        dispatch.unlink()


def add_licences(unpacked: pathlib.Path) -> None:
    """Puts the copyright file of every package whose library is in the wheel beside our licence."""
    licences = next(unpacked.glob("*.dist-info")) / "licenses"
    libraries = [path for path in (unpacked / "ygslam.libs").iterdir() if not path.name.startswith("libGLX-")]
    for package in sorted({source_package(path) for path in libraries}):
        shutil.copyfile(f"/usr/share/doc/{package}/copyright", licences / f"{package}.copyright")


def completed(wheel: pathlib.Path, folder: pathlib.Path, compiler: str) -> pathlib.Path:
    """The repaired wheel, for systems without a display, with all licences."""
    call(sys.executable, "-m", "wheel", "unpack", "-d", folder, wheel)
    unpacked = next(path for path in folder.iterdir() if path.is_dir())
    replace_glx(unpacked / "ygslam.libs", folder, compiler)
    add_licences(unpacked)
    packed = folder / "packed"
    packed.mkdir()
    call(sys.executable, "-m", "wheel", "pack", "-d", packed, unpacked)
    final, = packed.glob("*.whl")
    return final


def build(python: Python, made: pathlib.Path, target: Target) -> pathlib.Path:
    """The wheel without its libraries. One build folder for all: ccache knows what does not depend on the Python."""
    folder = ROOT / "build" / (f"wheel-{target.name}" if target.name else "wheel")
    command = ["wheel", "--no-deps", "-w", made, f"--config-settings=build-dir={folder}", ROOT]
    if target == HERE:
        call(sys.executable, "-m", "pip", "--python", python.program, *command)
    else:  # pip would look for the tools of the build, too, as if this were that machine
        tools = made.parent / "tools"
        call(python.program, "-m", "venv", tools)
        needed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
        call(tools / "bin" / "pip", "install", *(name for name in needed if not name.startswith("openvino")))
        call(tools / "bin" / "pip", "wheel", "--no-build-isolation", *command[1:],
             env={**os.environ, **target.environment, "PATH": f"{tools / 'bin'}:{os.environ['PATH']}"})
    own, = made.glob("*.whl")
    return own


def make_wheel(python: Python, out: pathlib.Path, target: Target) -> pathlib.Path:
    with tempfile.TemporaryDirectory(prefix="ygslam-wheel-") as name:
        made, repaired, unpacked = (pathlib.Path(name) / part for part in ("made", "repaired", "unpacked"))
        for folder in (repaired, unpacked):
            folder.mkdir()
        final = completed(with_libraries(build(python, made, target), repaired, target), unpacked, target.compiler)
        return pathlib.Path(shutil.copyfile(final, out / final.name))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "dist")
    parser.add_argument("--python", metavar="VERSION", help="make the wheel for this one alone: 3.12")
    parser.add_argument("--arm64", action="store_true", help="for 64-bit ARM, with Debian's Python there")
    options = parser.parse_args()
    target = HERE
    if options.arm64:
        target, options.python = arm64()
    first: dict[str, Python] = {}
    for python in found():
        if (python.headers or options.arm64) and options.python in (None, python.name):
            first.setdefault(python.wheel_tag, python)
    if not first:
        sys.exit(f"error: no CPython {options.python or '3.10 or newer'} with its headers in the PATH (python3-dev)")
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    for python in first.values():
        wheel = make_wheel(python, out, target)
        print(f"written: {os.path.relpath(wheel)} ({wheel.stat().st_size / 1e6:.0f} MB)", flush=True)


if __name__ == "__main__":
    main()
