"""How the memory of arrays that are freed is kept for the next ones."""

from functools import lru_cache

import numpy as np

#: More than the largest arrays of a record, or of a block of them [bytes].
KEPT_BYTES = 1 << 24


@lru_cache(maxsize=1)
def keep_freed() -> None:
    """Have the C library keep what is freed, up to twice `KEPT_BYTES`, instead of giving it back at each call.

    glibc maps arrays of 128 kB and more anew each time, and the system clears every page of them, until it has seen
    one freed that is larger: from then on it keeps what is smaller than that. One array is enough, and none of its
    pages is touched. Fits of several combs take an eighth less time so, answers in batches a twentieth. Other C
    libraries are left as they are.
    """
    np.empty(KEPT_BYTES, np.uint8)
