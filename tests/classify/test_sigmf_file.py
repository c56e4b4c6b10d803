import bz2
import gzip
import hashlib
import json
import lzma
import re
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from bladewing.classify.errors import BadInput
from bladewing.classify.recording import load_recording
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from .conftest import CARRIER_HZ, PRF_HZ

MEASURED = Path(__file__).parents[2].parent / "shared" / "recordings"


def capture(start=0, frequency=CARRIER_HZ, **more):
    said = {"core:sample_start": start, "core:frequency": frequency} | more
    return {key: value for key, value in said.items() if value is not None}


def test_a_recording_says_its_carrier_prf_and_samples(sigmf_pair):
    iq = np.arange(100).astype(np.complex64) * (1 + 2j)
    recording = load_recording(sigmf_pair(iq=iq))
    np.testing.assert_array_equal(recording.iq, iq)
    assert (recording.carrier_hz, recording.prf_hz, recording.start_s) == (CARRIER_HZ, PRF_HZ, 0.0)


@pytest.mark.parametrize(
    ("datatype", "stored", "full_scale"),
    [
        ("ci16_le", "<i2", 2**15),
        ("ci16_be", ">i2", 2**15),
        ("ci8", "i1", 2**7),
        ("ci32_le", "<i4", 2**31),
        ("cf64_le", "<f8", 1),
        ("cf32_be", ">f4", 1),
    ],
)
def test_other_sample_types_are_scaled_to_one(sigmf_pair, datatype, stored, full_scale):
    parts = np.array([0, -1, 1, 0, -0.5, 0.25, 0.5, -0.75])
    parts = np.clip(parts * full_scale, -full_scale, full_scale - 1 if full_scale > 1 else 1)
    recording = load_recording(sigmf_pair(data=parts.astype(stored).tobytes(), datatype=datatype))
    expected = (parts / full_scale).astype(np.float32).view(np.complex64)
    np.testing.assert_allclose(recording.iq, expected, rtol=1e-7)
    assert recording.iq.dtype == np.dtype(np.complex64)


@pytest.mark.parametrize(("datatype", "stored", "middle"), [("cu8", "u1", 2**7), ("cu16_le", "<u2", 2**15)])
def test_unsigned_samples_are_centred(sigmf_pair, datatype, stored, middle):
    parts = np.array([middle, 0, 2 * middle - 1, middle])
    iq = load_recording(sigmf_pair(data=parts.astype(stored).tobytes(), datatype=datatype)).iq
    np.testing.assert_allclose(iq, [0 - 1j, (middle - 1) / middle], rtol=1e-7)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"datatype": "rf32_le"}, r"real samples \(core:datatype rf32_le\): IQ must be complex"),
        ({"datatype": "ri16_le"}, "real samples"),
        ({"datatype": None}, "core:datatype is missing: it must be the SigMF type of the samples, such as 'cf32_le'"),
        ({"datatype": "complex64"}, "core:datatype is 'complex64'"),
        ({"datatype": 5}, "core:datatype is 5"),
        ({"sample_rate": None}, r"no PRF \(SigMF core:sample_rate\): give prf_hz="),
        ({"sample_rate": 0}, r"core:sample_rate \(the PRF\) \[Hz\] is 0: it must be a finite number above 0"),
        ({"sample_rate": -1.0}, "core:sample_rate .* is -1"),
        ({"sample_rate": "20 kHz"}, "core:sample_rate .* is '20 kHz': it must be a number above 0"),
        ({"sample_rate": True}, "core:sample_rate .* is True"),
        ({"sample_rate": float("nan")}, "core:sample_rate .* is nan"),
        ({"sample_rate": 10**400}, "core:sample_rate .* is inf"),
        ({"captures": []}, r"no carrier \(SigMF core:frequency\): give carrier_hz="),
        ({"captures": [capture(frequency=None)]}, r"no carrier .*give carrier_hz="),
        ({"captures": [capture(frequency=[9e9])]}, r"captures\[0\] core:frequency .* is \[9000000000.0\]"),
        ({"captures": [capture(), capture(2000, 9e9)]},
         r"2 carriers \(captures\[0\] 10000000000 Hz, captures\[1\] 9000000000 Hz\): store each one"),
        ({"captures": {}}, "'captures' must be a list of objects"),
        ({"captures": [3]}, "'captures' must be a list of objects"),
        ({"captures": [capture("0")]}, r"captures\[0\]: core:sample_start is '0'"),
        ({"captures": [capture(10**400)], "offset": 10**400}, "is of 1329 bits: it must be .* below 2"),
        ({"captures": [capture(-(10**400))]}, "core:sample_start is of 1329 bits"),
        ({"captures": [capture(5000)]}, r"cut short: captures\[0\] speaks of 5000 samples, the data hold 4000"),
        ({"captures": [capture(0)], "offset": 100}, "starts at sample 0, before core:offset 100"),
        ({"annotations": [{"core:sample_start": 1000, "core:sample_count": 3001}]},
         r"cut short: annotations\[0\] speaks of 4001 samples, the data hold 4000: copy it again"),
        ({"annotations": [{"core:sample_start": 0, "core:sample_count": 0.5}]}, "core:sample_count is 0.5"),
        ({"num_channels": 2}, r"2 channels \(core:num_channels\): a recording is one range cell"),
        ({"num_channels": 0}, "0 channels"),
        ({"captures": [capture(0, **{"core:header_bytes": 16})]}, "header_bytes or core:trailing_bytes above 0"),
        ({"trailing_bytes": 8}, "core:header_bytes or core:trailing_bytes above 0"),
        ({"dataset": "../other.bin"}, r"core:dataset names a file that is not SigMF \('../other.bin'\)"),
        ({"sha512": "0" * 128}, "altered or damaged: the SHA-512 of its samples is not the one in core:sha512"),
        ({"data": b""}, r"no samples, its data are empty \(0 bytes\)"),
        ({"data": bytes(8 * 100 + 3)}, "cut short: 803 bytes of data are not a whole number of cf32_le samples"),
        ({"data": np.array([1, 2, np.nan], dtype=np.complex64).tobytes()}, "sample 2 is .*nan.*must be finite"),
    ],
)  # fmt: skip
def test_bad_recordings_are_refused_in_one_line(sigmf_pair, change, said):
    with pytest.raises(BadInput) as caught:
        load_recording(sigmf_pair(**change))
    message = str(caught.value)
    assert re.search(said, message), message
    assert "rec.sigmf-" in message
    assert "\n" not in message


def test_one_altered_byte_is_found_by_the_hash(sigmf_pair):
    import hashlib

    data = np.arange(200, dtype=np.complex64).tobytes()
    meta = sigmf_pair(data=data, sha512=hashlib.sha512(data).hexdigest())
    assert load_recording(meta).iq.size == 200
    meta.with_suffix(".sigmf-data").write_bytes(data[:-1] + b"\x01")
    with pytest.raises(BadInput, match=r"rec\.sigmf-data: altered or damaged"):
        load_recording(meta)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", r"the file is empty \(0 bytes\)"),
        (" ", "not JSON"),
        ("{", "not JSON"),
        ("[" * 100_000, "nested too deep"),
        ('{"global": ' + "9" * 6000 + "}", "a number in it has thousands of digits"),
        ("[]", "no 'global' object"),
        ('{"global": []}', "no 'global' object"),
        ('{"captures": []}', "no 'global' object"),
        ("\xff", "not JSON"),
        (
            '{"global": {"core:sample_rate": 1.0, "core:sample_rate": 2.0}}',
            "core:sample_rate is said twice, 1.0 and 2.0",
        ),
    ],
)
def test_bad_metadata(sigmf_pair, text, said):
    meta = sigmf_pair()
    meta.write_bytes(text.encode("latin-1"))
    with pytest.raises(BadInput, match=said):
        load_recording(meta)


def test_options_fill_in_what_is_missing(sigmf_pair):
    recording = load_recording(sigmf_pair(captures=[], sample_rate=None), carrier_hz=9e9, prf_hz=5e3)
    assert (recording.carrier_hz, recording.prf_hz) == (9e9, 5e3)


def test_an_option_that_repeats_the_file_is_fine_and_one_that_contradicts_it_is_not(sigmf_pair):
    meta = sigmf_pair()
    assert load_recording(meta, carrier_hz=CARRIER_HZ, prf_hz=PRF_HZ).prf_hz == PRF_HZ
    with pytest.raises(BadInput, match=r"carrier 9000000000 Hz given, .*file says 10000000000 Hz"):
        load_recording(meta, carrier_hz=9e9)
    with pytest.raises(BadInput, match=r"PRF 20001 Hz given, .*file says 20000 Hz"):
        load_recording(meta, prf_hz=20001.0)


def test_a_variable_has_no_meaning(sigmf_pair):
    with pytest.raises(BadInput, match="variable 'x' given"):
        load_recording(sigmf_pair(), variable="x")


def test_captures_that_agree_are_one_recording(sigmf_pair):
    recording = load_recording(sigmf_pair(captures=[capture(), capture(1000), capture(2000, None)]))
    assert (recording.iq.size, recording.carrier_hz) == (4000, CARRIER_HZ)


def test_offset_and_the_first_capture_set_the_start(sigmf_pair):
    iq = np.arange(1, 101).astype(np.complex64)
    recording = load_recording(sigmf_pair(iq=iq, captures=[capture(1010)], offset=1000))
    np.testing.assert_array_equal(recording.iq, iq[10:])
    assert recording.start_s == pytest.approx(1010 / PRF_HZ)


@pytest.mark.parametrize("gone", [".sigmf-meta", ".sigmf-data"])
@pytest.mark.parametrize("asked", [".sigmf-meta", ".sigmf-data", ""])
def test_half_a_recording_says_which_half_is_missing(sigmf_pair, gone, asked):
    meta = sigmf_pair()
    meta.with_suffix(gone).unlink()
    with pytest.raises(BadInput, match=f"rec{gone} are missing: a SigMF recording is both files"):
        load_recording(meta.with_suffix(asked))


@pytest.mark.parametrize("moved", [[], [".sigmf-data"], [".sigmf-meta"]])
def test_a_pair_whose_writer_was_killed_once_it_had_decided_is_read_whole(sigmf_pair, tmp_path, moved):
    old, new = sigmf_pair(), sigmf_pair("new", np.ones(300, np.complex64))
    renames = {}
    for suffix in (".sigmf-data", ".sigmf-meta"):
        beside = tmp_path / f".bladewing-{suffix[7:]}.new"
        new.with_suffix(suffix).rename(beside)
        renames[beside.name] = f"rec{suffix}"
    for suffix in moved:
        (tmp_path / f".bladewing-{suffix[7:]}.new").rename(old.with_suffix(suffix))
    (tmp_path / ".bladewing-pending.json").write_text(json.dumps(renames))
    np.testing.assert_array_equal(load_recording(old).iq, np.ones(300))


def test_a_collection_is_refused(tmp_path):
    with pytest.raises(BadInput, match="collection of recordings: name the recordings themselves"):
        load_recording(tmp_path / "all.sigmf-collection")


@pytest.mark.parametrize("suffix", [".sigmf", ".sigmf.gz", ".sigmf.xz", ".sigmf.zip"])
def test_archives_are_read_like_pairs(sigmf_pair, tmp_path, suffix):
    import sigmf

    meta = sigmf_pair()
    archive = tmp_path / f"packed{suffix}"
    sigmf.fromfile(meta).archive(str(archive))
    one, other = load_recording(meta), load_recording(archive)
    np.testing.assert_array_equal(one.iq, other.iq)
    assert (one.carrier_hz, one.prf_hz) == (other.carrier_hz, other.prf_hz)
    archive.write_bytes(archive.read_bytes()[: archive.stat().st_size // 2])
    with pytest.raises(BadInput, match=f"packed{suffix}: not a readable SigMF recording"):
        load_recording(archive)


def packed(meta: Path) -> Path:
    """Put a pair into an archive beside it."""
    archive = meta.with_name("packed.sigmf")
    with tarfile.open(archive, "w") as file:
        for path in (meta, meta.with_suffix(".sigmf-data")):
            file.add(path, f"rec/{path.name}")
    return archive


@pytest.mark.parametrize(("suffix", "pack"), [(".gz", gzip.compress), (".xz", lzma.compress), (".bz2", bz2.compress)])
def test_an_archive_of_several_streams_is_read_whole(sigmf_pair, suffix, pack):
    """As packers that use several processors write them."""
    meta = sigmf_pair()
    whole = packed(meta).read_bytes()
    # the library reads .bz2 by what is inside, whatever the name says
    archive = meta.with_name(f"streams.sigmf{'' if suffix == '.bz2' else suffix}")
    archive.write_bytes(b"".join(pack(whole[at : at + 10_000]) for at in range(0, len(whole), 10_000)))
    np.testing.assert_array_equal(load_recording(archive).iq, load_recording(meta).iq)


def test_the_hash_may_be_of_either_case(sigmf_pair):
    meta = sigmf_pair()
    text = meta.read_text()
    digest = hashlib.sha512(meta.with_suffix(".sigmf-data").read_bytes()).hexdigest()
    for told in (digest, digest.upper(), digest[::-1]):
        meta.write_text(text.replace('"core:version"', f'"core:sha512": "{told}", "core:version"'))
        if told == digest[::-1]:
            with pytest.raises(BadInput, match="altered or damaged"):
                load_recording(meta)
        else:
            assert load_recording(meta).iq.size == 4000


def test_an_undeclared_namespace_in_an_archive_is_no_ones_trouble(sigmf_pair):
    meta = sigmf_pair()  # the library warns of it, and a warning is an error here
    meta.write_text(meta.read_text().replace('"core:version"', '"mine:note": "x", "core:version"'))
    assert load_recording(packed(meta)).iq.size == 4000


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["a.sigmf-meta", "a.sigmf-data", "b.sigmf-meta", "b.sigmf-data"], "holds 2 files .sigmf-meta and 2 files"),
        (["a.sigmf-meta", "b.sigmf-data"], "a.sigmf-meta and b.sigmf-data are not one recording"),
        (["a.sigmf-meta"], "holds 1 files .sigmf-meta and 0 files .sigmf-data"),
        (["notes.txt"], "holds 0 files .sigmf-meta and 0 files .sigmf-data"),
    ],
)
@pytest.mark.parametrize("kind", ["tar", "zip"])
def test_an_archive_holds_one_recording(sigmf_pair, tmp_path, names, said, kind):
    meta = sigmf_pair()
    files = {name: meta if name.endswith("meta") else meta.with_suffix(".sigmf-data") for name in names}
    path = tmp_path / ("packed.sigmf" if kind == "tar" else "packed.sigmf.zip")
    if kind == "tar":
        with tarfile.open(path, "w") as archive:
            for name, file in files.items():
                archive.add(file, name)
    else:
        with zipfile.ZipFile(path, "w") as archive:
            for name, file in files.items():
                archive.write(file, name)
    with pytest.raises(BadInput, match=said.replace(".", r"\.")):
        load_recording(path)


def test_archives_obey_the_same_rules(sigmf_pair):
    archive = packed(sigmf_pair(datatype="rf32_le"))
    with pytest.raises(BadInput, match=r"packed.sigmf: real samples"):
        load_recording(archive)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)
FIELDS = st.sampled_from(
    ["datatype", "sample_rate", "num_channels", "offset", "sha512", "dataset", "metadata_only", "extensions", "version"]
)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(field=FIELDS, value=JSON, where=st.sampled_from(["global", "captures", "annotations"]), entry=JSON)
def test_whatever_the_metadata_hold_the_answer_is_a_recording_or_bad_input(sigmf_pair, field, value, where, entry):
    meta = sigmf_pair(iq=np.ones(100, dtype=np.complex64), **{field: value})
    metadata = json.loads(meta.read_text())
    if where == "global":
        metadata["global"]["core:sample_rate"] = entry
    else:
        metadata[where] = [entry, {"core:sample_start": entry, "core:frequency": entry, "core:sample_count": entry}]
    meta.write_text(json.dumps(metadata))
    try:
        recording = load_recording(meta)
    except BadInput:
        return
    assert recording.iq.ndim == 1
    assert np.isfinite([recording.carrier_hz, recording.prf_hz]).all()


def test_the_measured_recordings_read_as_described():
    if not MEASURED.is_dir():
        pytest.skip("the measured recordings are not part of the repository")
    metas = sorted(MEASURED.glob("*.sigmf-meta"))
    assert metas
    for meta in metas:
        recording, said = load_recording(meta), json.loads(meta.read_text())
        assert recording.iq.size == said["annotations"][0]["core:sample_count"]
        assert recording.prf_hz == said["global"]["core:sample_rate"]
        assert recording.carrier_hz == said["captures"][0]["core:frequency"]


def test_a_hole_between_captures_is_refused_and_the_first_index_is_the_start(sigmf_pair):
    index = "core:global_index"
    whole = [capture(0, **{index: 500}), capture(3, **{index: 503})]
    assert load_recording(sigmf_pair(captures=whole)).start_s == pytest.approx(500 / PRF_HZ)
    with pytest.raises(BadInput, match="997 samples are missing between captures"):
        load_recording(sigmf_pair(captures=[whole[0], capture(3, **{index: 1500})]))
    with pytest.raises(BadInput, match=r"captures\[1\] begins 2 samples before captures\[0\] ends"):
        load_recording(sigmf_pair(captures=[whole[0], capture(3, **{index: 501})]))
    between = [whole[0], capture(2), capture(3, **{index: 1500})]
    with pytest.raises(BadInput, match=r"997 samples are missing between captures\[0\] and captures\[2\]"):
        load_recording(sigmf_pair(captures=between))
    with pytest.raises(BadInput, match="they must follow one another"):
        load_recording(sigmf_pair(captures=[capture(3), capture(0)]))
    with pytest.raises(BadInput, match="must be a whole number"):
        load_recording(sigmf_pair(captures=[capture(0, **{index: "1"})]))


@pytest.mark.parametrize(
    ("times", "hole"),
    [
        (("2026-01-01T00:00:00.000Z", "2026-01-01T00:00:00.003Z"), False),
        (("2026-01-01T00:00:00.000Z", "2026-01-01T00:00:10.000Z"), True),
        (("2026-01-01T00:00:00.00Z", "2026-01-01T00:00:00.5Z"), True),
        (("2026-01-01T00:00:00Z", "2026-01-01T00:00:01Z"), False),  # of whole seconds they may be one apart
        (("2026-01-01T00:00:00", "2026-01-01T00:00:10Z"), True),
        (("2026-01-01T00:00:10.000Z", "2026-01-01T00:00:00.000Z"), True),
        (("2026-01-01T00:00:01Z", "2026-01-01T00:00:00Z"), False),
        (("2026-01-01T00:00:00Z", "2026-01-01T00:00:00.900Z"), False),  # one of them is rounded
        (("2026-01-01T00:00:00.900Z", "2026-01-01T00:00:00Z"), False),
        (("2026-01-01T00:00:00.000", "2026-01-01T00:00:00.003Z"), False),  # without a zone it is UTC
        (("2026-01-01T02:00:00.000+02:00", "2026-01-01T00:00:00.003Z"), False),
        (("yesterday", "2026-01-01T00:00:10Z"), False),
        ((None, "2026-01-01T00:00:10Z"), False),
    ],
)
def test_captures_between_which_time_went_by_are_refused(sigmf_pair, times, hole):
    captures = [
        capture(start, **({"core:datetime": time} if time else {})) for start, time in zip((0, 3), times, strict=True)
    ]
    path = sigmf_pair(captures=captures)
    if not hole:
        load_recording(path)
        return
    with pytest.raises(BadInput, match=r"captures\[1\] is dated .* s after captures\[0\] .*: store each run in a rec"):
        load_recording(path)


@pytest.mark.parametrize(("time", "hole"), [("50:00", False), ("50:02", False), ("49:58", False), ("50:04", True)])
def test_a_clock_may_be_off_by_a_thousandth_of_the_time_between_captures(sigmf_pair, time, hole):
    dated = [(0, "2026-01-01T00:00:00.000Z"), (3000, f"2026-01-01T00:{time}.000Z")]  # 50 minutes of samples at 1 Hz
    path = sigmf_pair(captures=[capture(start, **{"core:datetime": at}) for start, at in dated], sample_rate=1.0)
    if not hole:
        assert load_recording(path).iq.size == 4000
        return
    with pytest.raises(BadInput, match=r"captures\[1\] is dated 3004 s after captures\[0\]"):
        load_recording(path)


def test_time_that_went_by_shows_across_a_capture_without_one(sigmf_pair):
    first, last = ({"core:datetime": f"2026-01-01T00:{minute}:00.000Z"} for minute in ("00", "10"))
    with pytest.raises(BadInput, match=r"captures\[2\] is dated 600 s after captures\[0\]"):
        load_recording(sigmf_pair(captures=[capture(0, **first), capture(2), capture(3, **last)]))
