"""The frames of a shot: how they are named, found and chosen."""

from pathlib import Path

import pytest
from light_groups import interleaved, pictures

import lightpaint as lp
from lightpaint.basis.lightgroups.frame_sequence import (
    find_frames,
    is_pattern,
    parse_frames,
    spoken_frames,
)
from lightpaint.basis.lightgroups.light_groups import with_equal_lights
from lightpaint.errors import BasisError


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


@pytest.mark.parametrize("sign", ["####", "@@@@", "%04d", "$F4", "<F4>", "#", "@", "%d", "$F"])
def test_each_program_s_sign_finds_the_frames(tmp_path: Path, sign: str) -> None:
    touch(tmp_path, "shot.0001.exr", "shot.0012.exr", "shot.10000.exr", "shot.exr", "shot.0003.png")
    pattern = tmp_path / f"shot.{sign}.exr"
    assert is_pattern(pattern)
    sequence = find_frames(pattern)
    assert sequence.frames == (1, 12, 10000)
    assert sequence.path(12) == tmp_path / "shot.0012.exr"
    assert sequence.frame_of(tmp_path / "shot.0012.exr") == 12
    hashes = "####" if "4" in sign or len(sign) == 4 else "#"
    assert sequence.with_hashes(sequence.path(12), 12) == tmp_path / f"shot.{hashes}.exr"


def test_padding_counts(tmp_path: Path) -> None:
    touch(
        tmp_path, "shot.1.exr", "shot.02.exr", "shot.0003.exr", "shot.00004.exr", "shot.-0005.exr"
    )
    assert find_frames(tmp_path / "shot.####.exr").frames == (-5, 3)
    assert find_frames(tmp_path / "shot.##.exr").frames == (2,)


def test_a_file_that_exists_is_no_pattern(tmp_path: Path) -> None:
    touch(tmp_path, "take #2.exr")
    assert not is_pattern(tmp_path / "take #2.exr")
    assert not is_pattern(tmp_path / "shot.0001.exr")


def test_folders_may_have_the_number_too(tmp_path: Path) -> None:
    touch(tmp_path, "a/0001/key.0001.exr", "a/0002/key.0002.exr", "a/0002/key.0003.exr")
    sequence = find_frames(tmp_path / "a" / "####" / "key.####.exr")
    assert sequence.frames == (1, 2)
    folders = find_frames(tmp_path / "a" / "####")
    file = tmp_path / "a" / "0002" / "key.0002.exr"
    assert folders.with_hashes(file, 2) == tmp_path / "a" / "####" / "key.####.exr"


def test_a_folder_with_a_sign_in_its_name_stands_for_itself(tmp_path: Path) -> None:
    touch(tmp_path, "me@home/shot.01.exr", "me2home/shot.02.exr")
    sequence = find_frames(tmp_path / "me@home" / "shot.##.exr")
    assert sequence.frames == (1,)
    hashes = sequence.with_hashes(sequence.path(1), 1)
    assert hashes == tmp_path / "me@home" / "shot.##.exr"


def test_frames_are_chosen_as_in_render_programs(tmp_path: Path) -> None:
    touch(tmp_path, *(f"s.{x:02d}.exr" for x in (1, 2, 3, 4, 7, 8)))
    sequence = find_frames(tmp_path / "s.##.exr")
    assert parse_frames("all", sequence) == (1, 2, 3, 4, 7, 8)
    assert parse_frames("1-7x2, 8", sequence) == (1, 3, 7, 8)
    assert spoken_frames(sequence.frames) == "1-4, 7-8"
    for text, words in (
        ("5-6", "has none of the frames 5-6: it has 1-4, 7-8"),
        ("1..4", "names no"),
    ):
        with pytest.raises(BasisError, match=words):
            parse_frames(text, sequence)
    with pytest.raises(BasisError, match=r"has no frame 5: it has 1-4, 7-8"):
        sequence.path(5)


def test_nothing_there_is_one_line(tmp_path: Path) -> None:
    for pattern in (tmp_path / "shot.####.exr", tmp_path / "gone" / "shot.####.exr"):
        with pytest.raises(BasisError, match=r"no frame"):
            find_frames(pattern)


def frame(folder: Path, k: int, *, lacks: float = 0.0, names: str = "abc") -> lp.LightGroups:
    images = pictures(3, seed=k)
    layers = {f"RGBA_{name}": x for name, x in zip(names, images, strict=False)}
    beauty = sum(layers.values()) * (1 + lacks)
    return lp.read_light_groups(interleaved(folder / f"f.{k}.exr", {"RGBA": beauty, **layers}))


def test_a_frame_without_rest_gets_a_black_one(tmp_path: Path) -> None:
    frames = with_equal_lights([frame(tmp_path, 1), frame(tmp_path, 2, lacks=0.2)])
    assert [x.basis.names for x in frames] == [("a", "b", "c", "rest")] * 2
    assert not frames[0].basis.image("rest").any()
    assert frames[1].basis.image("rest").any()
    assert all(x.has_rest for x in frames)


def test_frames_with_other_groups_or_sizes_are_refused(tmp_path: Path) -> None:
    first = frame(tmp_path, 1)
    for other, words in (
        (frame(tmp_path, 2, names="ab"), r"f\.2\.exr lacks the light groups c, which .*f\.1\.exr"),
        (frame(tmp_path, 3, names="abd"), r"f\.3\.exr lacks the light groups c"),
    ):
        with pytest.raises(BasisError, match=words):
            with_equal_lights([first, other])
    images = pictures(3, size=(4, 4))
    layers = {f"RGBA_{name}": x for name, x in zip("abc", images, strict=True)}
    small = lp.read_light_groups(interleaved(tmp_path / "f.9.exr", {"RGBA": sum(images), **layers}))
    with pytest.raises(BasisError, match=r"f\.9\.exr is 4x4 but .*f\.1\.exr is 8x6: the frames"):
        with_equal_lights([first, small])
