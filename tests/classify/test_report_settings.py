from pathlib import Path

import pytest
from bladewing.classify import BadInput
from bladewing.classify.report.settings import QUICK, report_config


def test_options_come_before_the_file_and_the_file_before_quick(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text("records = 5000\nseed = 7\n")
    found = report_config(file, seed=3, quick=True)
    assert (found.records, found.seed, found.front_epochs) == (5000, 3, QUICK["front_epochs"])
    assert report_config().records == 30_000


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("seed = 4294967296", "seed is 4294967296: it should be less than 4294967296"),
        ("recrods = 5", "unknown field 'recrods': the fields are seed, records"),
        ("front_s = 0", "front_s is 0: it should be greater than 0"),
        ("records = 'many'", "records is 'many'"),
        ("records = '700'", "records is '700'"),
        ("chain_s = true", "chain_s is True"),
        ("records", "not TOML"),
    ],
)
def test_a_wrong_settings_file_is_one_clear_line(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "own.toml"
    file.write_text(text)
    with pytest.raises(BadInput, match=r"own\.toml") as error:
        report_config(file)
    assert said in str(error.value)
    assert "\n" not in str(error.value)
