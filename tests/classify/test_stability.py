import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from bladewing.classify.cli import main
from bladewing.classify.errors import BadInput
from bladewing.classify.stability import run, spectra, waves
from bladewing.classify.stability.cell import Cell, sweep
from bladewing.simulate.rotor import LARGEST_GAMMA, rotor_echo


def at(error_at, limit=1.0, guard="guard", silent=(1,)):
    (cell,) = sweep("stage", "parameter", [1], "error", limit, guard, error_at, str, silent=silent)
    return cell


def test_a_cell_holds_with_a_small_error_or_a_reason_only():
    assert at(lambda _: 0.5).holds
    assert not at(lambda _: 2.0).holds
    assert not at(lambda _: np.nan).holds
    assert not at(lambda _: np.inf).holds
    assert at(lambda _: (np.nan, "no comb")).holds
    assert not at(lambda _: (np.nan, "no comb"), silent=()).holds


def test_a_refusal_is_an_answer_and_a_warning_is_none():
    def refuse(_):
        raise ValueError("too few pulses\nand more")

    assert at(refuse, guard="few pulses are refused").said == "refused: too few pulses"
    assert at(refuse, guard="few pulses are refused").holds
    assert not at(refuse, guard="few pulses are refused", silent=()).holds
    assert not at(lambda _: 0.0, guard="few pulses are refused").holds
    assert not at(refuse).holds  # no refusal was promised: it is a fault
    assert at(refuse).warned == "ValueError: too few pulses"
    assert at(lambda _: 1 / 0).warned == "ZeroDivisionError: division by zero"
    assert not at(lambda _: 1 / 0, guard="all is refused").holds

    def warn(_):
        warnings.warn("divide by zero", RuntimeWarning, stacklevel=1)
        return 0.0

    assert at(warn).error == 0
    assert not at(warn).holds


@pytest.mark.parametrize("part", [waves._phases, waves._blades, lambda: waves._lines(True)])
def test_the_simulator_holds_at_its_extremes(part):
    assert [cell for cell in part() if not cell.holds] == []


@pytest.mark.parametrize("part", [spectra._spectra, spectra._shapes, spectra._features])
def test_the_features_hold_at_their_extremes(part):
    assert [cell for cell in part(True) if not cell.holds] == []


def test_an_estimator_that_never_finds_anything_does_not_hold(monkeypatch):
    nothing = SimpleNamespace(chopping_hz=np.nan, reason="I never find anything")
    monkeypatch.setattr(spectra, "measure", lambda *_, **__: nothing)
    lost = {(cell.parameter, cell.value) for cell in spectra._combs() if not cell.holds}
    assert {
        ("rotation rate", "30000 rpm"),
        ("SNR", "0 dB"),
        ("pulses", "1021"),
        ("amplitude", "1"),
        ("carrier", "1 GHz"),
    } < lost
    assert not any(parameter == "record" for parameter, _ in lost)


def test_the_comb_estimator_holds_at_its_extremes():
    assert [cell for cell in spectra._combs() if not cell.holds] == []


def test_softmax_holds_at_its_extremes():
    networks = pytest.importorskip("bladewing.classify.stability.networks")
    assert [cell for cell in networks._softmax() if not cell.holds] == []


def test_a_lost_phase_is_found(monkeypatch):
    monkeypatch.setattr(waves, "range_phasor", lambda r, w: np.exp(-4j * np.pi * (r / w).astype(np.float32)))
    assert not all(cell.holds for cell in waves._phases())


def test_both_blade_paths_agree_where_they_meet():
    angle = np.linspace(0, 20, 4001)
    wavelength = 0.01
    lengths = LARGEST_GAMMA * wavelength / (4 * np.pi) * np.array([[0.999999], [1.000001]])
    arguments = {"wavelength_m": wavelength, "beta_rad": 0.0, "root_m": 0.1, "edge_asymmetry": 0.3}
    below, beyond = (
        rotor_echo(angle, blade_length_m=length[0], blade_amplitudes=(1.0, 0.7, 0.9), **arguments) for length in lengths
    )
    np.testing.assert_allclose(below, beyond, atol=5e-3)


@pytest.mark.parametrize("points", [None, 7, 90])
def test_a_blade_is_as_it_is_alone_whatever_length_stands_beside_it(points):
    angle, long_m = np.linspace(0, 20, 4001), LARGEST_GAMMA * 0.003 / (4 * np.pi)
    lengths = np.array([0.6, 2 * long_m, 0.3, 1.000001 * long_m])
    arguments = {"wavelength_m": 0.003, "root_m": 0.1, "edge_asymmetry": 0.3, "points": points}
    batch = rotor_echo(angle, blade_length_m=lengths, blade_amplitudes=np.array([[1.0, 0.7]] * 4), **arguments)
    for row, length in zip(batch, lengths, strict=True):
        alone = rotor_echo(angle, blade_length_m=length, blade_amplitudes=(1.0, 0.7), **arguments)
        np.testing.assert_array_equal(row, alone)


@pytest.mark.parametrize("length_m", [0.2, 500.0])
def test_a_rotor_without_blades_has_no_echo(length_m):
    blades = {"wavelength_m": 0.03, "blade_length_m": length_m, "blade_amplitudes": ()}
    assert not rotor_echo(np.linspace(0, 9, 50), **blades).any()
    assert rotor_echo(np.zeros((4, 50)), **blades).shape == (4, 50)


def test_the_command_writes_the_table_whole(tmp_path, monkeypatch, capsys):
    cells = [
        Cell("blade", "Gamma", "1e+06", 2e-7, "error [1]", 1e-3, "a | guard"),
        Cell("blade", "Gamma", "<1>", None, "error [1]", 1e-3, "guard", said="refused: no blades", silent=True),
        Cell("comb", "SNR", "200 dB", 0.5, "error [Hz]", 0.1, "guard"),
    ]
    monkeypatch.setattr(run, "_parts", lambda: {"all": lambda quick: iter(cells)})
    assert main(["stability", "--out", str(tmp_path), "--quick"]) == 0
    table = json.loads((tmp_path / "stability.json").read_text())
    assert [cell["holds"] for cell in table["cells"]] == [True, True, False]
    text = (tmp_path / "stability.md").read_text()
    assert "| Gamma | 1e+06 | 2e-07 | 0.001 | yes | a \\| guard |" in text
    assert text.count("## ") == 2
    page = (tmp_path / "stability.html").read_text()
    assert "&lt;1&gt;" in page
    assert page.count("<tr class=no>") == 1
    assert "name=viewport" in page
    assert "<td class=parameter rowspan=2>Gamma" in page  # said once for both
    assert "<a href='#s0'>blade: 2 of 2</a>\n<a href='#s1'>comb: 0 of 1</a>" in page
    assert "<h2 id=s1>comb</h2>" in page
    assert "2 of 3 hold." in page
    assert page.count("<div class=scroll><table>") == page.count("</table></div>") == 2
    said = capsys.readouterr().err
    assert "does not hold: comb, SNR 200 dB: 0.5" in said
    assert "2 of 3 cells hold" in said
    worst = run.worst_of_each(tmp_path)
    assert [(row["stage"], row["cells"], row["held"], row["shown"]) for row in worst] == [
        ("blade", 2, 2, "2e-07"),
        ("comb", 1, 0, "0.5"),
    ]


def test_what_is_no_table_is_refused_and_none_is_none(tmp_path):
    assert run.worst_of_each(tmp_path) is None
    for text in ('{"format": 2, "cells": [{"stage": 3}]}', "[]", '{"format": 1, "cells": []}', "["):
        (tmp_path / "stability.json").write_text(text)
        with pytest.raises(BadInput, match=r"stability\.json: not a stability table"):
            run.worst_of_each(tmp_path)
