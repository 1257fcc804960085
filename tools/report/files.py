"""Text files of unknown origin; a fault is an InputError that names the file."""
import json
import pathlib


class InputError(Exception):
    """One line that names the file and its fault."""


def read_text(path):
    """A text file as a whole. @raise InputError naming file and fault."""
    path = pathlib.Path(path)
    try:
        if path.exists() and not path.is_file():  # a pipe could be waited for without end
            raise InputError(f"{path}: not a regular file")
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not text (byte {error.start})") from None
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from None


def read_json(path):
    """The object in a JSON file. @raise InputError naming file and fault."""
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not JSON ({str(error).splitlines()[0]})") from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: not a JSON object")
    return data
