"""One cell of the stability table: a stage, a parameter at one value, the error there, and the guard against it."""

import math
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

#: Result of a measurement: the error, or NaN with the reason why there is no number.
Outcome = float | tuple[float, str]


@dataclass(frozen=True)
class Cell:
    """One cell.

    Parameters
    ----------
    stage, parameter, value : str
        What was computed, which parameter was varied, and its value (with the unit).
    error : float or None
        The error there; None where the stage gives no number.
    measure : str
        The quantity that the error is of, and its unit.
    limit : float
        Largest error allowed.
    guard : str
        What keeps the numbers right at this extreme.
    said : str
        The stage's reason where it gives no number.
    warned : str
        A warning from inside a library, or an exception that is no refusal. The cell holds only if this is empty.
    silent : bool
        Whether a reason instead of a number is allowed here.
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
        """Whether the error is within its limit, or a reason stands where one is allowed; and nothing warned."""
        answered = self.silent and bool(self.said) if self.error is None else self.error <= self.limit
        return answered and not self.warned

    def as_dict(self) -> dict[str, Any]:
        """Give the cell as plain values, ready for JSON."""
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
    """Measure one stage along one parameter; any fault of the stage becomes a cell that does not hold.

    Parameters
    ----------
    stage, parameter, measure, limit, guard
        As in `Cell`.
    values : iterable
        Values of the parameter.
    error_at : callable
        Gives the error at a value. If `guard` holds the word "refused", a ValueError counts as the stage's refusal.
    show : callable
        Gives the value as text, with its unit.
    silent : collection
        Values at which a reason instead of a number is allowed. If `guard` holds the word "refused", the stage must
        give a reason there.
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
            error = None if math.isnan(error) else 1e300  # an infinite error: over any limit, but JSON can hold it
        number = None if error is None else float(error)
        may = value in silent
        yield Cell(stage, parameter, show(value), number, measure, limit, guard, said, warned, may)
