"""What `bladewing measure` says: a table with error bars, one line a dwell, and one line of summary in words."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from bladewing.features.measurements import BODY
from bladewing.features.rotor.comb import OVER_BODY
from bladewing.features.rotor.comb_search import spacing_limits
from bladewing.features.spectrum import SPEED_OF_LIGHT_MPS

from .errors import one_line
from .measured import is_helicopter
from .terminal import counted, print_table, print_words

if TYPE_CHECKING:
    from rich.console import Console

    from .measured import Measured

#: If the velocities of the dwells range over more than this, the range is given in place of one velocity [m/s].
UNSTEADY_MPS = 1.0


def print_measured(found: "Measured", console: "Console") -> None:
    """Write a table, one line a dwell, and the line of the recording."""
    from rich.table import Table
    from rich.text import Text

    v = found.values
    body_mps = found.body_mps
    heads = ("start s", "body m/s", "chopping Hz", "rotors", "band Hz", "tip m/s")
    table = Table(*heads, box=None, pad_edge=False)
    for column in table.columns:
        column.justify, column.no_wrap = "right", True
    console.print(Text(one_line(found.recording.name), style="bold"), soft_wrap=True)
    silent: dict[str, list[str]] = {}
    for n in range(len(found.iq)):
        reason = str(v.reason[n])
        if reason:
            silent.setdefault(reason.split(":")[0], []).append(reason)
            continue
        count = f"{v.rotor_count[n]:.0f}" if v.rotors_resolved[n] else f">={v.rotor_count[n]:.0f}"
        table.add_row(
            f"{found.start_s[n]:.3f}",
            with_error(body_mps[n], v.body_velocity_mps_std[n]),
            _rate_with_error(v.chopping_hz[n], v.chopping_hz_std[n]),
            count,
            with_error(v.bandwidth_hz[n], v.bandwidth_hz_std[n]),
            with_error(v.tip_speed_mps[n], v.tip_speed_mps_std[n]),
        )
    if table.row_count:
        print_table(console, table)
    for short, reasons in silent.items():
        detail = reasons[0][len(short) + 1 :].strip()
        detail = detail and f"{': ' if len(set(reasons)) == 1 else ', e.g. '}{detail}"
        print_words(console, Text(f"{counted(len(reasons))}: {short}{detail}"))
    for sentence in (*found.remarks, _sentence(found), _beat(found)):
        if sentence:
            print_words(console, Text(sentence))


def _sentence(found: "Measured") -> str:
    """The recording in one line: the answer an engineer wants."""
    all_together = found.together()
    body = _body(found, all_together)
    if not all_together["with_comb"]:
        return f"{_none(found)}{body}"
    where = f"comb in {all_together['with_comb']} of {counted(all_together['dwells'])}"
    if not found.has_rotor:
        where += ", perhaps by chance"
    if all_together["reason"]:
        return f"{where}; {all_together['reason']}{body}{_wheel(found)}"
    gear = _gear(found)
    clear = found.clearest()
    v = found.values
    rates = v.rotor_rates_hz[clear]
    rates = rates[np.isfinite(rates)]
    turns = v.chopping_hz[clear] / v.rotation_hz[clear]
    bound = "at least " if v.length_is_lower_bound else ""
    if np.isfinite(turns):
        rpm = ", ".join(f"{60 * rate / turns:.0f}" for rate in rates)
        error_cm = 100 * v.blade_length_m_std[clear]
        blade = f", blade {bound}{with_error(100 * v.blade_length_m[clear], error_cm)} cm"
        more = "" if v.rotors_resolved[clear] else " and perhaps more"
        rotor = f"{turns:.0f}-blade rotors at {rpm} rpm{more}{'' if np.isnan(error_cm) else blade}"
    else:
        options = (
            f"{c['blades']} x {c['rpm']:.0f} rpm"
            + ("" if np.isnan(c["blade_length_m"]) else f" ({bound}{100 * c['blade_length_m']:.1f} cm)")
            for c in v.alternatives((clear,))[:4]
        )
        rotor = "blades x rate: " + " or ".join(options)
        rotor += _blades(found)
    folded = str(v.band_reason[clear])
    return f"{where}; {rotor}{body}{gear}{_wheel(found)}{_unlike(found)}{folded and '; ' + folded}"


def _none(found: "Measured") -> str:
    """Words for no rotor: the slowest that would have been seen, and in how many dwells any could have been seen."""
    dwells = len(found.iq)
    if not found.looked_at:
        return "whether there is a rotor cannot be told"
    slowest_hz = spacing_limits(found.iq.shape[-1], found.recording.prf_hz)[0] * found.recording.prf_hz
    rotor = f"no rotor that chops at {slowest_hz:.0f} Hz or more in"
    if found.looked_at < dwells:
        return f"{rotor} {found.looked_at} of {counted(dwells)}, whether in the others cannot be told"
    return f"{rotor} {counted(dwells)}"


def _body(found: "Measured", all_together: Mapping[str, Any]) -> str:
    """How fast the body is: its median velocity or, where the dwells differ (`UNSTEADY_MPS`), their range; or ""."""
    velocity_mps, std_mps = (all_together[name] for name in BODY)
    slowest, fastest = all_together["body_velocity_range_mps"] or (0.0, 0.0)
    sign = "+" if found.direction_known else ""
    if fastest - slowest > UNSTEADY_MPS:
        return f"; body {slowest:{sign}.2f} to {fastest:{sign}.2f} m/s"
    return "" if velocity_mps is None else f"; body {signed(velocity_mps, std_mps, sign)} m/s"


def _blades(found: "Measured") -> str:
    """How many dwells tell the number of blades, where the clearest does not; or ""."""
    turns = found.values.chopping_hz / found.values.rotation_hz
    told = np.rint(turns[np.isfinite(turns)]).astype(int)
    if not len(told):
        return ""
    number = int(np.bincount(told).argmax())
    return f"; {number} blade{'s' * (number > 1)} in {np.count_nonzero(told == number)} of {counted(len(turns))}"


def _unlike(found: "Measured") -> str:
    """Words of caution where most dwells count another number of rotors than the clearest, whose rates are named."""
    v, named = found.values, found.clearest()
    held = np.isfinite(v.chopping_hz)
    # the number of unresolved rotors is a lower bound: it confirms no other dwell's number
    counts, dwells = np.unique(np.where(v.rotors_resolved, v.rotor_count, np.inf)[held], return_counts=True)
    alike = dwells[counts == v.rotor_count[named]].sum()
    if not v.rotors_resolved[named] or 2 * alike >= dwells.sum():
        return ""
    told = (
        f"{count:.0f} in {n}" if count < np.inf else f"not told apart in {n}"
        for count, n in zip(counts, dwells, strict=True)
    )
    return f"; the dwells do not agree on the number of rotors: {', '.join(told)}"


def _wheel(found: "Measured") -> str:
    """Words of caution where most combs reach no further from the body than `OVER_BODY` times its speed; or ""."""
    v = found.values
    held = np.isfinite(v.chopping_hz)
    edge_mps = v.bandwidth_hz[held] * SPEED_OF_LIGHT_MPS / found.recording.carrier_hz / 4
    is_wheel = edge_mps <= OVER_BODY * np.abs(v.body_velocity_mps[held])
    return "; perhaps a wheel: the lines reach no further than the body moves" if is_wheel.mean() > 0.5 else ""


def _gear(found: "Measured") -> str:
    """A helicopter's main and tail comb and their ratio in words, of the dwell with the smallest error; or ""."""
    v = found.values
    if not is_helicopter(v):
        return ""
    geared = np.isfinite(v.gear_ratio)
    n = int(np.nanargmin(v.gear_ratio_std))
    main, tail, ratio = (
        with_error(getattr(v, name)[n], getattr(v, f"{name}_std")[n])
        for name in ("main_chopping_hz", "tail_chopping_hz", "gear_ratio")
    )
    return (
        f"; helicopter in {geared.sum()} of {counted(len(geared))}: chopping main {main} Hz, tail {tail} Hz, "
        f"ratio {ratio} : 1 (the gear's where both have as many blades)"
    )


def _beat(found: "Measured") -> str:
    """Wingbeat and acceleration in one line; empty where there is no wingbeat."""
    course = found.over_all()
    if course.get("wingbeat_hz") is None:
        return ""
    beat = with_error(course["wingbeat_hz"], course["wingbeat_hz_std"])
    pull = with_error(course["acceleration_mps2"], course["acceleration_mps2_std"])
    return f"wingbeat {beat} Hz; body acceleration {pull} m/s^2"


def with_error(value: float, std: float) -> str:
    """A value and its standard deviation, to the deviation's second digit.

    Examples
    --------
    >>> with_error(116.6671, 0.0123)
    '116.667 +- 0.012'
    >>> with_error(7220.4, 61.2)
    '7220 +- 61'
    >>> with_error(6.1, 1e-7)
    '6.10000 +- <0.00001'
    """
    if not (math.isfinite(value) and math.isfinite(std)):
        return "-"
    if std < 5e-6:
        return f"{value:.5f} +- <0.00001"
    digits = 0 if std >= 9.5 else min(5, 1 - math.floor(math.log10(std)))
    return f"{value:.{digits}f} +- {std:.{digits}f}"


def _rate_with_error(value: float, std: float) -> str:
    """`with_error` of a rate; if its standard deviation is larger than the rate, that is only a lower bound.

    Examples
    --------
    >>> _rate_with_error(190.4, 219.9)
    '>=190.4'
    """
    return f">={value:.4g}" if std > value else with_error(value, std)


def signed(velocity_mps: float, std_mps: float, sign: str = "+") -> str:
    """A velocity with its sign and its standard deviation, to the hundredth where it is known to 1 m/s.

    With `sign` "" a velocity that is not below 0 has no sign.

    Examples
    --------
    >>> signed(-0.0001, 0.0002)
    '+0.00 +- 0.01'
    >>> signed(-98.5, 84.7)
    '-98 +- 85'
    """
    if std_mps >= 1:
        return with_error(velocity_mps, std_mps)
    return f"{round(velocity_mps, 2) + 0.0:{sign}.2f} +- {max(std_mps, 0.01):.2f}"  # not -0.00
