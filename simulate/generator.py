"""From a seed and a key to a random generator: the only source of randomness."""

from numpy.random import Generator, Philox, SeedSequence


def generator(seed: int, *key: int) -> Generator:
    """Make the generator of a seed and a key; another key gives a stream that shares nothing with it.

    Parameters
    ----------
    seed : int
        Root of all randomness, >= 0.
    key : int
        Whole numbers >= 0; none gives the seed's own stream.
    """
    return Generator(Philox(SeedSequence(seed, spawn_key=key)))
