"""The seal: any change of a byte is refused, and nothing but a sealed model passes."""

import subprocess
import sys

import onnx
import onnxruntime
import pytest
from bladewing.models.export import attach_metadata
from bladewing.models.seal import PLACEHOLDER, SEAL_KEY, seal, verify
from hypothesis import given
from hypothesis import strategies as st
from onnx import TensorProto, helper


def _model() -> bytes:
    tensors = [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", 3]) for name in ("features", "scores")]
    graph = helper.make_graph([helper.make_node("Identity", ["features"], ["scores"])], "g", tensors[:1], tensors[1:])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    return bytes(model.SerializeToString())


UNSEALED = attach_metadata(_model(), {"product": "bladewing", "name": "test"})
SEALED = seal(UNSEALED)


def test_sealing_changes_the_64_characters_alone_and_the_model_still_runs():
    digest = verify(SEALED)
    assert len(digest) == 64
    assert SEALED.replace(digest.encode(), PLACEHOLDER.encode()) == UNSEALED
    metadata = onnxruntime.InferenceSession(SEALED).get_modelmeta().custom_metadata_map
    assert metadata == {"product": "bladewing", "name": "test", SEAL_KEY: digest}


@given(position=st.integers(0, len(SEALED) - 1), flip=st.integers(1, 255))
def test_any_changed_byte_is_refused(position, flip):
    changed = bytearray(SEALED)
    changed[position] ^= flip
    with pytest.raises(ValueError, match=r"altered after it was written|not a bladewing model"):
        verify(bytes(changed))


def test_every_changed_lowest_bit_is_refused():
    for position in range(len(SEALED)):
        changed = bytearray(SEALED)
        changed[position] ^= 1
        with pytest.raises(ValueError, match=r"altered after it was written|not a bladewing model"):
            verify(bytes(changed))


@given(keep=st.integers(0, len(SEALED) - 1), extra=st.binary(min_size=1, max_size=40))
def test_a_cut_or_lengthened_file_is_refused(keep, extra):
    for changed in (SEALED[:keep], SEALED + extra, extra + SEALED):
        with pytest.raises(ValueError, match=r"altered after it was written|not a bladewing model"):
            verify(changed)


@given(st.binary(max_size=200))
def test_other_files_are_no_bladewing_models(content):
    with pytest.raises(ValueError, match="not a bladewing model"):
        verify(content)


def test_a_model_without_a_seal_is_refused():
    with pytest.raises(ValueError, match="altered after it was written"):
        verify(UNSEALED)
    with pytest.raises(ValueError, match="not a bladewing model"):
        seal(_model())


def test_a_second_seal_is_refused():
    with pytest.raises(ValueError, match="sealed already"):
        seal(SEALED)


def test_a_second_seal_entry_is_refused():
    model = onnx.load_model_from_string(SEALED)
    model.metadata_props.add(key=SEAL_KEY, value=PLACEHOLDER)
    with pytest.raises(ValueError, match="2 seals"):
        verify(model.SerializeToString())


def test_metadata_are_strings():
    with pytest.raises(ValueError, match="'classes' is list"):
        attach_metadata(_model(), {"classes": ["uav"]})  # type: ignore[dict-item]


def test_the_seal_needs_no_training_library():
    code = (
        "import sys, bladewing.models, bladewing.models.seal; "
        "print([m for m in ('torch', 'sklearn', 'onnx', 'skl2onnx', 'scipy') if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"
