import re
from pathlib import Path

import pytest
from bladewing.classify.cli import main

README = Path(__file__).parents[2] / "README.md"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the commands beside the Python leave."""
    folder = tmp_path_factory.mktemp("readme")
    text = README.read_text(encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for command in ("simulate quadcopter --out quadcopter", "export --carrier-hz 9.85e9"):
            line = re.search(rf"^    \$ bladewing ({command}[^#\n]*)", text, re.MULTILINE)
            assert main(line.group(1).split()) == 0
    return folder


def test_the_python_of_the_readme_runs_from_top_to_bottom(folder, monkeypatch):
    monkeypatch.chdir(folder)
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) >= 5
    names = {}
    for block in blocks:
        exec(compile(block, str(README), "exec"), names)
        assert "p" not in names or (names["p"].labels == "uav").all()
    assert names["given"].track.label == names["track"].label == "uav"
    assert names["label"].tolist() == [3] * 64, "of silence nothing is known"
    assert names["m"].chopping_hz == pytest.approx(140, abs=0.5)
    assert names["rendering"].iq.size
