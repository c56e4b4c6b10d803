"""The shipped model on measured recordings it was never trained on; they lie beside the project, not in it."""

import json
from pathlib import Path

import pytest
from bladewing.classify.cli import main

FOLDER = Path(__file__).parents[3] / "shared" / "recordings"
RECORDINGS = sorted(FOLDER.glob("*.sigmf-meta"))

pytestmark = pytest.mark.skipif(not RECORDINGS, reason="no measured recordings: not tested")


@pytest.fixture(scope="module")
def answers():
    from contextlib import redirect_stdout
    from io import StringIO

    with redirect_stdout(StringIO()) as said:
        assert main(["predict", "--json", *map(str, RECORDINGS)]) == 0
    return [json.loads(line) for line in said.getvalue().splitlines()]


def dwells(answers, start: str) -> list[dict]:
    return [a for a in answers if "label" in a and Path(a["file"]).name.startswith(start)]


def tracks(answers, start: str) -> list[dict]:
    return [a["track"] for a in answers if "track" in a and Path(a["file"]).name.startswith(start)]


def test_every_recording_gets_a_label_a_dwell_and_one_in_all(answers):
    assert len([a for a in answers if "track" in a]) == len(RECORDINGS)
    for answer in answers:
        if "track" not in answer:
            assert answer["stop_s"] - answer["start_s"] == pytest.approx(0.08, abs=1e-3)
            assert (answer["label"] == "unknown") == bool(answer["reason"])


def test_the_drone_is_a_uav(answers):
    found = [a["label"] for a in dwells(answers, "drone")]
    assert len(found) >= 50
    assert found.count("uav") >= 0.95 * len(found)
    assert {t["label"] for t in tracks(answers, "drone")} == {"uav"}


def test_the_sea_at_1_khz_is_unknown_for_the_right_reason(answers):
    assert dwells(answers, "sea")
    for answer in dwells(answers, "sea"):
        assert answer["label"] == "unknown"
        assert "unambiguous velocity 8.0 m/s is below 10 m/s" in answer["reason"]


def test_no_walker_vehicle_or_sea_recording_is_a_uav(answers):
    for start in ("person", "vehicle", "sea"):
        labels = {t["label"] for t in tracks(answers, start)}
        assert labels
        assert "uav" not in labels


@pytest.mark.parametrize(("start", "spacing_hz"), [("drone-hover", 161), ("drone-idle", 64)])
def test_the_drone_has_a_comb_that_stays(answers, start, spacing_hz):
    """One tagged blade passes 161 times a second hovering and 64 times idling, two of them twice as often."""
    for tags, multiple in (("10000000", 1), ("11000000", 2)):
        found = [track["comb_hz"] for track in tracks(answers, f"{start}-{tags}")]
        assert found == pytest.approx([multiple * spacing_hz] * 2, rel=0.03)


def test_nothing_else_has_one(answers):
    for start in ("person", "vehicle", "sea"):
        assert {track["comb_hz"] for track in tracks(answers, start)} == {None}


def test_the_one_whose_bytes_are_full_is_called_clipped(answers):
    """It fills -128 to 127, its mean taken out afterwards: 52 values stand at its four ends."""
    told = {track["remarks"][-1] for track in tracks(answers, "") if "clipped" in "".join(track["remarks"])}
    assert len(told) == 1
    assert told.pop().startswith("clipped: 52 values")
    assert any("clipped" in track["remarks"][-1] for track in tracks(answers, "sea-target-30-clutter-only"))
