"""Writes a report: every file whole or not at all, the page last; files of an earlier report that
are not made any more go."""
import os
import pathlib
import tempfile

LIST = "files.txt"  # what the last report wrote, so that the next one can tidy up


class OutputError(Exception):
    """One line that names the file and its fault."""


class Writer:
    """Collects files (relative path -> bytes or text) and lays them down at the end."""

    def __init__(self, out):
        self.out = pathlib.Path(out)
        self.files = {}

    def add(self, name, content):
        self.files[name] = (content.encode("utf-8", "replace")  # JSON may hold half a character
                            if isinstance(content, str) else content)

    def commit(self):
        """@raise OutputError."""
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            earlier = self.earlier()
            names = sorted(self.files, key=lambda name: name == "index.html")
            for name in names:
                self.replace(name, self.files[name])
            self.replace(LIST, "".join(f"{name}\n" for name in names).encode("utf-8"))
            for name in earlier - set(names):
                (self.out / name).unlink(missing_ok=True)
        except OSError as error:
            where = error.filename or self.out
            raise OutputError(f"{where}: {error.strerror}") from None

    def earlier(self):
        path = self.out / LIST
        if not path.exists():
            return set()
        names = path.read_text(encoding="utf-8", errors="replace").splitlines()
        return {n for n in names
                if n and not pathlib.PurePath(n).is_absolute() and ".." not in n.split("/")}

    def replace(self, name, content):
        target = self.out / name
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=".writing-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(temporary, 0o644)
            os.replace(temporary, target)
        except BaseException:
            pathlib.Path(temporary).unlink(missing_ok=True)
            raise
