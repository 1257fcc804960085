"""The program `ygslam` of the command line, as it lies in the wheel."""
import os
import sys

from ._command import _environment, _program


def main() -> None:
    program = _program()
    os.execve(program, [program, *sys.argv[1:]], _environment())
