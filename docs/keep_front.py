"""Take out of models/pretrained the teacher and what another beats in accuracy at less cost: python docs/keep_front.py.

`train.json` keeps the accounts of all, so that the front can be read there.
"""

import json
from pathlib import Path

from bladewing.classify.ladder import CASCADE, STAGES_KEY, front

PRETRAINED = Path(__file__).parents[1] / "models" / "pretrained"


def main() -> None:
    """Remove the files."""
    told = json.loads((PRETRAINED / "train.json").read_text(encoding="utf-8"))
    kept = {name for name, _ in front(told["models"])}
    if told[CASCADE]:
        kept |= set(told[CASCADE][STAGES_KEY])
    beaten = [file for file in PRETRAINED.glob("*.onnx") if file.stem not in kept]
    for file in beaten:
        file.unlink()
        print(f"took out {file.stem}")
    if not beaten:
        print("nothing to take out")


if __name__ == "__main__":
    main()
