"""`bladewing train` and `bladewing report` hand their options on; help and usage errors of the whole command line."""

import errno
import json
import os
import subprocess
import sys
import types
from importlib import metadata
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest
from bladewing.classify.cli import app, main
from bladewing.classify.exits import exit_code
from bladewing.classify.files import result_folder
from bladewing.classify.training_account import ACCOUNT, print_account
from bladewing.models import pretrained


@pytest.fixture
def calls(monkeypatch):
    """Stand in for the work of both commands; gives what they were called with."""
    seen: list[tuple[object, dict[str, object]]] = []
    for name, function in (("train", "run_training"), ("report.run", "run_report")):
        module = types.ModuleType(f"bladewing.classify.{name}")
        setattr(module, function, lambda out, **options: seen.append((out, options)))
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return seen


def test_train_hands_its_options_on(calls):
    assert main(["train"]) == 0
    assert (
        main(["train", "--out", "m", "--config", "c.toml", "--records", "650", "--seed", "7", "--quick", "--data", "d"])
        == 0
    )
    assert calls == [
        (Path("out"), {"records": None, "seed": None, "quick": False, "config": None, "data": None, "progress": True}),
        (
            Path("m"),
            {
                "records": 650,
                "seed": 7,
                "quick": True,
                "config": Path("c.toml"),
                "data": Path("d"),
                "progress": True,
            },
        ),
    ]


def test_report_hands_its_options_on(calls):
    assert main(["report"]) == 0
    assert main(["report", "--out", "r", "--models", "m", "--seed", "3", "--quick", "--config", "c.toml"]) == 0
    assert calls == [
        (Path("out"), {"models": None, "quick": False, "seed": None, "config": None, "progress": True}),
        (Path("r"), {"models": Path("m"), "quick": True, "seed": 3, "config": Path("c.toml"), "progress": True}),
    ]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "Missing command"),
        (["tain"], "No such command 'tain'"),
        (["train", "--records", "0"], "--records"),
        (["train", "--records", "many"], "--records"),
        (["train", "--seed", "-1"], "--seed"),
        (["report", "--seed", "1.5"], "--seed"),
        (["train", "extra"], "extra"),
    ],
)
def test_usage_errors_are_one_line(calls, capsys, arguments, said):
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("bladewing: error: ")
    assert err.count("\n") == 1
    assert said in err
    assert "--help)" in err
    assert calls == []


@pytest.mark.parametrize(
    "arguments", [["predict", ""], ["measure", ""], ["train", "--out", ""], ["report", "--models", ""]], ids=" ".join
)
def test_an_empty_name_is_no_folder(arguments, capsys):
    """As of a shell's variable that is not set; a path made of it would be the current folder."""
    assert main(arguments) == 2
    assert "it is empty: give a name" in capsys.readouterr().err


def test_an_interrupt_while_the_program_loads_is_one_line():
    python = (
        "import sys\n"
        "class Stopped:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'typer':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Stopped())\n"
        "from bladewing.classify.__main__ import main\n"
        "sys.exit(main())\n"
    )
    told = subprocess.run([sys.executable, "-c", python], capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout, told.stderr) == (130, "", "bladewing: stopped: interrupted\n")


def test_the_program_runs_off_the_main_thread():
    """Where no signal may be asked for."""
    python = (
        "import sys, threading\n"
        "from bladewing.classify.__main__ import main\n"
        "sys.argv = ['bladewing', '--version']\n"
        "codes = []\n"
        "thread = threading.Thread(target=lambda: codes.append(main()))\n"
        "thread.start(), thread.join()\n"
        "sys.exit(codes[0])\n"
    )
    told = subprocess.run([sys.executable, "-c", python], capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout, told.stderr) == (0, metadata.version("bladewing") + "\n", "")


def test_an_option_without_its_value_points_to_no_other_help(capsys):
    assert main(["train", "--records"]) == 2
    assert capsys.readouterr().err.endswith(" (see --help)\n")


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["-h"], ["predict", "--help"], ["predict", "-h"], ["train", "--help"], ["report", "--help"]],
)
def test_help_goes_to_stdout(capsys, arguments):
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert out.startswith("Usage: bladewing")
    assert err == ""


def test_the_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == metadata.version("bladewing") + "\n"


@pytest.mark.parametrize("module", ["bladewing.classify", "bladewing.classify.cli"])
def test_modules_run_as_the_program_does(module):
    command = [sys.executable, "-m", module, "measure", "gone"]
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (told.returncode, told.stdout) == (2, "")
    assert told.stderr.startswith("bladewing: error: gone: no such file")


def test_an_account_of_a_training_is_not_wrapped_in_a_pipe(capsys):
    account = json.loads((Path(pretrained.__file__).parent / ACCOUNT).read_text())
    account["cascade"]["asked"] = 0.95
    print_account(account, Path("out"))
    lines = capsys.readouterr().out.splitlines()
    assert "          about the 95% that it is not sure of (so many that the second alone is no slower)" in lines
    assert not any(line.endswith(" ") for line in lines)


def test_the_list_of_commands_says_whole_what_each_does(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["--help"]) == 0
    commands = capsys.readouterr().out.split("Commands:\n")[1].splitlines()
    assert len(commands) == len(app.registered_commands)
    assert all(line.endswith(".") and not line.endswith("...") for line in commands)


def test_help_shows_units(capsys):
    main(["predict", "--help"])
    assert "[s]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "name"),
    [
        (ModuleNotFoundError("No module named 'torch'", name="torch"), "torch"),
        (PackageNotFoundError("scikit-learn"), "scikit-learn"),
    ],
)
def test_a_missing_training_library_is_said_with_the_cure(monkeypatch, capsys, error, name):
    module = types.ModuleType("bladewing.classify.train")

    def needs_more(*_, **__):
        raise error

    module.run_training = needs_more  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, module.__name__, module)
    assert main(["train"]) == 2
    assert capsys.readouterr().err == (
        f"bladewing: error: {name} is not installed, this command needs it: "
        "pip install -c constraints.txt '.[train]' where bladewing's source lies\n"
    )


@pytest.mark.parametrize(
    ("command", "module", "function"),
    [
        ("train", "train", "run_training"),
        ("report", "report.run", "run_report"),
        ("stability", "stability", "run_stability"),
    ],
)
@pytest.mark.parametrize("error", [ModuleNotFoundError("No module named 'torch'", name="torch"), KeyboardInterrupt()])
@pytest.mark.parametrize("kept", [None, "old", "a/b/part"])
def test_a_run_that_ends_early_leaves_no_empty_folder(monkeypatch, tmp_path, command, module, function, error, kept):
    stand_in, out = types.ModuleType(f"bladewing.classify.{module}"), tmp_path / "a" / "b"

    def ends(folder, **_):
        result_folder(folder)
        if kept:
            (tmp_path / kept).touch()
        raise error

    setattr(stand_in, function, ends)
    monkeypatch.setitem(sys.modules, stand_in.__name__, stand_in)
    assert main([command, "--out", str(out)]) == (2 if isinstance(error, ModuleNotFoundError) else 130)
    left = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")}
    assert left == {None: set(), "old": {"old"}, "a/b/part": {"a", "a/b", "a/b/part"}}[kept]


def failing(error):
    def command():
        raise error

    return command


@pytest.mark.parametrize("name", ["ENOSPC", "EDQUOT", "EROFS", "EACCES", "EPERM", "EFBIG", "ENAMETOOLONG"])
def test_a_disk_that_cannot_be_written_is_the_users_to_mend(name, capsys):
    number = getattr(errno, name)
    assert exit_code(failing(OSError(number, os.strerror(number), "out/train.json"))) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"bladewing: error: out/train.json: {os.strerror(number)}: make room or give another place")
    assert said.count("\n") == 1


def test_a_disk_that_is_broken_is_none_of_what_was_expected(capsys):
    assert exit_code(failing(OSError(errno.EIO, os.strerror(errno.EIO), "out/train.json"))) == 1
    assert "unexpected OSError" in capsys.readouterr().err


def test_too_little_memory_is_bad_input_with_the_cure(capsys):
    assert exit_code(failing(MemoryError())) == 2
    said = capsys.readouterr().err
    assert said.startswith("bladewing: error: more memory is needed than there is: give less at once")
    assert said.count("\n") == 1


@pytest.mark.parametrize(("given", "code"), [(0, 0), (1, 1), (2, 2), (None, 0), ("done", 0), (130, 130)])
def test_a_command_ends_with_the_code_it_answers(given, code):
    assert exit_code(lambda: given) == code


@pytest.mark.parametrize("closed", ["1", "2"])
def test_a_closed_output_is_read_by_nobody_and_nothing_goes_to_the_other(tmp_path, closed):
    # what is said of a bad file must not end up among the answers, nor the answers fail where none can be written
    python = "import sys; from bladewing.classify.cli import app, main; sys.exit(main())"
    command = f'exec {closed}>&-; exec "{sys.executable}" -c "{python}" predict "{tmp_path / "none.npy"}"'
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "AttributeError" not in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_an_output_that_is_full_is_told_from_the_files_that_are_written(tmp_path):
    python = "import sys; from bladewing.classify.cli import app, main; sys.exit(main())"
    command = [sys.executable, "-c", python, "simulate", "quadcopter", "--out", "cell"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert "standard output: No space left on device: what was to be printed is lost" in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cell.sigmf-data", "cell.sigmf-meta"]


def test_answers_that_nobody_can_read_are_an_error(tmp_path, sigmf_pair, uav_model):
    python = "import sys; from bladewing.classify.cli import main; sys.exit(main())"
    command = f'exec 1>&-; exec "{sys.executable}" -c "{python}" predict "{sigmf_pair()}" --model "{uav_model}"'
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    lost = "standard output: it is closed: what was to be printed is lost; files are written whole or not"
    assert done.stderr == f"bladewing: error: {lost}\n"
