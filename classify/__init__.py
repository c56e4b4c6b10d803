"""Recordings, inference, training, report and the command line: composes simulate, features and models.

Importing this package loads nothing heavy; `Classifier` is fetched when it is first asked for.
"""

from typing import TYPE_CHECKING

from .errors import BadInput

if TYPE_CHECKING:
    from .inference import Classifier

__all__ = ["BadInput", "Classifier"]


def __getattr__(name: str) -> object:
    if name == "Classifier":
        from .inference import Classifier

        return Classifier
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
