#!/usr/bin/env python3
"""Wheels in dist/ that install without a compiler: Debian's libraries are put into them, with their licences.

    .venv/bin/python tools/wheel.py                          (`make wheel`)
    .venv/bin/python tools/wheel.py --python 3.12            the one for that alone

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


def call(*command, **how) -> str:
    """What it prints; its own words and a clear end where it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False, **how)
    if done.returncode:
        sys.exit(f"error: {' '.join(map(str, command[:4]))} ...: {(done.stderr or done.stdout).strip()[-2000:]}")
    return done.stdout


def with_libraries(wheel: pathlib.Path, folder: pathlib.Path) -> pathlib.Path:
    """The wheel that brings its libraries along; its tag says from which glibc on it runs."""
    tools = {**os.environ, "PATH": f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"}
    exclusions = [word for name in NOT_OURS for word in ("--exclude", name)]
    call(sys.executable, "-m", "auditwheel", "repair", *exclusions, "-w", folder, wheel, env=tools)
    repaired, = folder.glob("*.whl")
    return repaired


def source_package(library: pathlib.Path) -> str:
    """Debian's package that a library put into the wheel (name-HASH.so.N) came from."""
    name, _, version = library.name.partition(".so")
    stem = name.rpartition("-")[0]
    owners = call("dpkg", "-S", f"*/{stem}.so{version}").splitlines()
    return owners[0].split(":")[0]


def replace_glx(libraries: pathlib.Path, folder: pathlib.Path) -> None:
    """Puts NO_GLX in the place of GLX and leaves out what only GLX needs."""
    source = folder / "no_glx.c"
    source.write_text(NO_GLX, encoding="utf-8")
    for glx in libraries.glob("libGLX-*"):
        call("cc", "-shared", "-fPIC", "-O1", "-s", f"-Wl,-soname,{glx.name}", source, "-o", glx)
    for dispatch in libraries.glob("libGLdispatch-*"):
        dispatch.unlink()


def add_licences(unpacked: pathlib.Path) -> None:
    """Puts the copyright file of every package whose library is in the wheel beside our licence."""
    licences = next(unpacked.glob("*.dist-info")) / "licenses"
    libraries = [path for path in (unpacked / "ygslam.libs").iterdir() if not path.name.startswith("libGLX-")]
    for package in sorted({source_package(path) for path in libraries}):
        shutil.copyfile(f"/usr/share/doc/{package}/copyright", licences / f"{package}.copyright")


def completed(wheel: pathlib.Path, folder: pathlib.Path) -> pathlib.Path:
    """The repaired wheel, for systems without a display, with all licences."""
    call(sys.executable, "-m", "wheel", "unpack", "-d", folder, wheel)
    unpacked = next(path for path in folder.iterdir() if path.is_dir())
    replace_glx(unpacked / "ygslam.libs", folder)
    add_licences(unpacked)
    packed = folder / "packed"
    packed.mkdir()
    call(sys.executable, "-m", "wheel", "pack", "-d", packed, unpacked)
    final, = packed.glob("*.whl")
    return final


def make_wheel(python: Python, out: pathlib.Path) -> pathlib.Path:
    with tempfile.TemporaryDirectory(prefix="ygslam-wheel-") as name:
        made, repaired, unpacked = (pathlib.Path(name) / part for part in ("made", "repaired", "unpacked"))
        for folder in (repaired, unpacked):
            folder.mkdir()
        # One build folder for all: ccache knows what does not depend on the Python.
        call(sys.executable, "-m", "pip", "--python", python.program, "wheel", "--no-deps", "-w", made,
             f"--config-settings=build-dir={ROOT / 'build' / 'wheel'}", ROOT)
        own, = made.glob("*.whl")
        final = completed(with_libraries(own, repaired), unpacked)
        return pathlib.Path(shutil.copyfile(final, out / final.name))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "dist")
    parser.add_argument("--python", metavar="VERSION", help="make the wheel for this one alone: 3.12")
    options = parser.parse_args()
    first: dict[str, Python] = {}
    for python in found():
        if python.headers and options.python in (None, python.name):
            first.setdefault(python.wheel_tag, python)
    if not first:
        sys.exit(f"error: no CPython {options.python or '3.10 or newer'} with its headers in the PATH (python3-dev)")
    out = options.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    for python in first.values():
        wheel = make_wheel(python, out)
        print(f"written: {os.path.relpath(wheel)} ({wheel.stat().st_size / 1e6:.0f} MB)", flush=True)


if __name__ == "__main__":
    main()
