"""Uniform slow time in blocks of pulses: precise phases at a cost of a few operations a pulse.

A phase that is quadratic in time is, within a block, a quadratic in the pulse number n about the block's middle. Its
constant and its slope are reduced to within half a turn in float64 (n is whole, so whole turns a pulse do not count).
The slope then adds up to at most `BLOCK_PULSES` / 4 turns, which float32 holds.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .blades import TILE_SAMPLES, Room
from .motion import TWO_PI, reduce_phase
from .radar import Radar

#: Pulses of a block: long enough for the vector units, short enough for float32.
BLOCK_PULSES = 64


#: Number of each pulse from the middle of its block.
_NUMBER = np.arange(-BLOCK_PULSES // 2, BLOCK_PULSES // 2)


@dataclass(frozen=True)
class Tile:
    """Some records and some blocks of pulses, worked on together.

    Parameters
    ----------
    rows : slice
        Records.
    blocks : slice
        Blocks of pulses.
    pulses : slice
        The pulses in those blocks; the last block may hold fewer than it has room for.
    """

    rows: slice
    blocks: slice
    pulses: slice

    @property
    def shape(self) -> tuple[int, int, int]:
        """Records, blocks and room for pulses in each."""
        return self.rows.stop - self.rows.start, self.blocks.stop - self.blocks.start, BLOCK_PULSES

    @property
    def flat(self) -> tuple[int, int]:
        """Records and room for pulses: the same without the blocks."""
        records, blocks, pulses = self.shape
        return records, blocks * pulses


class Sine(NamedTuple):
    """amplitude sin(2 pi rate t + phase); each field of shape (parts, records).

    Parameters
    ----------
    amplitude_rad : ndarray of float64
        Amplitude [rad].
    rate_hz, phase_rad : ndarray of float64
        Rate [Hz] and phase at time 0 [rad].
    """

    amplitude_rad: NDArray[np.float64]
    rate_hz: NDArray[np.float64]
    phase_rad: NDArray[np.float64]


@dataclass(frozen=True)
class PhaseLaw:
    """How phases grow: start + 2 pi (f t + f' t^2 / 2) + sine; each field of shape (parts, records).

    Parameters
    ----------
    start_rad, rate_hz, rate_change_hz_per_s : ndarray of float64
        Phase [rad] and rate [Hz] at time 0, and change of the rate [Hz/s].
    sine : Sine, optional
        What is added.
    """

    start_rad: NDArray[np.float64]
    rate_hz: NDArray[np.float64]
    rate_change_hz_per_s: NDArray[np.float64]
    sine: Sine | None = None


@dataclass(frozen=True)
class PulseGrid:
    """A radar's instants in blocks of `BLOCK_PULSES`.

    Parameters
    ----------
    radar : Radar
        The radar that looks.
    """

    radar: Radar

    @cached_property
    def _middles_s(self) -> NDArray[np.float64]:
        """Instant of each block's middle [s], shape (blocks,)."""
        blocks = -(-self.radar.pulses // BLOCK_PULSES)
        return np.arange(0.5, blocks, dtype=np.float64) * (BLOCK_PULSES / self.radar.prf_hz)

    def tiles(self, records: int) -> Iterator[Tile]:
        """Cut a batch into tiles of about `TILE_SAMPLES`."""
        pulses, blocks = self.radar.pulses, len(self._middles_s)
        high = max(1, TILE_SAMPLES // (blocks * BLOCK_PULSES))
        wide = min(blocks, TILE_SAMPLES // BLOCK_PULSES)
        for row in range(0, records, high):
            for block in range(0, blocks, wide):
                stop = min(block + wide, blocks)
                yield Tile(
                    slice(row, min(row + high, records)),
                    slice(block, stop),
                    slice(block * BLOCK_PULSES, min(stop * BLOCK_PULSES, pulses)),
                )

    def phase(self, tile: Tile, law: PhaseLaw, room: Room) -> NDArray[np.float32]:
        """Phase of each pulse, up to whole turns.

        It is a sum of a few terms, each a product of one factor that depends on the block and one that depends on the
        place in the block: a matrix product in float64.

        Parameters
        ----------
        tile : Tile
            Which records and pulses.
        law : PhaseLaw
            How the phases grow.
        room : Room
            Scratch memory, of which three times the size of the result is taken.

        Returns
        -------
        ndarray of float32, shape (parts, records of the tile, room for pulses)
            Phase [rad].
        """
        prf_hz, middle = self.radar.prf_hz, self._middles_s[tile.blocks]
        start, f, change = (row[:, tile.rows, None] for row in (law.start_rad, law.rate_hz, law.rate_change_hz_per_s))
        columns = 3 if law.sine is None else 5
        of_block = np.empty((*start.shape[:2], len(middle), columns))
        of_pulse = np.empty((*start.shape[:2], columns, BLOCK_PULSES))
        turns = start / TWO_PI + middle * (f + 0.5 * change * middle)
        of_block[..., 0], of_pulse[..., 0, :] = TWO_PI * (turns - np.rint(turns)), 1
        turns = (f + change * middle) / prf_hz  # a pulse
        of_block[..., 1], of_pulse[..., 1, :] = TWO_PI * (turns - np.rint(turns)), _NUMBER
        of_block[..., 2], of_pulse[..., 2, :] = np.pi / prf_hz**2 * change, _NUMBER**2
        if law.sine is not None:
            amplitude, rate, phase = (row[:, tile.rows, None] for row in law.sine)
            block = reduce_phase(TWO_PI * rate * middle + phase)
            pulse = (TWO_PI / prf_hz * rate * _NUMBER).astype(np.float32)
            of_block[..., 3], of_pulse[..., 3, :] = amplitude * np.sin(block), np.cos(pulse)
            of_block[..., 4], of_pulse[..., 4, :] = amplitude * np.cos(block), np.sin(pulse)
        lead, wide = start.shape[:2], len(middle) * BLOCK_PULSES
        out, exact = room(*lead, wide), room(*lead, 2 * wide).view(np.float64)
        np.matmul(of_block, of_pulse, out=exact.reshape(*lead, len(middle), BLOCK_PULSES))
        out[...] = exact
        return out

    def sines(self, sine: Sine) -> NDArray[np.float32]:
        """Sum of a few sines a record, computed as a product of small matrices.

        Parameters
        ----------
        sine : Sine
            Amplitude in any unit; here each field is of shape (records, sines).

        Returns
        -------
        ndarray of float32, shape (records, pulses)
        """
        records = len(sine.rate_hz)
        block = reduce_phase(TWO_PI * sine.rate_hz[:, None, :] * self._middles_s[:, None] + sine.phase_rad[:, None, :])
        pulse = (TWO_PI / self.radar.prf_hz * sine.rate_hz[:, :, None] * _NUMBER).astype(np.float32)
        level = sine.amplitude_rad[:, None, :].astype(np.float32)
        of_block = np.concatenate([level * np.sin(block), level * np.cos(block)], axis=2)
        of_pulse = np.concatenate([np.cos(pulse), np.sin(pulse)], axis=1)
        return np.matmul(of_block, of_pulse).reshape(records, len(self._middles_s) * BLOCK_PULSES)[
            :, : self.radar.pulses
        ]
