"""Why a line family is no rotor's, or gives no values."""

from typing import TYPE_CHECKING

from ..reasons import SHORT_DWELL
from .comb import LEAST_REACH_MPS, OVER_BODY, is_short, low_prf_reason
from .comb_fit import CombFit
from .past_edge import unseen_tip_reason
from .periodogram import Periodogram

if TYPE_CHECKING:
    from .family import Family

#: In a short dwell, unresolved rotors show their mean rate only with more than LEAST_FLASHES flashes or MANY_ORDERS
#: orders.
LEAST_FLASHES, MANY_ORDERS = 5.5, 60

#: Edges between these shares of the body's speed are a wheel's: spokes end a little within the rim.
WHEEL = (0.8, OVER_BODY)


def slow_rotor_reason(data: Periodogram, fit: CombFit, edge: float, edge_std: float) -> str:
    """Why a comb of this edge [cycles a sample] is too slow for a rotor; empty where it may be a rotor's."""
    edge_mps, edge_std_mps = (value * data.span_mps for value in (edge, edge_std))
    if not edge_mps + edge_std_mps < LEAST_REACH_MPS:
        return ""
    reason = f"no rotor: the band ends at {edge_mps:.1f} m/s, below {LEAST_REACH_MPS:.0f} m/s"
    return low_prf_reason(data) or unseen_tip_reason(data, fit, edge, edge_std) or reason


def wheel_reason(data: Periodogram, edge: float, velocity_mps: float) -> str:
    """Why a line family of this edge [cycles a sample] about a body is a wheel's; empty where it may be a rotor's.

    Seen from the body a wheel's rim is as fast as the body. A rotor's tips are 2.5 times as fast as it flies and more;
    only those of a propeller that flies at the radar, within a narrow range of angles, appear to be as slow.
    """
    edge_mps = edge * data.span_mps
    if WHEEL[0] * abs(velocity_mps) < edge_mps < WHEEL[1] * abs(velocity_mps):
        return f"no rotor: lines as wheels have: they end {edge_mps:.1f} m/s from a body at {velocity_mps:.1f} m/s"
    return ""


def short_dwell_reason(family: "Family") -> str:
    """Why unresolved rotors give no values in so short a dwell; empty where they do.

    Their lines, a few bins apart, run into one another, and what results may be strong at any spacing.
    """
    data, chopping = family.data, family.comb.chopping
    shows = chopping * data.pulses > LEAST_FLASHES or family.comb.last > MANY_ORDERS
    if family.is_resolved or shows or not is_short(data):
        return ""
    return (
        f"{SHORT_DWELL}: lines about {chopping * data.prf_hz:.0f} Hz apart are not one rotor's, "
        f"to tell what they are takes {1e3 * LEAST_FLASHES / chopping / data.prf_hz:.0f} ms at least"
    )
