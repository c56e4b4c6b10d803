"""The table beside other classifiers: what it trains ours on is what a training gathers."""

import numpy as np
from bladewing.classify.labels import CLASSES
from bladewing.classify.train_network import kinds_of
from bladewing.features.schema import INPUT_SHAPES
from bladewing.models import LADDER
from bladewing.simulate.dataset import KIND_CLASS

from ..benchmarks.baselines import BASELINES
from ..benchmarks.baselines_table import OURS, gathered


def test_networks_find_their_inputs_and_kinds_and_the_others_theirs():
    ours, theirs = gathered("bench", 48)
    kinds = list(KIND_CLASS)
    assert [CLASSES.index(KIND_CLASS[kinds[place]]) for place in kinds_of(ours)] == ours.labels.tolist()
    for name in {name for model in OURS for name in LADDER[model].inputs}:
        assert ours.inputs[name].shape == (48, *INPUT_SHAPES[name])
    assert theirs.keys() == BASELINES.keys()
    assert all(len(rows) == 48 and np.isfinite(rows).all() for rows in theirs.values())
