_core\.__suffix__$:
    __version__: str

    class Error(RuntimeError):
        """What went wrong in one line."""

        code: int

    class UsageError(Error):
        """Wrong use; `code` is 2."""

    class ConfigError(Error):
        """Settings or camera; `code` is 3."""

    class InputError(Error):
        """A recording, or a frame of it; `code` is 4."""

    class ModelError(Error):
        """The network; `code` is 5."""

    class MapError(Error):
        """A saved map; `code` is 6."""

    class OutputError(Error):
        """What could not be written; `code` is 9."""
