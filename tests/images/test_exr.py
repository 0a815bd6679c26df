"""OpenEXR files: exact there and back, and nothing damaged passes in silence."""

import os
import resource
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from nightly import examples
from patience import PATIENCE_S

from lightpaint.errors import ImageError, OutputError
from lightpaint.images.formats.exr import ExrPart, read_parts, rgb_channels, write_parts, write_rgb

# What a header's text may hold: anything but NUL, which ends it.
TEXT = st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1, max_size=20)
SIZES = st.tuples(st.integers(1, 9), st.integers(1, 9))
TYPES = st.sampled_from([np.float16, np.float32, np.uint32])


@st.composite
def _parts(draw: Any) -> list[ExrPart]:
    parts = []
    # All parts of one file share a display window, so that their sizes agree.
    size = draw(SIZES)
    for name in draw(st.lists(TEXT, min_size=1, max_size=3, unique=True)):
        channels = {
            channel: draw(hnp.arrays(draw(TYPES), size))
            for channel in draw(st.lists(TEXT, min_size=1, max_size=4, unique=True))
        }
        keys = TEXT.map(lambda text: f"lightpaint.{text}")
        parts.append(ExrPart(name, channels, draw(st.dictionaries(keys, TEXT, max_size=3))))
    return parts


@given(parts=_parts())
@settings(max_examples=examples(20, 60))
def test_there_and_back_is_exact(tmp_path_factory: pytest.TempPathFactory, parts: list[ExrPart]):
    path = tmp_path_factory.getbasetemp() / "parts.exr"
    write_parts(path, parts)
    reread = read_parts(path)
    assert [p.name for p in reread] == [p.name for p in parts]
    for actual, expected in zip(reread, parts, strict=True):
        assert actual.size == expected.size
        assert actual.attributes.items() >= expected.attributes.items()
        assert set(actual.channels) == set(expected.channels)
        for name, pixels in expected.channels.items():
            assert actual.channels[name].dtype == pixels.dtype
            # To the bit: NaN and the sign of zero are part of it.
            assert actual.channels[name].tobytes() == pixels.tobytes()


def test_other_programs_read_what_we_write(tmp_path: Path):
    image = np.random.default_rng(0).random((5, 7, 3)).astype(np.float32)
    write_rgb(tmp_path / "a.exr", image, attributes={"comments": "evening"})
    part = OpenEXR.File(str(tmp_path / "a.exr")).parts[0]
    assert part.header["comments"] == "evening"
    np.testing.assert_array_equal(part.channels["RGB"].pixels, image)


def test_rgb_of_layers(tmp_path: Path):
    image = np.random.default_rng(0).random((4, 3, 3)).astype(np.float32)
    channels = rgb_channels(image) | rgb_channels(-image, "noise")
    write_parts(tmp_path / "a.exr", [ExrPart("p", channels)])
    part = read_parts(tmp_path / "a.exr")[0]
    np.testing.assert_array_equal(part.rgb(), image)
    np.testing.assert_array_equal(part.rgb("noise"), -image)
    assert part.rgb("noise").dtype == np.float32
    with pytest.raises(ImageError, match=r"no channel x\.R, x\.G, x\.B .* has B, G, R, noise\.B"):
        part.rgb("x")


def _write_kind(path: Path, kind: str) -> bytes:
    """A file of `kind`. Its pixels do not compress to nothing."""
    rgb = {c: np.random.default_rng(1).random((33, 21)).astype(np.float32) for c in "RGB"}
    if kind == "parts":
        write_parts(path, [ExrPart("a", rgb), ExrPart("b", rgb)])
    elif kind == "tiles":
        header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
        OpenEXR.File(header, rgb).write(str(path))
    else:
        header = {"type": OpenEXR.scanlineimage, "compression": getattr(OpenEXR, kind)}
        OpenEXR.File(header, rgb).write(str(path))
    assert read_parts(path)[0].size == (33, 21)
    return path.read_bytes()


@pytest.mark.nightly
@pytest.mark.parametrize(
    "kind", ["parts", "tiles", "NO_COMPRESSION", "ZIP_COMPRESSION", "PIZ_COMPRESSION"]
)
def test_a_cut_off_file_is_refused_quietly(
    tmp_path: Path, kind: str, capfd: pytest.CaptureFixture[str]
):
    path = tmp_path / "cut.exr"
    content = _write_kind(path, kind)
    offsets = {*range(0, len(content), len(content) // 60), *range(len(content) - 5, len(content))}
    for length in sorted(offsets):
        path.write_bytes(content[:length])
        with pytest.raises(ImageError, match=r"cut\.exr"):
            read_parts(path)
    assert capfd.readouterr() == ("", "")


def test_damage_is_an_image_error_or_harmless(tmp_path: Path):
    path = tmp_path / "damaged.exr"
    content = _write_kind(path, "parts")
    rng = np.random.default_rng(0)
    refusals = 0
    for _ in range(150):
        damaged = bytearray(content)
        # Three in four of the places lie in the headers.
        end = len(content) if rng.random() < 0.25 else 700
        damaged[rng.integers(end)] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            read_parts(path)
        except ImageError:
            refusals += 1
    assert refusals > 20


def test_the_terminal_is_given_back(tmp_path: Path, capfd: pytest.CaptureFixture[str]):
    path = tmp_path / "cut.exr"
    path.write_bytes(_write_kind(path, "parts")[:-1])
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        with pytest.raises(ImageError):
            read_parts(path)
    assert len(os.listdir("/proc/self/fd")) == before
    os.write(1, b"out")
    os.write(2, b"err")
    assert capfd.readouterr() == ("out", "err")


@pytest.mark.nightly
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- 2>&-", "<&- >&- 2>&-"])
def test_reading_without_a_terminal(tmp_path: Path, closed: str):
    """Services start programs so; `sys.stdout` is None then. What is open stays as it was."""
    write_rgb(tmp_path / "a.exr", np.ones((2, 3, 3)))
    code = """
import os, sys
from pathlib import Path
from lightpaint.images.formats.exr import read_headers, read_parts

def standard():
    return [os.readlink(f"/proc/self/fd/{k}") if os.path.exists(f"/proc/self/fd/{k}") else None
            for k in (0, 1, 2)]

before = standard()
read_headers(Path("a.exr"))
pixels = read_parts(Path("a.exr"))[0].rgb()
Path("said").write_text(f"{pixels.shape} {standard() == before}")
"""
    (tmp_path / "read.py").write_text(code)
    root = Path(__file__).parents[2]
    subprocess.run(
        ["sh", "-c", f'"$0" read.py {closed}', sys.executable],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(root)},
        check=False,
        timeout=PATIENCE_S,
    )
    assert (tmp_path / "said").read_text() == "(2, 3, 3) True"


def test_threads_that_read_at_once_give_the_terminal_back(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    path = tmp_path / "cut.exr"
    path.write_bytes(_write_kind(path, "parts")[:-1])
    before = [os.stat(fd) for fd in (1, 2)]
    barrier = threading.Barrier(4)

    def read() -> None:
        barrier.wait()
        for _ in range(20):
            with pytest.raises(ImageError):
                read_parts(path)

    threads = [threading.Thread(target=read) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [os.path.samestat(os.stat(fd), b) for fd, b in zip((1, 2), before, strict=True)] == [
        True,
        True,
    ]
    print("out")
    assert capfd.readouterr() == ("out\n", "")


def test_float32_pixels_are_copied_once(monkeypatch: pytest.MonkeyPatch):
    stacked = np.zeros((2, 3, 3), np.float32)
    monkeypatch.setattr(np, "stack", lambda *_args, **_options: stacked)
    assert ExrPart("p", rgb_channels(stacked)).rgb() is stacked


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"#?RADIANCE\n", "a Radiance HDR"),
        (b"\x89PNG\r\n\x1a\n" + bytes(99), "a PNG"),
        (b"\xff\xd8\xff\xe0", "a JPEG"),
        (b"8BPS\0", "a Photoshop"),
    ],
)
def test_no_exr(tmp_path: Path, content: bytes, kind: str):
    path = tmp_path / "picture.exr"
    path.write_bytes(content)
    with pytest.raises(ImageError, match=rf"picture\.exr is {kind} file: export it as linear"):
        read_parts(path)


def test_no_file(tmp_path: Path):
    with pytest.raises(ImageError, match="no such image file"):
        read_parts(tmp_path / "none.exr")
    with pytest.raises(ImageError, match="is a folder"):
        read_parts(tmp_path)


def test_deep_pixels_are_refused_by_name(tmp_path: Path):
    samples = np.empty((3, 2), dtype=object)
    for index in np.ndindex(samples.shape):
        samples[index] = np.arange(sum(index), dtype=np.float32)
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    OpenEXR.File(header, {"Z": samples}).write(str(tmp_path / "deep.exr"))
    with pytest.raises(ImageError, match="deep pixels"):
        read_parts(tmp_path / "deep.exr")


TOO_MANY = r"huge\.exr declares .* bytes of pixels, in a file of .*: too many to read"


@pytest.mark.parametrize(
    ("window", "message"),
    [
        ((0, 0, 99_999, 99_999), TOO_MANY),
        ((0, 0, 2**20, 2**20), TOO_MANY),
        ((-500_000, 7, 500_000, 9_000), TOO_MANY),
        # These the library itself refuses.
        ((0, 0, 2**31 - 2, 2**31 - 2), "cut off or damaged in its header"),
        ((-(2**31), -(2**31), 2**31 - 1, 2**31 - 1), "cut off or damaged in its header"),
        ((5, 5, 0, 0), "cut off or damaged in its header"),
    ],
)
def test_absurd_sizes_are_refused_at_once(
    tmp_path: Path, window: tuple[int, int, int, int], message: str
):
    path = tmp_path / "huge.exr"
    content = bytearray(_write_kind(path, "ZIP_COMPRESSION"))
    start = content.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    content[start : start + 16] = struct.pack("<4i", *window)
    path.write_bytes(content)
    start_s = time.process_time()
    with pytest.raises(ImageError, match=message):
        read_parts(path)
    # It takes 0.2 ms; to decode, or only to allocate, would take many seconds.
    assert time.process_time() - start_s < 1


def test_of_a_crop_the_pixels_that_are_there_are_read(tmp_path: Path):
    pixels = np.arange(30, dtype=np.float32).reshape(6, 5)
    header = {
        "type": OpenEXR.scanlineimage,
        "dataWindow": (np.array([2, 3], np.int32), np.array([6, 8], np.int32)),
        "displayWindow": (np.array([0, 0], np.int32), np.array([19, 9], np.int32)),
    }
    OpenEXR.File(header, {"Y": pixels}).write(str(tmp_path / "crop.exr"))
    part = read_parts(tmp_path / "crop.exr")[0]
    assert part.size == (6, 5)
    np.testing.assert_array_equal(part.channels["Y"], pixels)


def test_a_full_disk_keeps_the_old_file(tmp_path: Path):
    path = tmp_path / "a.exr"
    write_rgb(path, np.zeros((2, 2, 3)))
    old = path.read_bytes()
    noise = np.random.default_rng(0).random((256, 256, 3)).astype(np.float32)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # To the library a limit on the length of files is a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OutputError, match=r"cannot write .*a\.exr"):
            write_rgb(path, noise)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_bytes() == old
    assert os.listdir(tmp_path) == ["a.exr"]
