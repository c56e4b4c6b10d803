"""One cell of the stability table: a stage, a parameter at a value, the error there, and the guard that acts."""

import math
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

#: What a measurement gives: the error, or NaN with the reason why there is no number.
Outcome = float | tuple[float, str]


@dataclass(frozen=True)
class Cell:
    """One cell.

    Parameters
    ----------
    stage, parameter, value : str
        What was computed, what was moved, and where to (with its unit).
    error : float or None
        The error there; None where the stage says that there is no number.
    measure : str
        What the error is of, and its unit.
    limit : float
        What the error must not exceed.
    guard : str
        What acts at this extreme.
    said : str
        The stage's reason where there is no number.
    warned : str
        A warning from inside a library, or an exception that is no refusal; there must be none.
    silent : bool
        Whether a reason instead of a number is an answer here.
    """

    stage: str
    parameter: str
    value: str
    error: float | None
    measure: str
    limit: float
    guard: str
    said: str = ""
    warned: str = ""
    silent: bool = False

    @property
    def holds(self) -> bool:
        """Whether the error is within its limit, or there is a reason where it may be; and nothing warned."""
        answered = self.silent and bool(self.said) if self.error is None else self.error <= self.limit
        return answered and not self.warned

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {**self.__dict__, "holds": self.holds}


def sweep(
    stage: str,
    parameter: str,
    values: Iterable[Any],
    measure: str,
    limit: float,
    guard: str,
    error_at: Callable[[Any], Outcome],
    show: Callable[[Any], str] = "{:g}".format,
    *,
    silent: Collection[Any] = (),
) -> Iterator[Cell]:
    """Measure one stage along one parameter; whatever a stage does wrong becomes a cell that does not hold.

    Parameters
    ----------
    stage, parameter, measure, limit, guard
        As in `Cell`.
    values : iterable
        Where the parameter goes.
    error_at : callable
        The error at a value. Where `guard` says that the stage refuses, a ValueError of one line is its word.
    show : callable
        The value as text, with its unit.
    silent : collection
        Values at which a reason instead of a number is an answer; where `guard` says that the stage refuses, the only.
    """
    refuses = "refused" in guard
    for value in values:
        error: float | None = None
        said = warned = ""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                outcome = error_at(value)
                error, said = outcome if isinstance(outcome, tuple) else (outcome, "")
            except Exception as fault:
                line = (str(fault).splitlines() or [""])[0]
                if refuses and isinstance(fault, ValueError):
                    said = f"refused: {line}"
                else:
                    warned = f"{type(fault).__name__}: {line}"
        if refuses and value in silent and not said:
            warned = warned or "not refused"
        if caught and not warned:
            warned = f"{caught[0].category.__name__}: {caught[0].message}"
        if error is not None and not math.isfinite(error):
            error = None if math.isnan(error) else 1e300  # an infinity is no answer
        number = None if error is None else float(error)
        may = value in silent
        yield Cell(stage, parameter, show(value), number, measure, limit, guard, said, warned, may)
