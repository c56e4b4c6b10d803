"""The shipped models on one front of accuracy against cost, and the choice of one by name or by a budget of time.

The figures come from `train.json` beside the models: balanced accuracy on the test records, and what a record costs as
a multiple of its bare FFT, both measured by the run that made the models; of the cascade, whose records do not all cost
the same, the mean over records of all classes at one radar. Only the FFT is timed here: a ratio to it carries over to
another machine within a factor of two, as processors differ in how fast their FFT is beside the rest.
"""

import json
import math
import time
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import numpy as np
from bladewing.models import TEACHER
from scipy import fft

from .errors import BadInput

#: Names for places on the front: the cheapest, the cheapest with at least half of the gain in accuracy from the
#: cheapest to the most accurate, and the most accurate.
PLACES = ("fast", "balanced", "best")

#: Factor on a measured time: measured again it is longer by a twentieth at most.
_SCATTER = 1.05

#: Name of the cascade of two models (see `Cascade`), in train.json and where a model is loaded by name.
CASCADE = "cascade"

#: The folder of the shipped models, and the name of the account beside models.
SHIPPED = resources.files("bladewing.models.pretrained")
ACCOUNT = "train.json"

#: Key of the cascade's account in train.json: the names of its two models.
STAGES_KEY = "stages"

#: Costs are measured on RECORDS records at a time, each of PULSES pulses.
RECORDS, PULSES = 64, 2048

#: Key of a model's account in train.json: time of a record from samples to answer over that of its bare FFT [1].
COST_KEY = "cost_ffts"

_ROUNDS = 40


def shipped_account() -> dict[str, Any]:
    """The shipped models and their cascade, name to account in `train.json`; what it holds of others is left out."""
    told = json.loads(SHIPPED.joinpath(ACCOUNT).read_text(encoding="utf-8"))
    accounts = told["models"] | ({CASCADE: told[CASCADE]} if told.get(CASCADE) else {})
    return {
        name: account
        for name, account in accounts.items()
        if all(SHIPPED.joinpath(f"{part}.onnx").is_file() for part in account.get(STAGES_KEY, [name]))
    }


def non_dominated(costs: Sequence[float], values: Sequence[float]) -> list[bool]:
    """Which points no other point beats, being as cheap and as good, and better in at least one of the two.

    Parameters
    ----------
    costs, values : sequence of float
        Lower costs and higher values are better; equal lengths.

    Returns
    -------
    list of bool
        True for the points of the front; equal points stand or fall together.
    """
    points = list(zip(costs, values, strict=True))
    return [not any(c <= cost and v >= value and (c < cost or v > value) for c, v in points) for cost, value in points]


def front(account: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, float]]:
    """Names and costs of the models that no other beats (see `non_dominated`), cheapest first.

    The teacher, which is not shipped, is none of them.

    Raises
    ------
    BadInput
        The account holds no costs.
    """
    account = {name: model for name, model in account.items() if name != TEACHER}
    if not account or any(COST_KEY not in model for model in account.values()):
        raise BadInput(f"the shipped train.json holds no {COST_KEY!r}: name a model, or train the models again")
    costs = [float(model[COST_KEY]) for model in account.values()]
    kept = non_dominated(costs, [model["test"]["balanced_accuracy"] for model in account.values()])
    return sorted(
        ((name, cost) for name, cost, keep in zip(account, costs, kept, strict=True) if keep), key=lambda m: m[1]
    )


def by_place(place: str, account: Mapping[str, Mapping[str, Any]]) -> str:
    """Name of the model at one of `PLACES`; never the cascade, as prediction sets and exports are of one model."""
    models = front({name: model for name, model in account.items() if name != CASCADE})
    names = [name for name, _ in models]
    accuracy = [float(account[name]["test"]["balanced_accuracy"]) for name in names]
    halfway = next(name for name, value in zip(names, accuracy, strict=True) if 2 * value >= accuracy[0] + accuracy[-1])
    return {"fast": names[0], "balanced": halfway, "best": names[-1]}[place]


def by_budget(budget_us: float, account: Mapping[str, Mapping[str, Any]], fft_us: float) -> str:
    """Name of the most accurate model that keeps to a budget.

    Parameters
    ----------
    budget_us
        Time for a record [us], above 0.
    account
        Name to account, as in train.json.
    fft_us
        Time of the bare FFT of a record on this machine [us].

    Raises
    ------
    BadInput
        No model is that cheap; says what the cheapest one takes.
    """
    models = front(account)
    affordable = [name for name, cost in models if cost * fft_us <= budget_us]
    if not affordable:
        name, cost = models[0]
        raise BadInput(
            f"budget {budget_us:g} us: the cheapest model, {name}, takes {cost * fft_us:.0f} us here for a record of "
            f"{PULSES} pulses in batches of {RECORDS}: allow {math.ceil(_SCATTER * cost * fft_us)}"
        )
    return affordable[-1]


def measured_fft_us() -> float:
    """Time of a record's bare FFT in a batch on this machine [us]: the shortest of `_ROUNDS` rounds."""
    iq = np.random.default_rng(0).standard_normal((RECORDS, 2 * PULSES), np.float32).view(np.complex64)
    taken = []
    for _ in range(_ROUNDS):
        start = time.perf_counter()
        fft.fft(iq)
        taken.append(time.perf_counter() - start)
    return min(taken) / RECORDS * 1e6
