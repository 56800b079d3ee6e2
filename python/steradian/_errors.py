"""Exceptions. Their messages are those of the command line, with settings in place of options."""


class SteradianError(Exception):
    """Any error of the renderer."""


class UsageError(SteradianError, ValueError):
    """A call is impossible."""


class SettingError(UsageError):
    """A setting of a render is impossible, or unsupported beside another."""


class SceneError(SteradianError, ValueError):
    """The scene, or a file that it names, is malformed or makes no sense."""


class MissingFileError(SteradianError, FileNotFoundError):
    """A file does not exist or cannot be read."""


class OutputError(SteradianError, OSError):
    """A file cannot be written."""


class CheckpointError(SteradianError, ValueError):
    """A checkpoint is damaged, or belongs to another render."""


class OutOfMemoryError(SteradianError, MemoryError):
    """Memory ran out, or no more threads can be started."""


class InternalError(SteradianError, RuntimeError):
    """Anything else."""
