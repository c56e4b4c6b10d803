"""The command line: what each command takes, and where its work is done."""

import json
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from bladewing.models import DEFAULT_MODEL

from .errors import BadInput, Interrupted
from .exits import complain, exit_code, mend_streams
from .files import no_empty_folder
from .limits import DWELL_S, LEAST_RECORDS
from .terminal import console

app = typer.Typer(
    name="bladewing",
    add_completion=False,
    rich_markup_mode=None,  # else the units in [brackets] are taken for markup
    context_settings={"help_option_names": ["-h", "--help"]},
)

Seed = Annotated[int | None, typer.Option(metavar="S", min=0, help="Root of all randomness.", show_default="0")]


def _path(given: str | Path) -> Path:
    """A path as it was given; an empty one (a shell's empty variable) is refused, as it would be the current folder."""
    if given == "":
        raise typer.BadParameter("it is empty: give a name")
    return Path(given)


def _path_option(metavar: str, what: str, **more: Any) -> Any:
    """An option that is a path. Its reader checks that it can be read, not typer: the reader's errors are clearer."""
    return typer.Option(metavar=metavar, parser=_path, help=what, **more)


Config = Annotated[Path | None, _path_option("FILE.toml", "Settings; the options given here come first.")]

# Arguments and options of every command over recordings.
Recordings = Annotated[
    list[Path],
    typer.Argument(
        metavar="RECORDING",
        parser=_path,
        help="SigMF (.sigmf-meta, .sigmf-data, their stem, or an archive .sigmf), .npy, .npz or .mat. "
        "One named twice is answered once.",
        show_default=False,
    ),
]
DwellS = Annotated[float, typer.Option(metavar="SECONDS", help="Length of a dwell [s].")]
MeasuredDwellS = Annotated[
    float,
    typer.Option(metavar="SECONDS", help="Length of a dwell [s]; rotors keep their rates for about 0.02 to 0.16."),
]
CarrierHz = Annotated[float | None, typer.Option(metavar="F", help="Carrier [Hz], where the file does not say.")]
PrfHz = Annotated[float | None, typer.Option(metavar="F", help="PRF [Hz], where the file does not say.")]
Variable = Annotated[
    str | None, typer.Option(metavar="NAME", help="Which array of an .npz or .mat file, if it holds several.")
]
ModelName = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|FILE",
        help="A shipped model, an .onnx file, cascade, or fast, balanced or best.",
        show_default=DEFAULT_MODEL,
    ),
]
MaxFalseAlarm = Annotated[
    float | None,
    typer.Option(
        metavar="P",
        help="Largest share of birds and clutter to be named uav, 0.001 say; sets the threshold on uav.",
        show_default=False,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object a line: one a dwell, a closing one a recording.")]


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(version("bladewing"), flush=True)
        raise typer.Exit


@app.callback()
def _before_any_command(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and stop.")
    ] = False,
) -> None:
    """Tell UAV, bird and clutter apart from a radar's slow-time returns."""


@app.command(short_help="Name what each recording holds: uav, bird, clutter, unknown.")
def predict(
    recordings: Recordings,
    model: ModelName = None,
    budget_us: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            help="Instead of a model: the most accurate one within N us a dwell (2048 pulses, in batches).",
            show_default=False,
        ),
    ] = None,
    max_false_alarm: MaxFalseAlarm = None,
    coverage: Annotated[
        float | None,
        typer.Option(
            metavar="C",
            help="Name only what a prediction set of this coverage holds alone: 0.8, 0.9, 0.95, 0.98 or 0.99.",
            show_default=False,
        ),
    ] = None,
    dwell: DwellS = DWELL_S,
    carrier_hz: CarrierHz = None,
    prf_hz: PrfHz = None,
    variable: Variable = None,
    as_json: AsJson = False,
) -> None:
    """Say of each dwell of each recording: uav, bird, clutter or unknown, with probabilities and the reason."""
    from . import predict as work
    from .envelope import dwell_length
    from .inference import Classifier
    from .recording import of_each
    from .samples import positive

    dwell_s = dwell_length(dwell, "--dwell [s]")
    rule = {"--budget-us": budget_us, "--max-false-alarm": max_false_alarm, "--coverage": coverage}
    for option, value in rule.items():
        if value is not None:
            positive(value, option)
    classifier = Classifier.load(model, budget_us=budget_us, max_false_alarm=max_false_alarm, coverage=coverage)
    if budget_us is not None:  # the choice depends on a timing made just now
        complain(
            f"the budget of {budget_us:g} us buys the model {classifier.name} now: name it for the same answers again",
            kind="note",
        )
    if classifier.operating_point is not None:
        complain(work.terms(classifier.operating_point, by_sets=coverage is not None), kind="note")
    judge = partial(work.answer, classifier=classifier, dwell_s=dwell_s)
    results = of_each(judge, recordings, carrier_hz=carrier_hz, prf_hz=prf_hz, variable=variable)
    printed = _print_each(results, lambda result: result.print(console()), as_json=as_json)
    said = Counter("" if result is None else result.track.label for result in printed)
    unreadable = said.pop("", 0)
    if not as_json and said.total() + unreadable > 1:
        print(work.summary(said, unreadable), flush=True)
    if unreadable:
        raise typer.Exit(2)


@app.command(short_help="Measure rotors: rate, tips, blades, body velocity.")
def measure(
    recordings: Recordings,
    blades: Annotated[
        int | None, typer.Option(metavar="N", help="Blades of a rotor, 1 to 64, if known.", show_default=False)
    ] = None,
    beta_deg: Annotated[
        float | None,
        typer.Option(
            metavar="B",
            help="Angle between line of sight and rotor plane [deg], 0 to below 90, if known.",
            show_default=False,
        ),
    ] = None,
    dwell: MeasuredDwellS = DWELL_S,
    plot: Annotated[
        Path | None,
        _path_option(
            "FILE.svg",
            "Draw the clearest dwell of all recordings: spectrum, comb, band, notch; replaces it.",
        ),
    ] = None,
    carrier_hz: CarrierHz = None,
    prf_hz: PrfHz = None,
    variable: Variable = None,
    as_json: AsJson = False,
) -> None:
    """Measure the rotor in each dwell, with error bars: body velocity, chopping, single rotors, band, blade."""
    from . import measure as work
    from .measure_words import print_measured
    from .measured import Measured
    from .progress import Progress
    from .recording import Recording, of_each

    settings = work.Settings.checked(dwell_s=dwell, blades=blades, beta_deg=beta_deg)
    work.checked_plot(plot)

    def measured(recording: Recording) -> Measured:
        with Progress(visible=True, passing=True) as bars:
            return work.measure_recording(recording, settings, bars)

    unreadable, clearest = 0, None
    results = of_each(measured, recordings, carrier_hz=carrier_hz, prf_hz=prf_hz, variable=variable)
    for result in _print_each(results, lambda result: print_measured(result, console()), as_json=as_json):
        if result is None:
            unreadable += 1
        else:
            clearest = result.clearer(clearest)
    if plot is not None and clearest is not None:
        clearest.write_plot(plot)
        if not as_json:
            print(f"Wrote {plot}", flush=True)
    if unreadable:
        raise typer.Exit(2)


@app.command(short_help="Train models on synthetic records.")
def train(
    out: Annotated[Path, _path_option("DIR", "Where the models and train.json go.")] = Path("out"),
    config: Config = None,
    records: Annotated[
        int | None,
        typer.Option(metavar="N", min=LEAST_RECORDS, help="Synthetic records to train on.", show_default=False),
    ] = None,
    seed: Seed = None,
    quick: Annotated[bool, typer.Option("--quick", help="Few records and epochs: a try, not a model to use.")] = False,
    data: Annotated[
        Path | None,
        _path_option("DIR", "Read the records from what `bladewing dataset` wrote, instead of drawing."),
    ] = None,
) -> None:
    """Train models on synthetic records and write them as ONNX; interrupted, the same command goes on."""
    from .parts import TRAIN_PARTS
    from .train import run_training

    with no_empty_folder(out), _goes_on(out / TRAIN_PARTS):
        run_training(out, records=records, seed=seed, quick=quick, config=config, data=data, progress=True)


@app.command(short_help="Write the records of a training to disk.")
def dataset(
    out: Annotated[
        Path, typer.Argument(metavar="OUT", parser=_path, help="Folder of the data set: new, or to be gone on with.")
    ],
    records: Annotated[
        int, typer.Option(metavar="N", min=LEAST_RECORDS, help="Records to train on; the other sets follow from it.")
    ],
    seed: Seed = None,
    config: Annotated[
        Path | None, _path_option("FILE.toml", "Settings of a training; the options given here come first.")
    ] = None,
) -> None:
    """Write the records of a training to disk; interrupted, the same command goes on."""
    from .dataset import run_dataset

    with _goes_on(out):
        run_dataset(out, records=records, seed=seed, config=config, progress=True)


@app.command(short_help="Write one self-contained ONNX graph for a radar.")
def export(
    out: Annotated[
        Path, typer.Argument(metavar="OUT.onnx", parser=_path, help="The graph to write.", show_default=False)
    ],
    carrier_hz: Annotated[float, typer.Option(metavar="F", help="Carrier [Hz].", show_default=False)],
    prf_hz: Annotated[float, typer.Option(metavar="F", help="PRF [Hz].", show_default=False)],
    pulses: Annotated[int, typer.Option(metavar="N", min=1, help="Pulses of a record.", show_default=False)],
    model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE",
            help="A shipped model, an .onnx file, fast, balanced or best: of models of one file, not the cascade.",
            show_default=DEFAULT_MODEL,
        ),
    ] = None,
    max_false_alarm: MaxFalseAlarm = None,
) -> None:
    """Write one self-contained ONNX graph for a radar: raw IQ in, probabilities and label out, onnxruntime alone."""
    from .export import export_raw_iq
    from .model_file import chosen_name
    from .predict import terms
    from .samples import positive

    if max_false_alarm is not None:
        positive(max_false_alarm, "--max-false-alarm")
    name = chosen_name(model)
    worst, point = export_raw_iq(
        out, carrier_hz=carrier_hz, prf_hz=prf_hz, pulses=pulses, model=name, max_false_alarm=max_false_alarm
    )
    graph = f"iq (batch, {pulses}, 2) to probabilities and label"
    print(f"Wrote {out}: {graph}, within {worst:.0e} of predict --model {name} on a few signals", flush=True)
    if point is not None:
        complain(terms(point), kind="note")


@app.command(short_help="Measure models on fresh records: what each choice costs.")
def report(
    out: Annotated[Path, _path_option("DIR", "Where report.html and report.json go.")] = Path("out"),
    quick: Annotated[bool, typer.Option("--quick", help="Fewer records and shorter timings.")] = False,
    models: Annotated[
        Path | None, _path_option("DIR", "Folder of .onnx files.", show_default="the shipped models")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(metavar="S", min=0, help="Root seed of the test records.", show_default="0")
    ] = None,
    config: Config = None,
) -> None:
    """Measure models on fresh synthetic records: what each choice costs; interrupted, the same command goes on."""
    from .parts import REPORT_PARTS
    from .report.run import run_report

    with no_empty_folder(out), _goes_on(out / REPORT_PARTS):
        run_report(out, models=models, quick=quick, seed=seed, config=config, progress=True)


@app.command(short_help="Render a scene to a SigMF recording.")
def simulate(
    scene: Annotated[
        str,
        typer.Argument(metavar="SCENE.toml", help="A scene file, or the name of a shipped scene.", show_default=False),
    ],
    out: Annotated[Path | None, _path_option("NAME", "The recording: NAME.sigmf-data and NAME.sigmf-meta.")] = None,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Root of all randomness.")] = 0,
    explain: Annotated[
        bool,
        typer.Option(
            "--explain", help="Say what the scene requires, what is left out and why; without --out that is all."
        ),
    ] = False,
    tolerance_db: Annotated[
        float,
        typer.Option(
            metavar="DB", help="Error energy over the dwell, over a sample's noise [dB]; at -10 nobody can tell."
        ),
    ] = -10.0,
    full: Annotated[bool, typer.Option("--full", help="Leave nothing out.")] = False,
) -> None:
    """Render a scene to a SigMF recording with the truth in its annotations."""
    from bladewing.simulate.render import render
    from bladewing.simulate.scene import Scene, SceneError

    from .progress import Progress
    from .scene_recording import write_rendering

    if out is None and not explain:
        raise BadInput("nothing to do: give --out NAME for a recording, or --explain")
    if tolerance_db != tolerance_db:
        raise BadInput(f"--tolerance-db is {tolerance_db}: it must be a number [dB]")
    try:
        found = Scene.load(scene)
    except SceneError as error:
        for problem in error.problems[:-1]:
            complain(problem)
        raise BadInput(error.problems[-1]) from None
    told = found.warnings()
    for warning in told:
        complain(f"{scene}: {warning}", kind="warning")
    plan = None if full else found.plan(seed, tolerance_db=tolerance_db)
    said = [plan.explain() if plan else "full fidelity: nothing is left out"] if explain else []
    try:
        if out is not None:
            parts = len(found.uavs) + len(found.birds) + len(found.clutters) + 1  # the receiver is one more
            with Progress(visible=True, passing=True) as bars, bars.phase("render", parts) as on_part:
                rendering = render(found, seed, plan=plan, on_part=on_part)
            for warning in rendering.warnings[len(told) :]:  # those found only while rendering
                complain(f"{scene}: {warning}", kind="warning")
            said += [str(path) for path in write_rendering(out, rendering, found, seed)]
    finally:  # printed last: who reads only the first line and closes the pipe has the recording too
        if said:
            print("\n".join(said), flush=True)


@app.command(short_help="Take every stage to its extremes.")
def stability(
    out: Annotated[Path, _path_option("DIR", "Where stability.json, .md and .html go.")] = Path("out"),
    quick: Annotated[bool, typer.Option("--quick", help="Leave out what takes minutes.")] = False,
) -> None:
    """Take every stage to its extremes: errors against a more precise oracle, and the guard that acts there."""
    from .stability import run_stability

    with no_empty_folder(out):
        run_stability(out, quick=quick, progress=True)


@app.command(short_help="Make the paper's tables again.")
def tables(
    out: Annotated[Path, _path_option("DIR", "Where tables.md and tables.json go.")] = Path("out"),
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Root of the scenes' noise.")] = 0,
) -> None:
    """Make the paper's tables again: its theory and measurements beside those of this product."""
    from .tables import markdown, run_tables

    with no_empty_folder(out):
        made = run_tables(out, seed)
    print(markdown(made), flush=True)
    print(f"Wrote {out / 'tables.md'} and {out / 'tables.json'}", flush=True)


def _print_each(results: Iterable[Any], show: Callable[[Any], None], *, as_json: bool) -> Iterator[Any]:
    """Print the result of each recording as it comes, and pass it on; None where the recording is bad."""
    for result in results:
        if isinstance(result, BadInput):
            complain(str(result))
            yield None
            continue
        if as_json:
            for line in result.json_objects():
                print(json.dumps(line, allow_nan=False))
        else:
            show(result)
        sys.stdout.flush()
        yield result


@contextmanager
def _goes_on(kept: Path) -> Iterator[None]:
    """Context of a long run whose finished parts lie in a folder: if Ctrl-C stops it, the error says how to go on."""
    try:
        yield
    except KeyboardInterrupt:
        if not kept.is_dir() or not any(kept.iterdir()):
            raise
        raise Interrupted(f"what is done is kept in {kept}: the same command goes on") from None


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments
        Without the program's name; by default those of the process.

    Returns
    -------
    int
        0 done, 1 unexpected, 2 bad input, 130 interrupted.
    """
    mend_streams()
    if arguments is None and not sys.warnoptions:
        warnings.simplefilter("ignore")  # a library's warning is for developers, unless one asks for it with -W
    return exit_code(lambda: typer.main.get_command(app).main(arguments, prog_name="bladewing", standalone_mode=False))


if __name__ == "__main__":
    sys.exit(main())
