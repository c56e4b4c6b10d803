import re
from threading import Event, Thread

import numpy as np
import pytest
from bladewing.features import measure
from bladewing.features.clicks import CLICK_OVER_BESIDE, CLICK_POWER, without_clicks
from bladewing.features.lines import LineSpace, line_products, sum_of_lines
from bladewing.features.one_thread import one_thread
from bladewing.features.rotor.comb import find_comb
from bladewing.features.rotor.comb_fit import fit_combs
from bladewing.features.rotor.flashes import flash_nats
from bladewing.features.rotor.periodogram import prepare
from bladewing.features.rotor.rotors import MAX_ROTORS
from bladewing.features.rotor.slow_lines import notched_products, remove_bands, slepian
from bladewing.features.rotor.strong_lines import MOST_NOTCH_BINS
from bladewing.features.rotor.unlike_blades import strong_multiple
from bladewing.simulate import RotorMotion, Scene, rotor_echo
from bladewing.simulate.catalogue import AIRFRAMES
from scipy.signal import hilbert
from threadpoolctl import threadpool_info, threadpool_limits

from ..benchmarks import records
from .signals import CARRIER_HZ, PRF_HZ, PULSES, RADAR, WAVELENGTH_M, rotors, tone, white


def drone(rates_hz, *, snr_db=0.0, seed=0, **options):
    noise = white(np.random.default_rng(seed), PULSES)
    return rotors(rates_hz, **options) * 10 ** (snr_db / 20) + noise


@pytest.mark.parametrize(("rate_hz", "velocity_mps"), [(58.61, -20.0), (43.27, 7.3), (101.9, 0.0)])
def test_chopping_is_within_its_own_error_bar(rate_hz, velocity_mps):
    found = measure(drone([rate_hz], velocity_mps=velocity_mps, body=10.0), **RADAR)
    assert abs(found.chopping_hz - 2 * rate_hz) < 4 * found.chopping_hz_std
    assert found.chopping_hz_std < 0.03  # [Hz]; the bin is 11.7 Hz
    assert found.body_velocity_mps == pytest.approx(velocity_mps, abs=0.1)
    assert found.reason == ""
    assert found.rotor_count == 1


def test_normalised_errors_have_unit_variance():
    rng = np.random.default_rng(5)
    errors = []
    for seed in range(40):
        rate_hz = rng.uniform(45, 110)
        found = measure(drone([rate_hz], snr_db=-8, seed=seed, velocity_mps=rng.uniform(-25, 25)), **RADAR)
        errors.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
    # chi-squared of 40 degrees of freedom over 40 lies within 0.5..1.75 in 99.7 %
    assert 0.5 < np.mean(np.square(errors)) < 1.75


@pytest.mark.parametrize("blades", [6, 8])
def test_the_number_of_unlike_blades_that_is_given_makes_no_multiple_of_their_rate(blades):
    # every second of their lines was taken for all, and of these every so many-th: 5 of 10 chopped up to twice as fast
    rng = np.random.default_rng(2)
    for seed in range(10):
        rate_hz, amplitudes = rng.uniform(80, 120), [rng.uniform(1.3, 2.0)] + [1.0] * (blades - 1)
        iq = drone([rate_hz], snr_db=10, seed=seed, amplitudes=amplitudes, body=10.0)
        found = measure(iq, **RADAR, blades=blades)
        assert found.chopping_hz == pytest.approx(blades * rate_hz, rel=0.002)


@pytest.mark.parametrize("fall_db", [0.0, 15.0])
def test_the_level_that_edges_are_read_against_is_even_where_the_noise_is(fall_db):
    rng, turns = np.random.default_rng(3), np.arange(0.05, 0.45, 0.01)
    levels, truth = [], 10 ** (-fall_db / 10 * turns / 0.5)
    for _ in range(20):
        spectrum = np.fft.fft(white(rng, PULSES)) * 10 ** (-fall_db / 20 * np.abs(np.fft.fftfreq(PULSES)) / 0.5)
        data = prepare(np.fft.ifft(spectrum).astype(np.complex64), **RADAR)
        own = data.level_of(data.samples, evened=True)(turns)
        levels.append(own * np.mean(np.abs(spectrum) ** 2) / PULSES / np.mean(np.abs(data.samples) ** 2))
    # a block of 24 bins is known to a third; where nothing says that the level falls all of them tell it
    deviation = np.std(np.log(levels), axis=0).mean()
    assert deviation < (0.05 if fall_db == 0 else 0.4)
    near = truth > 0.5  # further out it is no less than a share of the floor
    np.testing.assert_allclose(np.mean(levels, axis=0)[near], truth[near], rtol=0.2)


def test_a_body_line_50_db_up_does_not_hide_the_comb():
    rate_hz = 57.3
    found = measure(drone([rate_hz], velocity_mps=12.0, body=10**2.5), **RADAR)
    assert found.chopping_hz == pytest.approx(2 * rate_hz, rel=1e-3)


@pytest.mark.parametrize("blades", [5, 6])
def test_as_many_unlike_blades_as_are_told_repeat_once_a_turn(blades):
    amplitudes = 1 + 0.28 * np.random.default_rng(0).uniform(-1, 1, blades)
    iq = drone([120.0], amplitudes=amplitudes, length_m=0.12, snr_db=20, velocity_mps=20.0)
    found = measure(iq, **RADAR, blades=blades)
    assert found.rotation_hz == pytest.approx(120.0, rel=1e-3)  # a fifth of it, as long as four blades were the most
    assert found.chopping_hz == pytest.approx(blades * 120.0, rel=1e-3)


def test_bandwidth_tip_and_blade_follow_eq_26():
    rate_hz, length_m = 58.61, 0.15
    found = measure(drone([rate_hz], length_m=length_m, velocity_mps=3.0), **RADAR, blades=2, beta_rad=0.0)
    tip_mps = 2 * np.pi * rate_hz * length_m
    assert found.bandwidth_hz == pytest.approx(4 * tip_mps / WAVELENGTH_M, rel=0.02)
    assert found.tip_speed_mps == pytest.approx(tip_mps, rel=0.02)
    assert found.rotation_hz == pytest.approx(rate_hz, rel=1e-3)
    assert found.blade_length_m == pytest.approx(length_m, rel=0.02)
    assert not found.length_is_lower_bound
    # half the band at 60 degrees, and the same blade once beta is told
    tilted = drone([rate_hz], length_m=length_m * np.cos(np.pi / 3), velocity_mps=3.0)
    told = measure(tilted, **RADAR, blades=2, beta_rad=np.pi / 3)
    assert told.blade_length_m == pytest.approx(length_m, rel=0.04)
    assert measure(tilted, **RADAR, blades=2).length_is_lower_bound


def test_without_blades_there_are_alternatives_instead_of_a_rate():
    found = measure(drone([58.61]), **RADAR)
    assert np.isnan(found.rotation_hz)
    rpm = {choice["blades"]: choice["rpm"] for choice in found.alternatives()}
    assert rpm[2] == pytest.approx(60 * 58.61, rel=1e-3)
    assert rpm[1] == pytest.approx(2 * rpm[2])


@pytest.mark.parametrize(
    "iq",
    [
        np.zeros(PULSES, complex),
        np.ones(PULSES, complex),
        tone(1234.0),
        100 * tone(1234.0) + white(np.random.default_rng(1), PULSES),
        100 * tone(1234.0) + 50 * tone(-4000.0) + white(np.random.default_rng(2), PULSES),
        white(np.random.default_rng(3), PULSES),
        white(np.random.default_rng(3), 40),
    ],
    ids=["silence", "constant", "a line", "a line in noise", "two lines", "noise", "short"],
)
def test_where_there_is_no_comb_there_is_a_reason_and_no_number(iq):
    found = measure(iq, **RADAR)
    assert found.reason != ""
    for name in ("chopping_hz", "bandwidth_hz", "tip_speed_mps", "rotor_count", "smearing_index", "blade_length_m"):
        assert np.isnan(getattr(found, name))
    assert np.isnan(found.rotor_rates_hz).all()
    assert found.alternatives() == []


@pytest.mark.parametrize(("share", "wheel"), [(0.7, False), (0.95, True), (1.0, True), (1.3, False)])
def test_lines_that_end_as_far_from_the_body_as_that_is_fast_are_a_wheel_s(share, wheel):
    for velocity_mps in (18.0, -29.0):
        length_m = share * abs(velocity_mps) / (2 * np.pi * 25.0)
        found = measure(drone([25.0], snr_db=15.0, velocity_mps=velocity_mps, length_m=length_m, body=10.0), **RADAR)
        assert ("as wheels have" in str(found.reason)) == np.isnan(found.chopping_hz) == wheel
        assert abs(found.body_velocity_mps - velocity_mps) < 0.1


@pytest.mark.parametrize(("chopping_hz", "mains"), [(149.3, False), (149.8, True), (150.3, True), (150.9, False)])
def test_a_loud_rotor_a_little_off_the_mains_is_one(chopping_hz, mains):
    # a body whose lines would all lie on multiples of 50 Hz
    velocity_mps = -chopping_hz * 4 * WAVELENGTH_M / 2
    iq = 10 * rotors([chopping_hz / 2], velocity_mps=velocity_mps) + white(np.random.default_rng(2), PULSES)
    found = measure(iq, **RADAR)
    assert ("mains" in str(found.reason)) == mains
    assert mains or found.chopping_hz == pytest.approx(chopping_hz, rel=1e-4)


@pytest.mark.parametrize("velocity_mps", [0.0, 4.0, 8.0])
def test_four_rotors_in_a_dwell_of_under_three_flashes_are_no_comb_of_a_multiple(velocity_mps):
    """Their lines run into one another: every second to sixth was called a rotor's, surely."""
    wrong = 0
    for seed in range(8):
        iq = rotors(np.array([69.0, 70.0, 71.0, 72.0]) + 0.1 * seed, velocity_mps=velocity_mps, body=6.0)
        iq = 3 * iq + white(np.random.default_rng(seed), PULSES)
        if seed == 0:
            assert measure(iq, **RADAR).chopping_hz == pytest.approx(141, rel=0.01)
        found = measure(iq[:700], **RADAR)  # 20 ms
        wrong += bool(np.isfinite(found.chopping_hz) and not 0.9 < found.chopping_hz / 141 < 1.1)
    assert wrong <= 1


@pytest.mark.parametrize("velocity_mps", [0.08, 0.15, 0.2, -0.2])
def test_one_that_hovers_in_front_of_ground_is_one(velocity_mps):
    """The ground's line at rest passed for the body's, and one rotor for two to five."""
    single = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rate_hz = rng.uniform(60, 140)
        ground = np.convolve(white(rng, PULSES + 1500), np.hanning(1500), "valid")[:PULSES]
        ground *= 10 / np.sqrt(np.mean(np.abs(ground) ** 2))
        iq = 10 * rotors([rate_hz], velocity_mps=velocity_mps) + ground + white(rng, PULSES)
        found = measure(iq, **RADAR)
        single += bool(found.rotors_resolved and found.rotor_count == 1)
    assert single >= 5


def test_mains_harmonics_are_no_rotor():
    times_s = np.arange(PULSES) / PRF_HZ
    hum = sum(np.exp(2j * np.pi * 100 * order * times_s + 1j * order) for order in range(-30, 31))
    found = measure(hum + white(np.random.default_rng(0), PULSES), **RADAR)
    assert "mains" in str(found.reason)


@pytest.mark.parametrize("level", [0.3, 1.0])
def test_loud_mains_of_one_channel_beside_a_background_are_no_rotor(level):
    """Whatever line of it they are counted from: of a measured one a dwell in fifty was called a rotor of 100.5 Hz."""
    times_s = np.arange(PULSES) / PRF_HZ
    for seed in range(4):
        rng = np.random.default_rng(seed)
        hum = sum(np.cos(2 * np.pi * (100.5 * n + 12) * times_s + rng.uniform(0, 6)) for n in range(1, 60))
        ground = np.convolve(white(rng, PULSES + 1500), np.hanning(1500), "valid")[:PULSES].real
        channel = hilbert(level * hum + 3 * ground + white(rng, PULSES).real)
        found = measure(channel.astype(np.complex64), **RADAR)
        assert np.isnan(found.chopping_hz)
        assert "mains" in str(found.reason)


def test_a_batch_gives_what_a_loop_gives():
    batch = np.stack([drone([58.6]), white(np.random.default_rng(4), PULSES), drone([80.2, 81.3], seed=2)])
    together = measure(batch, **RADAR)
    for index, iq in enumerate(batch):
        alone = measure(iq, **RADAR)
        for name in ("chopping_hz", "bandwidth_hz", "rotor_rates_hz", "body_velocity_mps", "reason"):
            np.testing.assert_array_equal(getattr(together, name)[index], getattr(alone, name))


def test_gain_phase_time_reversal_and_scale():
    iq = drone([58.61], velocity_mps=-9.0)
    base = measure(iq, **RADAR)
    turned = measure(iq * 32 * np.exp(1j), **RADAR)
    assert turned.chopping_hz == pytest.approx(base.chopping_hz, rel=1e-6)
    # time reversed: Doppler changes sign, the chopping stays
    back = measure(iq[::-1], **RADAR)
    assert back.chopping_hz == pytest.approx(base.chopping_hz, abs=2 * base.chopping_hz_std)
    assert back.body_velocity_mps == pytest.approx(-base.body_velocity_mps, abs=0.02)
    # carrier and PRF doubled: the same samples mean twice the rates at the same speeds
    scaled = measure(iq, carrier_hz=2 * CARRIER_HZ, prf_hz=2 * PRF_HZ)
    assert scaled.chopping_hz == pytest.approx(2 * base.chopping_hz, rel=1e-6)
    assert scaled.tip_speed_mps == pytest.approx(base.tip_speed_mps, rel=1e-6)
    assert scaled.body_velocity_mps == pytest.approx(base.body_velocity_mps, rel=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_a_record_mirrored_in_velocity_measures_alike_but_for_its_sign(seed):
    # levels about the lines were once a bin off: by up to a deviation, and by a rotor more
    rng = np.random.default_rng(seed)
    rates_hz = records.apart(rng, (1, 1, 2, 4)[seed % 4], 0.3, 50, 60)
    shown = {"snr_db": (0, 10, 20)[seed % 3], "body_db": 20, "velocity_mps": rng.uniform(-20, 20)}
    iq = records.record(rng, rates_hz, **shown)
    base = measure(iq, **records.RADAR)
    for mirrored in (iq.conj(), iq[::-1]):
        found = measure(mirrored, **records.RADAR)
        assert found.rotor_count == base.rotor_count
        assert found.rotors_resolved == base.rotors_resolved
        for name, sign in (("chopping_hz", 1), ("bandwidth_hz", 1), ("body_velocity_mps", -1)):
            std = getattr(base, name + "_std")
            assert getattr(found, name) == pytest.approx(sign * getattr(base, name), abs=0.02 * std), name
            assert getattr(found, name + "_std") == pytest.approx(std, rel=0.02), name


def test_rotors_20_rpm_apart_are_told_apart_and_like_ones_are_not():
    rates_hz = np.array([3395.0, 3431.0, 3464.0, 3500.0]) / 60
    found = measure(drone(rates_hz, snr_db=3, velocity_mps=5.0, body=10.0), **RADAR)
    assert found.rotor_count == 4
    np.testing.assert_allclose(found.rotor_rates_hz[:4], 2 * rates_hz, rtol=2e-3)
    assert np.isnan(found.rotor_rates_hz[4:]).all()
    assert measure(drone([58.0, 58.0]), **RADAR).rotor_count == 1
    # the edge is the fastest rotor's, and so is the blade's length, told of the blades or not
    two = next(choice for choice in found.alternatives() if choice["blades"] == 2)
    assert two["blade_length_m"] == pytest.approx(0.15, rel=0.003)
    assert two["rpm"] == pytest.approx(60 * rates_hz.mean(), rel=1e-3)
    told = measure(drone(rates_hz, snr_db=3, velocity_mps=5.0, body=10.0), **RADAR, blades=2)
    assert two["blade_length_m"] == pytest.approx(told.blade_length_m, rel=1e-3)


@pytest.mark.parametrize(
    "chopping_hz", [(137, 174), (128, 140, 144, 156), (124, 126, 154, 156), (130, 133, 135.5, 143, 148.5, 151)]
)
def test_rotors_that_are_not_alike_are_told_apart(chopping_hz):
    """The lines of rates far from the loudest comb pass for those of rates near it: each third or fourth of them."""
    rates_hz = np.array(chopping_hz) / 2
    for seed in range(4):
        found = measure(drone(rates_hz, snr_db=10.0, seed=seed), **RADAR)
        assert found.rotors_resolved
        assert found.rotor_count == len(rates_hz)
        np.testing.assert_allclose(found.rotor_rates_hz[: len(rates_hz)], chopping_hz, rtol=1e-3)
        assert found.chopping_hz == pytest.approx(2 * rates_hz.mean(), abs=5 * found.chopping_hz_std)


def test_strong_lines_of_unequal_blades():
    orders = np.arange(-20, 21)
    power = np.where(orders % 2 == 0, 100.0, 5.0)
    assert strong_multiple(orders, power, range(2, 5)) == 2
    assert strong_multiple(orders, np.full(41, 50.0), range(2, 5)) == 1


def test_bad_arguments_are_refused():
    iq = drone([58.0])
    wrong = {"blades": (0, 1.5, "2", [2], True), "beta_rad": (np.pi / 2, -0.1, "a", True)}
    for name, value in [(name, value) for name, values in wrong.items() for value in values]:
        with pytest.raises(ValueError, match=rf"{name} is .* must be [^:]*$"):
            measure(iq, **RADAR, **{name: value})
    with pytest.raises(ValueError, match=r"below pi/2 \[rad\]: 30 degrees are np\.radians\(30\)$"):
        measure(iq, **RADAR, beta_rad=30)
    for radar in ({"carrier_hz": 9.85}, {"prf_hz": 0.5}):  # in GHz; in MHz
        with pytest.raises(ValueError, match=r"is .*: it must be .* Hz: give 9\.85 GHz as 9\.85e9"):
            measure(iq, **RADAR | radar)
    for none in (np.nan, "9.85e9", None, np.array([9.85e9])):
        with pytest.raises(ValueError, match=r"carrier_hz is .*: it must be a finite number above 0 \[Hz\]"):
            measure(iq, **RADAR | {"carrier_hz": none})
    with pytest.raises(ValueError, match="rows of unequal length: every record must have as many pulses"):
        measure([[1j, 2j, 3j], [1j, 2j]], **RADAR)
    with pytest.raises(ValueError, match="too large for complex64: lower the gain"):
        measure(iq.astype(complex) * 1e200, **RADAR)
    with pytest.raises(ValueError, match="not finite"):
        measure(np.where(np.arange(PULSES) == 5, np.nan, iq), **RADAR)
    with pytest.raises(ValueError, match="iq holds float64: its samples must be complex"):
        measure(iq.real, **RADAR)


def test_no_record_gives_no_measurement():
    done = []
    found = measure(np.zeros((2, 0, PULSES), np.complex64), **RADAR, on_record=done.append)
    assert done == []
    assert (found.chopping_hz.shape, found.rotor_rates_hz.shape) == ((2, 0), (2, 0, MAX_ROTORS))
    assert found.reason.dtype.kind == "U"


def threads() -> set[int]:
    """Threads of linear algebra."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_who_leaves_first_does_not_give_the_others_threads_back():
    with threadpool_limits(2, user_api="blas"):
        one_thread.__enter__()
        with one_thread:
            one_thread.__exit__(None, None, None)
            assert threads() == {1}
        assert threads() == {2}


def test_linear_algebra_has_one_thread_in_whichever_thread_asks_for_it():
    with threadpool_limits(2, user_api="blas"):
        with one_thread:
            assert threads() == {1}
        within = []

        def enter():
            with one_thread:
                within.append(threads())

        worker = Thread(target=enter)
        worker.start()
        worker.join()
        assert (within, threads()) == ([{1}], {2})


def test_the_last_thread_to_leave_gives_the_threads_back():
    inside, leave = Event(), Event()

    def hold():
        with one_thread:
            inside.set()
            assert leave.wait(60)

    with threadpool_limits(2, user_api="blas"):
        with one_thread:
            worker = Thread(target=hold)
            worker.start()
            assert inside.wait(60)
        assert threads() == {1}
        leave.set()
        worker.join()
        assert threads() == {2}


def test_linear_algebra_has_one_thread_within_and_its_own_again_after():
    with threadpool_limits(2, user_api="blas"):
        before, within = threads(), []
        measure(np.stack([drone([58.0])] * 2), **RADAR, on_record=lambda _: within.append(threads()))
        assert (before, within, threads()) == ({2}, [{1}, {1}], {2})


@pytest.mark.parametrize(("pulses", "half_bins"), [(600, 3.0), (601, 3.0), (601, 8.5), (13, 1.0), (4, 1.0), (3, 0.5)])
def test_slepian_sequences_are_the_best_concentrated_first(pulses, half_bins):
    basis = slepian(pulses, half_bins)
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-9)
    apart = np.arange(pulses)[:, None] - np.arange(pulses)
    within = 2 * half_bins / pulses * np.sinc(2 * half_bins / pulses * apart)  # what of a sequence lies in the band
    shares, vectors = np.linalg.eigh(within)
    np.testing.assert_allclose(np.einsum("kn,nm,km->k", basis, within, basis), shares[::-1][: len(basis)], atol=1e-9)
    clear = shares[::-1][: len(basis)] > 1e-9  # below, the shares tell nothing apart
    best = vectors[:, ::-1][:, : int(clear.sum())]
    np.testing.assert_allclose(basis[clear].T @ basis[clear], best @ best.T, atol=1e-6)


def test_slepian_sequences_take_out_a_band_and_leave_the_rest():
    time = np.arange(600)
    inside, outside = np.exp(2j * np.pi * 0.1012 * time), np.exp(2j * np.pi * 0.15 * time)
    assert np.mean(np.abs(remove_bands(1e4 * inside, [(0.1, 3.0), (0.3, 3.0)])) ** 2) < 1e-4
    assert np.mean(np.abs(remove_bands(outside, [(0.1, 3.0)])) ** 2) > 0.9


def test_evidence_needs_more_than_chance():
    noise = white(np.random.default_rng(8), 30, 1500)
    combs = [find_comb(prepare(iq.astype(np.complex64), **RADAR))[0] for iq in noise]
    assert sum(comb is not None for comb in combs) <= 2


def test_lines_read_and_written_at_any_frequency_agree_with_the_plain_sums():
    rng = np.random.default_rng(0)
    for pulses in (301, 64):
        samples, frequency = white(rng, pulses), rng.uniform(-0.5, 0.5, 12)
        frequency[-2:] = frequency[:2] + np.array(
            [1.0, -2.0]
        )  # the same ones, but for a sign where the pulses are even
        time = np.arange(pulses) - (pulses - 1) / 2
        lines = np.exp(2j * np.pi * np.outer(frequency, time))
        seen, moment = LineSpace(samples).at(frequency)
        np.testing.assert_allclose(seen, lines.conj() @ samples / pulses, atol=1e-7)
        np.testing.assert_allclose(moment, lines.conj() @ (time * samples) / pulses, atol=1e-6 * pulses)
        np.testing.assert_allclose(sum_of_lines(pulses, frequency, seen), seen @ lines, atol=1e-5)
        plain, timed, squared = line_products(frequency, pulses)
        np.testing.assert_allclose(plain, lines.conj() @ lines.T / pulses, atol=1e-10)
        np.testing.assert_allclose(-1j * timed, lines.conj() @ (time * lines).T / pulses, atol=1e-9)
        np.testing.assert_allclose(squared, lines.conj() @ (time**2 * lines).T / pulses, atol=1e-7)


@pytest.mark.parametrize("bands", [((0.1, 3.0),), ((0.1, 3.0), (-0.21, 4.0)), ((0.1, 3.0), (0.115, 3.0))])
def test_the_products_of_lines_know_what_the_notch_takes(bands):
    pulses = 600
    time = np.arange(pulses) - (pulses - 1) / 2
    frequency = 0.1 + np.array([4.2, 7.7, -6.1, 12.3, 120.0, -180.0]) / pulses
    lines = np.exp(2j * np.pi * np.outer(frequency, time))
    products = notched_products(frequency, pulses, bands)
    left = np.stack([remove_bands(line, bands) for line in lines])
    timed = np.stack([remove_bands(line * time, bands) for line in lines])
    each = np.eye(len(frequency), dtype=complex)
    with_time, squared = left.conj() @ timed.T / pulses, timed.conj() @ timed.T / pulses
    np.testing.assert_allclose(products.plain, left.conj() @ left.T / pulses, atol=1e-5)
    np.testing.assert_allclose(-1j * products.with_time(each), with_time, atol=1e-5 * pulses)
    np.testing.assert_allclose(1j * products.time_with(each), with_time.conj().T, atol=1e-5 * pulses)
    np.testing.assert_allclose(products.with_time_squared(each), squared, atol=1e-5 * pulses**2)


def test_a_long_dwell_of_a_short_wave_takes_out_no_wider_band_than_memory_holds():
    pulses, radar = 8192, {"carrier_hz": 94e9, "prf_hz": 25e3}  # 3 m/s would be 617 bins of this dwell
    moving = 10 * np.exp(0.4j * np.pi * np.arange(pulses))
    iq = (30 + moving + white(np.random.default_rng(0), pulses)).astype(np.complex64)
    data = prepare(iq, **radar)
    assert [half for turn, half in data.strong.bands if turn == 0.0] == [MOST_NOTCH_BINS]
    assert np.abs(np.fft.fft(data.samples)[:MOST_NOTCH_BINS]).max() < 1e-3 * np.abs(np.fft.fft(iq)).max()


def test_many_clicks_are_taken_out_where_they_come_at_random_and_not_as_flashes_do():
    rng = np.random.default_rng(4)
    noise = white(rng, PULSES).astype(complex)
    random, steady = noise.copy(), noise.copy()
    places = rng.choice(PULSES, 20, replace=False)
    random[places] += 30 * np.exp(2j * np.pi * rng.random(20))
    assert np.count_nonzero(without_clicks(random)[places]) <= 2  # two may stand side by side
    steady[100 :: PULSES // 21] += 30
    np.testing.assert_array_equal(without_clicks(steady), steady)
    lines = np.array([random + 30 * np.exp(1j * turn) for turn in (0.0, 1.0, 2.0, 3.0)])
    assert np.isnan(measure(lines.astype(np.complex64), **RADAR).chopping_hz).all()


def test_clicks_are_taken_out_and_flashes_are_not():
    rng = np.random.default_rng(5)
    noise = white(rng, PULSES)
    clicked = noise.copy()
    clicked[[700, 1100]] += [20, 30j]
    clean = without_clicks(clicked)
    np.testing.assert_array_equal(np.flatnonzero(clean != noise), [700, 1100])
    assert not clean[[700, 1100]].any()
    np.testing.assert_array_equal(without_clicks(noise), noise)
    # a click's samples beside are as weak as ever, those of a band-limited flash are not
    flash = noise + 20 * np.sinc((np.arange(PULSES) - 900.3) * 0.4)
    np.testing.assert_array_equal(without_clicks(flash), flash)
    # nor is the first or the last sample of a record: it may be all that is left of one
    for end in (0, -1):
        cut = noise.copy()
        cut[end] += 40
        np.testing.assert_array_equal(without_clicks(cut), cut)
    # two clicks are as far apart as the flashes of a rotor, 400 samples are 87.5 Hz: each of these had a comb
    for seed in (4, 6, 11, 13):
        clicked = white(np.random.default_rng(seed), PULSES)
        clicked[[700, 1100]] += [20, 30j]
        assert np.isnan(measure(clicked, **RADAR).chopping_hz)


def test_flashes_of_a_wide_band_are_no_clicks():
    # bursts two samples long, as those of rotors whose band fills half the span: chance hides what lies beside some
    cut = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        samples = 0.01 * white(rng, PULSES)
        for instant, phase in zip(rng.uniform(0, PULSES, 400), rng.uniform(0, 2 * np.pi, 400), strict=True):
            samples += rng.exponential() ** 2 * np.exp(1j * phase) * np.sinc((np.arange(PULSES) - instant) * 0.5)
        empty = np.abs(np.fft.fftfreq(PULSES)) > 0.3
        before, after = (np.mean(np.abs(np.fft.fft(x)[empty]) ** 2) for x in (samples, without_clicks(samples)))
        assert after < 1.5 * before
        power = np.abs(samples[1:-1]) ** 2
        beside = np.maximum(np.abs(samples[2:]), np.abs(samples[:-2])) ** 2
        cut += np.count_nonzero((power > CLICK_OVER_BESIDE * beside) & (power > CLICK_POWER * np.median(power)))
    assert cut  # else nothing is tested


def test_six_rotors_of_which_some_are_not_told_apart_keep_their_band():
    rates_hz = np.linspace(3395.0, 3500.0, 6) / 60
    theory_hz = 8 * np.pi * rates_hz.max() * 0.15 / WAVELENGTH_M
    errors = []
    for seed in range(4):
        factor = 1 + 0.001 * seed
        found = measure(drone(rates_hz * factor, snr_db=-5, seed=seed, body=10.0), **RADAR, blades=2)
        errors.append(float(found.bandwidth_hz) / (theory_hz * factor) - 1)
    # the rotors that are not found leave holes where the others' lines part: the edge was taken for one of these
    assert np.max(np.abs(errors)) < 0.04


def test_phases_in_step_are_evidence_and_random_ones_are_not():
    rng = np.random.default_rng(6)
    noise = flash_nats(white(rng, 4000, 30))
    # chance exceeds t nats in at most exp(-t); 4000 draws leave that 20 +- 5 at 5.3 nats
    assert np.count_nonzero(noise > 5.3) < 40
    step = np.exp(1.3j * np.arange(30))
    assert flash_nats(2 * step + white(rng, 30)) > 15
    # the gain and the step do not matter, a line that cannot be seen says nothing
    assert flash_nats(7 * step + 0) == pytest.approx(flash_nats(step * np.exp(0.4j)), rel=1e-3)
    assert flash_nats(np.where(np.arange(30) < 4, step, 0)) == 0


def test_a_comb_at_16_db_under_the_noise_is_found():
    rng = np.random.default_rng(11)
    right = 0
    for seed in range(16):
        rate_hz = rng.uniform(45, 110)
        found = measure(drone([rate_hz], snr_db=-16, seed=seed, velocity_mps=rng.uniform(-25, 25), body=10.0), **RADAR)
        right += abs(float(found.chopping_hz) / (2 * rate_hz) - 1) < 0.02
    # of 16 draws right in 95 %, fewer than 12 are in under 0.1 %
    assert right >= 12


@pytest.mark.parametrize("body_db", [20, 40])
def test_a_slow_body_stands_out_of_the_ground_that_hides_no_line_of_it(body_db):
    # it was sought among the orders of the comb within the notch as if it could not be seen
    rng, off_mps = np.random.default_rng(12), []
    for velocity_mps in (-2.9, -2.4, -2.0, -1.7, 1.6, 1.9, 2.3, 2.7):
        iq = records.record(rng, [71.3], snr_db=0, body_db=body_db, velocity_mps=velocity_mps, ground_db=40)
        off_mps.append(abs(measure(iq, **records.RADAR).body_velocity_mps - velocity_mps))
    assert np.max(off_mps) < 0.05


def test_a_body_that_the_ground_hides_is_not_said_to_be_known():
    # a line at rest was taken for one of the comb's as far off it as several rotors' are from their outermost line
    rng, sure = np.random.default_rng(3), 0
    for _ in range(24):
        rate_hz, velocity_mps = rng.uniform(40, 110), rng.uniform(-2, 2)
        iq = records.record(rng, [rate_hz], snr_db=10, body_db=20, velocity_mps=velocity_mps, ground_db=40)
        found = measure(iq, **records.RADAR)
        off_mps = abs(found.body_velocity_mps - velocity_mps)
        sure += bool(off_mps > 4 * found.body_velocity_mps_std + 0.01)
    assert sure <= 2


@pytest.mark.parametrize("velocity_mps", [2.95, 3.05, 3.2, 3.39, -3.5, -3.69, 3.74, 3.8, -3.9])
def test_a_body_at_the_edge_of_the_background_is_seen_whole(velocity_mps):
    # of a line that the notch about rest cuts, the flank alone was taken for the body
    background = 200 * (1 + 0.3 * np.sin(2 * np.pi * 1.2 * np.arange(PULSES) / PULSES))
    found = measure(drone([81.2551], seed=4, velocity_mps=velocity_mps, body=100.0) + background, **RADAR)
    assert found.body_velocity_mps == pytest.approx(velocity_mps, abs=0.02)
    assert found.rotor_count == 1
    assert abs(found.chopping_hz - 2 * 81.2551) < 4 * found.chopping_hz_std
    assert found.chopping_hz_std < 0.01


def test_the_errors_stay_true_beside_a_strong_background():
    rng = np.random.default_rng(9)
    time = np.arange(PULSES)
    background = 100 * (1 + 0.3 * np.sin(2 * np.pi * 1.2 * time / PULSES))
    errors = []
    for seed in range(16):
        rate_hz = rng.uniform(45, 110)
        iq = drone([rate_hz], snr_db=5, seed=seed, velocity_mps=rng.uniform(-25, 25), body=50.0) + background
        found = measure(iq, **RADAR)
        errors.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
    # chi-squared of 16 degrees of freedom over 16 stays under 2.4 in 99.9 %
    assert np.mean(np.square(errors)) < 2.4


def test_several_combs_fitted_together_leave_noise():
    rates_hz = np.array([3395.0, 3431.0, 3464.0, 3500.0]) / 60
    data = prepare(drone(rates_hz, snr_db=10, velocity_mps=5.0, body=10.0).astype(np.complex64), **RADAR)
    centre = -2 * 5.0 / WAVELENGTH_M / PRF_HZ
    fits, rest = fit_combs(data, centre, list(2.0002 * rates_hz / PRF_HZ), [(-33, 33)] * 4, 20)
    np.testing.assert_allclose([fit.spacing * PRF_HZ for fit in fits], 2 * rates_hz, rtol=1e-4)
    assert np.mean(np.abs(rest) ** 2) < 1.1
    assert fit_combs(data, 0.0, [0.6], [(-1, 1)]) is None  # one line within the span


def test_the_chopping_of_several_rotors_is_that_of_their_mean():
    rates_hz = [56.6, 57.2, 57.7, 58.3]
    found = measure(drone(rates_hz, snr_db=10), **RADAR)
    assert abs(found.chopping_hz - 2 * np.mean(rates_hz)) < 4 * found.chopping_hz_std < 0.2


def test_what_strong_lines_leak_into_each_other_moves_no_comb():
    # The slope of a line's likelihood must lose what the other lines have in it: 25 dB up that is the error.
    orders = np.arange(-30, 31)
    errors = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        spacings_hz = rng.uniform(100, 130) * np.array([1.0, 1.01])
        lines = white(rng, 2, len(orders)) * (orders != 0)
        iq = sum(one @ tone(orders * hz) for one, hz in zip(lines, spacings_hz, strict=True))
        iq = 10 ** (25 / 20) * (iq / np.sqrt(np.mean(np.abs(iq) ** 2)) + 3) + white(rng, PULSES)
        data = prepare(iq.astype(np.complex64), **RADAR)
        fits, _ = fit_combs(data, 0.0, list(1.0001 * spacings_hz / PRF_HZ), [(-30, 30)] * 2, 20)
        found, stds = np.array([(fit.spacing, fit.spacing_std) for fit in fits]).T
        errors += list((found - spacings_hz / PRF_HZ) / stds)
    # chi-squared of 24 degrees of freedom over 24 stays under 2.14 in 99.9 %
    assert np.mean(np.square(errors)) < 2.14


def test_the_rates_of_four_rotors_and_their_body_are_true_to_their_deviations():
    errors, offs, speeds = [], [], []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        rates_hz = (np.array([3400.0, 3430.0, 3465.0, 3495.0]) + rng.uniform(-4, 4, 4)) / 60
        velocity_mps = rng.uniform(4, 30)
        found = measure(drone(rates_hz, snr_db=20, seed=seed, velocity_mps=velocity_mps, body=10.0), **RADAR)
        assert found.rotor_count == 4
        off = found.rotor_rates_hz[:4] / (2 * rates_hz) - 1
        offs += list(off)
        errors += list(off * 2 * rates_hz / found.rotor_rates_hz_std[:4])
        speeds.append((found.body_velocity_mps - velocity_mps) / found.body_velocity_mps_std)
    # weighed by the noise as it was before the lines were fitted they are off by 28e-6
    assert np.sqrt(np.mean(np.square(offs))) < 18e-6
    # chi-squared of 40 degrees of freedom over 40 lies within 0.5..1.75 in 99.7 %, of 10 over 10 under 3
    assert 0.5 < np.mean(np.square(errors)) < 1.75
    assert np.mean(np.square(speeds)) < 3


def test_rotors_just_further_apart_than_the_dwell_tells_are_told_apart():
    resolved, spreads_rpm = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        rpm = rng.uniform(3395, 3480) + np.array([0.0, 13.0])
        first, second = (shifted(value / 60, angle) for value, angle in zip(rpm, rng.uniform(0, 6, 2), strict=True))
        moving = tone(-2 * rng.uniform(5, 30) / WAVELENGTH_M)
        echo = (first + second) / np.sqrt(np.mean(np.abs(first + second) ** 2)) + 10
        found = measure(10**0.5 * echo * moving + white(rng, PULSES), **RADAR)
        resolved.append(bool(found.rotors_resolved))
        spreads_rpm.append(30 * found.rotor_spread_hz)
    # found by one step each they leave what passes for further rotors: none was resolved
    assert sum(resolved) >= 3
    assert np.abs(np.median(spreads_rpm) - 13) < 1


def test_the_band_of_four_rotors_30_db_up_is_sure():
    errors, stds = [], []
    for seed in range(8):
        rates_hz = (np.array([3400.0, 3430.0, 3465.0, 3495.0]) + np.random.default_rng(seed).uniform(-4, 4, 4)) / 60
        found = measure(drone(rates_hz, snr_db=30, seed=seed, velocity_mps=5.0 + seed, body=10.0), **RADAR)
        theory_hz = 8 * np.pi * rates_hz.max() * 0.15 / WAVELENGTH_M
        errors.append(found.bandwidth_hz / theory_hz - 1)
        stds.append(found.bandwidth_hz_std / theory_hz)
    # what their inner lines leave between them made it 7e-4
    assert np.median(stds) < 2e-4
    assert np.max(np.abs(errors)) < 4 * np.max(stds)


def test_a_body_just_past_the_notch_at_rest_is_found_where_it_is():
    velocity_mps = 3.5  # the notch ends at 3 m/s; a line of the rotor stands at rest
    rate_hz = velocity_mps / WAVELENGTH_M / 2
    found = measure(drone([rate_hz], snr_db=20, velocity_mps=velocity_mps, body=10.0), **RADAR)
    assert found.body_velocity_mps == pytest.approx(velocity_mps, abs=0.005)
    assert found.chopping_hz == pytest.approx(2 * rate_hz, rel=2e-5)


def test_unresolved_rotors_carry_their_spread():
    shown = {"snr_db": 10, "velocity_mps": 5.0, "body": 10.0}
    found = measure(
        np.stack([drone(np.array([3440.0, 3447.0]) / 60, seed=seed, **shown) for seed in range(9)]), **RADAR
    )
    assert not found.rotors_resolved[found.rotor_count != 2].any()
    assert 4 < 30 * np.median(found.rotor_spread_hz) < 14  # [rpm]
    assert np.all((30 * found.rotor_spread_hz > 4) & (30 * found.rotor_spread_hz < 25))
    apart = measure(drone(np.array([3440.0, 3475.0]) / 60, snr_db=10, velocity_mps=5.0, body=10.0), **RADAR)
    assert apart.rotors_resolved
    assert 30 * apart.rotor_spread_hz == pytest.approx(35, abs=1)
    assert measure(drone([58.0]), **RADAR).rotor_spread_hz == 0


def test_clicks_of_a_supply_are_no_rotor():
    noise = white(np.random.default_rng(2), PULSES)
    clicks = np.where(np.arange(PULSES) % 350 == 17, 5.0, 0.0)  # 100 times a second
    assert np.isnan(measure(noise + clicks + 20, **RADAR).chopping_hz)  # beside a static background


def test_a_hovering_body_is_not_taken_for_the_background():
    rng = np.random.default_rng(4)
    hovering = prepare(drone([57.3], snr_db=-10, body=10.0).astype(np.complex64), **RADAR)
    assert hovering.rest_half == 0
    slow = np.cumsum(white(rng, PULSES)) * np.hanning(PULSES)  # a skirt that falls with the frequency
    ground = prepare((drone([57.3], snr_db=-3, velocity_mps=9.0, body=10.0) + 100 + slow).astype(np.complex64), **RADAR)
    assert ground.rest_half > 0


def test_the_blade_of_several_rotors_follows_from_the_fastest():
    rates_hz = np.array([3395.0, 3430.0, 3465.0, 3500.0]) / 60
    found = measure(drone(rates_hz, snr_db=5), **RADAR, blades=2, beta_rad=0.0)
    assert found.rotor_count == 4
    assert found.body_velocity_mps == pytest.approx(0, abs=0.05)
    assert found.blade_length_m == pytest.approx(0.15, rel=0.03)


@pytest.mark.parametrize("rpm", [(3430, 3433), (3400, 3404, 3420, 3460, 3462, 3495)])
def test_rotors_nearer_than_the_dwell_tells_apart_are_not_called_resolved(rpm):
    # 3 rpm are a quarter of a bin at the outermost line: one comb fits two rotors, whose flashes stand side by side
    for seed in range(4):
        rng = np.random.default_rng(seed)
        angles = rng.uniform(0, 2 * np.pi, len(rpm))
        angles[1] = angles[0] + 0.7  # not the same flash
        iq = sum(shifted(value / 60, angle) for value, angle in zip(rpm, angles, strict=True)) + 10 + white(rng, PULSES)
        found = measure(iq, **RADAR)
        assert not found.rotors_resolved
        assert found.rotor_count < len(rpm)
        assert found.rotor_spread_hz > 0


def shifted(rate_hz, angle_rad):
    """A rotor that begins at an angle."""
    motion = RotorMotion(rate_hz, angle_rad)
    times_s = np.arange(PULSES) / PRF_HZ
    return 1.5 * rotor_echo(motion.angle_rad(times_s), wavelength_m=WAVELENGTH_M, blade_length_m=0.15)


@pytest.mark.parametrize("airframe", ["fixed_wing_15cm", "quadcopter_12cm", "hexacopter_30cm"])
def test_a_folded_band_has_its_own_edge_or_none_and_a_radar_fast_enough_sees_it(airframe):
    uav = {"name": "u", "airframe": airframe, "velocity_mps": 5.0}
    for fold in (1.4, 0.7):
        radar = {"carrier_hz": 24.1e9, "prf_hz": 10e3}
        part = Scene.build({"radar": {**radar, "pulses": 800}, "uav": [uav]}).uav[0]
        tip_mps = max(2 * np.pi * abs(rotor.rotation_hz) * rotor.blade_length_m for rotor in part.rotors)
        radar["prf_hz"] = 4 * tip_mps / fold * radar["carrier_hz"] / 299792458.0
        scene = Scene.build({"radar": {**radar, "pulses": int(0.08 * radar["prf_hz"])}, "uav": [uav]})
        found = measure(scene.render(0).iq, **radar, blades=2, beta_rad=0.0)
        assert np.isfinite(found.chopping_hz)
        if fold > 1 and (len(part.rotors) > 1 or np.isnan(found.tip_speed_mps)):
            assert np.isnan([found.bandwidth_hz, found.tip_speed_mps, found.blade_length_m]).all()
            assert "raise the PRF" in str(found.band_reason)
            assert np.isnan(found.alternatives()[0]["blade_length_m"])
        else:
            assert found.tip_speed_mps == pytest.approx(tip_mps, rel=0.03)
            assert found.band_reason == ""


@pytest.mark.parametrize("name", ["type1", "type2", "type3", "type6"])
@pytest.mark.parametrize("seed", [0, 1])
def test_blades_that_reflect_at_their_tips_are_not_taken_for_twice_as_many_rotors(name, seed):
    # a tip is seen twice at every speed below its own: before and after the blade comes straight on
    scene = Scene.load(name)
    seen = scene.render(seed)
    found = measure(seen.iq, carrier_hz=seen.radar.carrier_hz, prf_hz=seen.radar.prf_hz, blades=2, beta_rad=0.0)
    assert found.rotors_resolved
    assert found.rotor_count == len(scene.uav[0].rotors)


@pytest.mark.parametrize("body_db", [-15, -10, -5, 0, 10])
def test_blades_stronger_than_the_body_do_not_move_its_velocity_by_many_orders(body_db):
    wrong = 0
    for seed in range(8):
        velocity_mps = np.random.default_rng(seed).uniform(-20, 20)
        options = {"length_m": 0.0635, "velocity_mps": velocity_mps, "body": 10 ** (body_db / 20)}
        found = measure(drone([202.3], snr_db=20, seed=seed, **options), **RADAR)
        wrong += abs(found.body_velocity_mps - velocity_mps) > 1
    assert wrong <= 1


def short_drone(rng, rate_hz, periods):
    """The first so many flashes of one rotor."""
    pulses = round(periods / (2 * rate_hz) * PRF_HZ)
    return drone([rate_hz], snr_db=15, velocity_mps=rng.uniform(-25, 25), seed=rng.integers(1000))[:pulses]


@pytest.mark.parametrize("periods", [1.6, 2.0, 2.3, 2.6, 2.9])
def test_a_dwell_of_fewer_than_three_flashes_is_too_short_and_says_so(periods):
    # every second line was taken for the comb: an octave high, without a word
    rng = np.random.default_rng(int(10 * periods))
    for _ in range(8):
        rate_hz = rng.uniform(45, 110)
        iq = short_drone(rng, rate_hz, periods)
        found = measure(iq, **RADAR)
        assert np.isnan(found.chopping_hz)
        if "dwell too short" in str(found.reason):  # lines so near may also not be seen at all
            least_ms = float(re.search(r"([\d.]+) ms", str(found.reason))[1])
            assert least_ms > 0.95 * 3e3 / (2 * rate_hz)


@pytest.mark.parametrize("periods", [3.3, 4.2])
def test_a_dwell_of_more_than_three_flashes_is_measured(periods):
    rng = np.random.default_rng(int(10 * periods))
    right = 0
    for _ in range(10):
        rate_hz = rng.uniform(55, 110)
        iq = short_drone(rng, rate_hz, periods)
        right += abs(measure(iq, **RADAR).chopping_hz - 2 * rate_hz) < 0.05 * rate_hz
    assert right >= 9


@pytest.mark.parametrize("bird_db", [30.0, 38.0, 45.0])
def test_a_gull_beside_a_drone_moves_neither_its_comb_nor_its_band(bird_db):
    # combs were counted from the strongest line alone, the gull's: 46 Hz of 140; and its echo lifted the family's
    # level: tips at 22.4 m/s of 53.5, 0.4 % stated
    radar = {"carrier_hz": 9.4e9, "prf_hz": 20e3, "pulses": 1600}
    drone = AIRFRAMES["quadcopter_12cm"].fields | {"name": "drone", "velocity_mps": -8.0}
    tip_mps = max(2 * np.pi * abs(rotor["rotation_hz"]) * rotor["blade_length_m"] for rotor in drone["rotors"])
    for seed in range(3):
        gull = {"name": "gull", "species": "herring_gull", "velocity_mps": 6.0}
        gull |= {"body_db": bird_db, "wing_db": bird_db - 10}
        iq = Scene.build({"radar": radar, "uav": [drone], "bird": [gull]}).render(seed).iq
        found = measure(iq, carrier_hz=9.4e9, prf_hz=20e3, beta_rad=0.0)
        assert found.chopping_hz == pytest.approx(140.0, rel=1e-4)
        assert found.body_velocity_mps == pytest.approx(-8.0, abs=0.01)
        assert found.tip_speed_mps == pytest.approx(tip_mps, rel=0.003)


def test_noise_has_no_body():
    found = measure(white(np.random.default_rng(1), 8, 1000), carrier_hz=9.85e9, prf_hz=20e3)
    assert np.isnan(found.body_velocity_mps).all()
    assert np.isnan(found.body_velocity_mps_std).all()


@pytest.mark.parametrize("hit", [1, 8])
def test_pulses_that_interference_hit_take_nothing_from_a_rotor(hit):
    """They lifted the floor under all lines: no band, lines as of faster tips than any, deviations of a fraction."""
    errors = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        iq = drone([58.61], snr_db=10, seed=seed, velocity_mps=4.0)
        iq[rng.choice(PULSES, hit, replace=False)] += 300 * np.exp(2j * np.pi * rng.uniform(size=hit))
        found = measure(iq, **RADAR, blades=2)
        assert found.band_reason == ""
        assert found.tip_speed_mps == pytest.approx(2 * np.pi * 58.61 * 0.15, rel=0.01)
        errors.append((found.chopping_hz - 2 * 58.61) / found.chopping_hz_std)
    assert np.sqrt(np.mean(np.square(errors))) < 2.2  # of six normal errors in all but one of 10 000 cases


@pytest.mark.parametrize("velocity_mps", [0.0, 9.0])
def test_the_deviation_of_one_channel_has_room_for_what_the_other_side_pulls(velocity_mps):
    """Told as one rotor, moving ones were off by six deviations, rms."""
    told = []
    for seed in range(12):
        rate_hz = np.random.default_rng(seed).uniform(50, 80)
        found = measure(drone([rate_hz], snr_db=20, velocity_mps=velocity_mps, seed=seed).real + 0j, **RADAR)
        if found.rotors_resolved:
            told.append((found.chopping_hz - 2 * rate_hz) / found.chopping_hz_std)
            assert found.chopping_hz_std < 1e-3 * found.chopping_hz
    assert len(told) >= 3
    assert np.abs(told).max() < 4
