"""Readers of cameras' own recordings, and the MCAP they become: see tools/convert_recording.py."""


class Fault(Exception):
    """What is wrong with a recording, in one line without its name."""
