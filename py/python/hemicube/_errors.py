"""What goes wrong, by class. The messages say what is wrong, where, and what helps."""


class Error(Exception):
    """Anything that hemicube raises; by itself, work that failed or did not converge."""


class InputError(Error, ValueError):
    """What was given makes no sense: a shape, a number, or options that do not suit the model."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class OutOfMemory(Error, MemoryError):
    """Work that would take more memory than there is, or than `memory=` allows."""


class ModelWarning(UserWarning):
    """Something doubtful about a model or a result."""


for _class in (Error, InputError, FileError, OutOfMemory, ModelWarning):
    _class.__module__ = "hemicube"
