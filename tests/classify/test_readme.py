import re
from pathlib import Path

import pytest
from bladewing.classify.cli import main

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
#: Pages whose Python goes on where the one before ends.
PAGES = (README, ROOT / "docs" / "predict.md", ROOT / "docs" / "scenes.md")
LINK = re.compile(r"\]\((?!https?:)([^)#]*)(?:#([^)]*))?\)")


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


def test_the_python_of_the_readme_and_its_pages_runs_from_top_to_bottom(folder, monkeypatch):
    monkeypatch.chdir(folder)
    blocks = [
        (page, block)
        for page in PAGES
        for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    ]
    assert len(blocks) >= 5
    names = {}
    for page, block in blocks:
        exec(compile(block, str(page), "exec"), names)
        assert "p" not in names or (names["p"].labels == "uav").all()
    assert names["given"].track.label == names["track"].label == "uav"
    assert names["label"].tolist() == [3] * 64, "of silence nothing is known"
    assert names["m"].chopping_hz == pytest.approx(140, abs=0.5)
    assert names["rendering"].iq.size
    assert len(names["drawn"].iq) == 60


@pytest.mark.parametrize("page", [README, *sorted((ROOT / "docs").glob("*.md"))], ids=lambda page: page.name)
def test_every_link_between_the_pages_leads_to_a_page_and_a_heading(page):
    for path, heading in LINK.findall(page.read_text(encoding="utf-8")):
        there = (page.parent / path).resolve() if path else page
        assert there.exists(), path
        if heading:
            titles = re.findall(r"^#+ (.*)$", there.read_text(encoding="utf-8"), re.MULTILINE)
            assert heading in {re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-") for title in titles}
