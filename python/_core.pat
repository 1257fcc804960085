__suffix__:
    class Error(RuntimeError):
        """What went wrong in one line."""

        code: int
