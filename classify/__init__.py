"""Recordings, inference, training, report and the command line: composes simulate, features and models.

Importing this package loads nothing heavy; each of its public names is imported on first use.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .errors import BadInput

if TYPE_CHECKING:
    from .inference import Classifier
    from .predict import answer
    from .recording import Recording, load_recording
    from .track import fuse

__all__ = ["BadInput", "Classifier", "Recording", "answer", "fuse", "load_recording"]

_WHERE = {
    "Classifier": ".inference",
    "Recording": ".recording",
    "answer": ".predict",
    "fuse": ".track",
    "load_recording": ".recording",
}


def __dir__() -> list[str]:
    return sorted({*globals(), *_WHERE})


def __getattr__(name: str) -> object:
    if name in _WHERE:
        return getattr(import_module(_WHERE[name], __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
