"""Whole aircraft, rendered in tiles, against the closed form of each rotor at float64 angles."""

import numpy as np
import pytest
from bladewing.simulate import Radar, Rotor, RotorMotion, body_echo, rotor_echo, rotors_echo
from bladewing.simulate.motion import range_phasor, straight_path
from hypothesis import given, settings
from hypothesis import strategies as st

RADAR = Radar(9.85e9, 25e3, 1000)


def drawn(records: int, seed: int, blades: tuple[int, ...] = (2, 3, 4, 1)) -> list[Rotor]:
    rng = np.random.default_rng(seed)

    def uniform(low: float, high: float) -> np.ndarray:
        return rng.uniform(low, high, records)

    return [
        Rotor(
            RotorMotion(
                uniform(-400, 400),
                uniform(-np.pi, np.pi),
                uniform(-30, 30),
                uniform(0, 2),
                uniform(0.5, 20),
                uniform(0, 6),
            ),
            blade_length_m=uniform(0.1, 0.5),
            beta_rad=uniform(0, 1.5),
            root_m=uniform(0, 0.1),
            blade_amplitudes=rng.uniform(0, 1, (records, count)),
            edge_asymmetry=uniform(-1, 1),
            hub=uniform(0, 1) * np.exp(1j * uniform(-np.pi, np.pi)),
            points=points,
        )
        for count, points in zip(blades, (None, 1, 5, None), strict=False)
    ]


def slowly(radar: Radar, rotors: list[Rotor], velocity_mps: np.ndarray, acceleration_mps2: np.ndarray) -> np.ndarray:
    total = np.zeros((len(velocity_mps), radar.pulses), complex)
    for rotor in rotors:
        echo = rotor_echo(
            rotor.motion.angle_rad(radar.times_s),
            wavelength_m=radar.wavelength_m,
            blade_length_m=rotor.blade_length_m,
            beta_rad=rotor.beta_rad,
            root_m=rotor.root_m,
            blade_amplitudes=rotor.blade_amplitudes,
            edge_asymmetry=rotor.edge_asymmetry,
            points=rotor.points,
        )
        total += np.asarray(rotor.hub)[..., None] * echo
    return total * range_phasor(straight_path(radar.times_s, velocity_mps, acceleration_mps2), radar.wavelength_m)


@settings(max_examples=30, deadline=None)
@given(
    carrier_hz=st.floats(2e9, 1e11),
    prf_hz=st.floats(1e3, 1e5),
    pulses=st.integers(1, 700),
    seed=st.integers(0, 99),
)
def test_tiles_equal_the_closed_form_at_any_radar(carrier_hz, prf_hz, pulses, seed):
    radar, rotors = Radar(carrier_hz, prf_hz, pulses), drawn(3, seed)
    velocity, acceleration = np.random.default_rng(seed).uniform(-30, 30, (2, 3))
    fast = rotors_echo(radar, rotors, 3, velocity_mps=velocity, acceleration_mps2=acceleration)
    slow = slowly(radar, rotors, velocity, acceleration)
    # float32 angles: blades of up to 0.5 m are some 2000 rad long at 100 GHz, so 2000 x 2e-7, less at lower carriers;
    # and an echo of points has the full slope of their phases
    blade_rad = 2 * np.pi / radar.wavelength_m * 2 * 0.5
    np.testing.assert_allclose(fast, slow, atol=10 * (3e-6 + 6e-7 * blade_rad))


def test_more_samples_than_a_tile_holds_change_nothing():
    radar = Radar(9.85e9, 25e3, 40_000)
    rotors, rest = drawn(2, 5, blades=(2,)), np.zeros(2)
    np.testing.assert_allclose(rotors_echo(radar, rotors, 2), slowly(radar, rotors, rest, rest), atol=2e-4)


def test_batch_equals_loop_bit_by_bit():
    whole = rotors_echo(RADAR, drawn(40, 3), 40, velocity_mps=np.arange(40.0))
    rotors = drawn(40, 3)
    for i in (0, 17, 39):
        alone = [
            Rotor(
                RotorMotion(**{name: value[i : i + 1] for name, value in vars(r.motion).items()}),
                **{name: value[i : i + 1] for name, value in vars(r).items() if name not in ("motion", "points")},
                points=r.points,
            )
            for r in rotors
        ]
        np.testing.assert_array_equal(rotors_echo(RADAR, alone, 1, velocity_mps=float(i))[0], whole[i])


def test_rows_of_more_points_than_float32_tells_apart_are_refused():
    with pytest.raises(ValueError, match="points is 65: it must be at most 64"):
        rotors_echo(RADAR, [Rotor(RotorMotion(80.0, 0.0), blade_length_m=0.2, points=65)], 1)


def test_blades_of_more_wavelengths_than_float32_tells_apart_are_refused():
    rotors = [Rotor(RotorMotion(80.0, 0.0), blade_length_m=0.2), Rotor(RotorMotion(0.2, 0.0), blade_length_m=[1, 90])]
    with pytest.raises(ValueError, match=r"rotors\[1\].blade_length_m is \[1, 90\]: .* at most 30000: longer blades"):
        rotors_echo(RADAR, rotors, 2)


def test_equal_blades_without_asymmetry_have_a_real_echo_at_a_real_hub():
    rotor = Rotor(RotorMotion(80.0, 0.3), blade_length_m=0.2, blade_amplitudes=(1.0, 1.0, 1.0, 1.0))
    echo = rotors_echo(RADAR, [rotor], 1)
    assert not echo.imag.any()
    assert abs(echo.real).max() > 1


def test_echoes_are_added_to_what_is_there():
    rotors = drawn(3, 1)
    noise = (np.random.default_rng(0).normal(size=(3, 1000)) * (1 + 0.5j)).astype(np.complex64)
    together = noise.copy()
    assert rotors_echo(RADAR, rotors, 3, velocity_mps=4.0, out=together) is together
    body_echo(RADAR, 3, velocity_mps=4.0, amplitude=7.0, out=together)
    apart = noise + rotors_echo(RADAR, rotors, 3, velocity_mps=4.0) + 7 * body_echo(RADAR, 3, velocity_mps=4.0)
    np.testing.assert_allclose(together, apart, atol=2e-6 * abs(apart).max())


@given(velocity_mps=st.floats(-300, 300), acceleration_mps2=st.floats(-50, 50), phase_rad=st.floats(-10, 10))
@settings(max_examples=30, deadline=None)
def test_a_body_follows_its_path_and_shakes(velocity_mps, acceleration_mps2, phase_rad):
    t = RADAR.times_s
    echo = body_echo(
        RADAR,
        1,
        velocity_mps=velocity_mps,
        acceleration_mps2=acceleration_mps2,
        phase_rad=phase_rad,
        vibration_rad=0.4,
        vibration_hz=71.0,
        vibration_phase_rad=1.1,
    )
    expected = range_phasor(straight_path(t, velocity_mps, acceleration_mps2), RADAR.wavelength_m)
    expected = expected * np.exp(1j * (phase_rad + 0.4 * np.sin(2 * np.pi * 71 * t + 1.1)))
    # half a turn a pulse at most, 32 pulses from the middle of a block: 100 rad in float32
    np.testing.assert_allclose(echo[0], expected, atol=1.5e-5)


@given(vibration_rad=st.floats(0, 3), vibration_hz=st.floats(1, 400), seed=st.integers(0, 9))
@settings(max_examples=15, deadline=None)
def test_hubs_shake_with_the_airframe(vibration_rad, vibration_hz, seed):
    rotors, velocity, acceleration = drawn(2, seed), np.array([3.0, -8.0]), np.array([0.0, 2.0])
    shake = {"vibration_rad": vibration_rad, "vibration_hz": vibration_hz, "vibration_phase_rad": 0.7}
    path = {"velocity_mps": velocity, "acceleration_mps2": acceleration}
    fast = rotors_echo(RADAR, rotors, 2, **path, **shake)
    phase = vibration_rad * np.sin(2 * np.pi * vibration_hz * RADAR.times_s + 0.7)
    np.testing.assert_allclose(fast, slowly(RADAR, rotors, velocity, acceleration) * np.exp(1j * phase), atol=5e-3)


def test_a_still_airframe_has_the_bits_of_one_without_vibration():
    still = {"vibration_rad": 0.0, "vibration_hz": 90.0, "vibration_phase_rad": 1.0}
    np.testing.assert_array_equal(rotors_echo(RADAR, drawn(2, 1), 2, **still), rotors_echo(RADAR, drawn(2, 1), 2))


def test_no_blade_gives_no_echo():
    rotor = Rotor(RotorMotion(80.0), blade_length_m=0.2, blade_amplitudes=(0.0, 0.0))
    assert not rotors_echo(RADAR, [rotor], 2).any()


@pytest.mark.parametrize("length_m", [0.0, 1e-30, 0.2])
def test_blades_without_length_are_points(length_m):
    rotor = Rotor(RotorMotion(80.0), blade_length_m=length_m, root_m=length_m)
    echo = rotors_echo(RADAR, [rotor], 1)
    angle = rotor.motion.angle_rad(RADAR.times_s)
    expected = 2 * np.cos(4 * np.pi / RADAR.wavelength_m * length_m * np.cos(angle))
    np.testing.assert_allclose(echo[0], expected, atol=5e-5)
