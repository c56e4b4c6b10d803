"""What a model says of families it was not trained on, as in the report but of any model and number of records.

Run: python tests/benchmarks/family_table.py [--records N] [--model NAME].
"""

import argparse

from bladewing.classify.report.families import MODEL, left_out
from bladewing.classify.training_config import TrainingConfig
from bladewing.models import LADDER


def main() -> None:
    """Write the table to the terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=30_000, help="training records before a family is taken out")
    choices = [name for name, rung in LADDER.items() if "image" not in rung.inputs]
    parser.add_argument("--model", choices=choices, default=MODEL)
    options = parser.parse_args()
    settings = TrainingConfig(records=options.records, seed=3, epochs=8)  # few epochs: eight models are trained
    found = left_out(settings, options.model)
    print(
        f"{found['model']}, {found['train_records']} training records, {found['test_records']} test records; "
        "shares of the family's records"
    )
    print(
        f"{'':16s} {'n':>6s} | accuracy with  without  fall | unknown with  without | wrong with  without | "
        "ECE with  without"
    )
    for row in found["families"]:
        a, b = row["kept"], row["left_out"]
        accuracy, unknown, wrong = ([one[key]["value"] for one in (a, b)] for key in ("accuracy", "unknown", "wrong"))
        print(
            f"{row['name']:16s} {row['records']:6d} | {accuracy[0]:13.3f} {accuracy[1]:8.3f} "
            f"{accuracy[0] - accuracy[1]:5.3f} | {unknown[0]:12.3f} {unknown[1]:8.3f} | "
            f"{wrong[0]:10.3f} {wrong[1]:8.3f} | {a['calibration_error']:8.3f} {b['calibration_error']:8.3f}"
        )


if __name__ == "__main__":
    main()
