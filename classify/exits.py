"""How a command ends. Exit codes: 0 done, 1 unexpected, 2 bad input, 130 interrupted; errors are one line on stderr."""

import errno
import io
import os
import re
import sys
from collections.abc import Callable
from typing import IO, NoReturn, cast

import typer

from .errors import BadInput, Interrupted, one_line

# The parent of all usage errors has no public name that old and new versions of typer share.
_UsageError = cast(type[Exception], typer.BadParameter.__mro__[1])

# Libraries of the extra "train", by module and by package: the account of a training asks for versions of packages.
_TRAIN_EXTRA = {"torch", "sklearn", "scikit-learn", "onnx", "onnxscript", "skl2onnx", "matplotlib", "jinja2", "mpmath"}
# A disk that is full, read-only or out of bounds is the user's to mend, and so is an output that is closed.
_DISK_ERRORS = {
    errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM, errno.EFBIG, errno.ENOTDIR, errno.EISDIR,
    errno.EEXIST, errno.ENAMETOOLONG, errno.ENOENT, errno.EBADF,
}  # fmt: skip
_TRACEBACK = "BLADEWING_TRACEBACK"
# Most characters shown of an unexpected error: the text of some libraries' errors holds whole models.
_MOST_SAID = 300
_NUMBERS = {"int_parsing": "be a whole number", "float_parsing": "be a number"}


class _Closed(io.TextIOBase):
    """Stands for a closed standard output: printing to it is an error, as on a full disk, as answers would be lost."""

    def __init__(self, place: IO[str]) -> None:
        self.place = place  # keeps its file descriptor taken

    def write(self, text: str) -> NoReturn:
        raise OSError(errno.EBADF, "it is closed")


def mend_streams() -> None:
    """Replace standard streams that are closed, and escape characters that a stream's encoding cannot hold."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller: no file opened later may get its descriptor
            place = open(os.devnull, "w")  # noqa: SIM115
            setattr(sys, name, _Closed(place) if name == "stdout" else place)
        elif isinstance(getattr(sys, name), io.TextIOWrapper):  # a name its encoding cannot hold is shown escaped
            getattr(sys, name).reconfigure(errors="backslashreplace")


def exit_code(command: Callable[[], object]) -> int:
    """Run a command; an error becomes one line on stderr and the exit code that stands for it.

    Parameters
    ----------
    command
        Returns its exit code; anything but a whole number counts as 0.
    """
    try:
        code = command()
        if code == 130:  # typer's code for an interrupt
            raise KeyboardInterrupt
        return code if isinstance(code, int) else 0
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted", kind="stopped")
        return 130
    except Interrupted as stop:
        complain(f"interrupted: {stop}", kind="stopped")
        return 130
    except BadInput as error:
        complain(str(error))
        return 2
    except _UsageError as error:
        return _usage(error)
    except ModuleNotFoundError as error:
        if error.name not in _TRAIN_EXTRA or _was_interrupted(error):
            return _unexpected(error)
        cure = "pip install -c constraints.txt '.[train]' where bladewing's source lies"
        complain(f"{error.name} is not installed, this command needs it: {cure}")
        return 2
    except MemoryError:
        complain("more memory is needed than there is: give less at once (a shorter recording, fewer records)")
        return 2
    except OSError as error:
        if error.errno not in _DISK_ERRORS:
            return _unexpected(error)
        name, cure = error.filename, "make room or give another place; what stood there is unchanged"
        if not name and _output_is_full():
            name, cure = "standard output", "what was to be printed is lost; files are written whole or not"
        complain(f"{f'{name}: ' if name else ''}{error.strerror}: {cure}")
        return 2
    except Exception as error:
        return _unexpected(error)


def complain(message: str, kind: str = "error") -> None:
    """Say in one line on stderr what is wrong."""
    print(f"bladewing: {kind}: {one_line(message)}", file=sys.stderr, flush=True)


def _output_is_full() -> bool:
    """Whether nothing more can be printed."""
    try:
        print(flush=True)
    except OSError:
        return True
    return False


def _usage(error: Exception) -> int:
    message = getattr(error, "format_message", lambda: str(error))()
    # typer parses numbers with pydantic, whose error holds the value
    wrong: list[dict] = getattr(error.__cause__ or error.__context__, "errors", list)()
    if wrong:
        name = getattr(error, "param").opts[0]  # noqa: B009 - the class of the error has no public name
        rule = _NUMBERS.get(wrong[0]["type"], wrong[0]["msg"].removeprefix("Input should "))
        message = f"{name} is {wrong[0]['input']!r}: it must {rule}"
    message = " ".join(message.split())
    if re.match("No such option: -[^-]", message):  # the only one-letter option is -h: a file name is meant
        message += ": a name that begins with - is given after --, as in -- -name.npy"
    context = getattr(error, "ctx", None)  # unknown where an option lacks its value
    command = f"{context.command_path} " if context is not None else ""
    complain(f"{message} (see {command}--help)")
    return 2


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether an interrupt caused an exception: libraries that are loading turn it into other exceptions."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        if isinstance(error, KeyboardInterrupt):
            return True
        seen.add(id(error))
        error = error.__cause__ or error.__context__
    return False


def _unexpected(error: Exception) -> int:
    if _was_interrupted(error):
        complain("interrupted", kind="stopped")
        return 130
    if os.environ.get(_TRACEBACK):
        import traceback

        traceback.print_exc()
    said = str(error)
    said = said if len(said) <= _MOST_SAID else f"{said[:_MOST_SAID]}..."
    complain(f"unexpected {type(error).__name__}: {said} (set {_TRACEBACK}=1 to see where)")
    return 1
