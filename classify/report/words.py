"""How the page writes numbers."""

from __future__ import annotations

from collections.abc import Sequence

MINUS = "\u2212"
# A number and its unit stay on one line.
NBSP = "\u00a0"


def percent(value: float | None) -> str:
    """Write a share: "93.4 %", or a dash where there is none."""
    return "–" if value is None else f"{100 * value:.1f}{NBSP}%"


def number(value: float) -> str:
    """Write a number with three significant digits and a true minus sign."""
    value = three_digits(value)
    text = f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    return text.replace("-", MINUS)


def three_digits(value: float) -> float:
    """Round to the three significant digits that are shown, so that the unit fits the rounded value."""
    return float(f"{value:.3g}")


def count(value: int) -> str:
    """Write a whole number in full; from five digits on, with a space between the thousands."""
    return f"{value:,}".replace(",", "\u202f") if abs(value) >= 10_000 else str(value)


def limits(values: Sequence[float]) -> str:
    """Write the range of some probability thresholds [%]; a threshold above 1 is never reached: "never"."""
    low, high = (f"{100 * value:.0f}" if value <= 1 else "never" for value in (min(values), max(values)))
    return low if low == high else f"{low}\u2013{high}"


def micros(value: float) -> str:
    """Write a time [us] in microseconds, or in milliseconds from 1000 us on."""
    return f"{number(value)}{NBSP}µs" if three_digits(value) < 1000 else f"{number(value / 1000)}{NBSP}ms"


def size(value: float) -> str:
    """Write a number of bytes, in powers of 1000."""
    for unit in ("B", "kB", "MB"):
        if three_digits(value) < 1000:
            return f"{number(value)}{NBSP}{unit}"
        value /= 1000
    return f"{number(value)}{NBSP}GB"


def spoken(name: str) -> str:
    """Write a name from the code as words: spaces for underscores."""
    return name.replace("_", " ")


def batch_words(batch: int) -> str:
    """Name a batch size."""
    return "one record at a time" if batch == 1 else f"batches of {batch}"


def millis(value_s: float) -> str:
    """Write a dwell [s] in milliseconds."""
    return f"{number(1e3 * value_s)}{NBSP}ms"


def large(value: float) -> str:
    """Write a large count with the prefix k, M or G."""
    for prefix in ("", "k", "M"):
        if three_digits(value) < 1000:
            return number(value) + (f"{NBSP}{prefix}" if prefix else "")
        value /= 1000
    return f"{number(value)}{NBSP}G"
