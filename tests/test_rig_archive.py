"""Archives of strangers: what must not be read is one line. Limits are lowered for the tests."""

import zipfile
from pathlib import Path

import pytest
from rig_files import EXAMPLE, zipped

from lightpaint.dmx.mvr import read_rig
from lightpaint.errors import RigError
from lightpaint.storage import rig_archive
from lightpaint.storage.rig_archive import RigArchive, parse_xml


def opened(data: bytes) -> RigArchive:
    return RigArchive(data, "a.mvr", "MVR")


@pytest.mark.parametrize(
    ("limit", "value", "message"),
    [
        ("MAX_UNPACKED", 5000, "is 4"),
        ("MAX_MEMBERS", 2, "show.mvr has 3 files in it: expected at most 2"),
        ("MAX_XML", 100, "show.mvr: GeneralSceneDescription.xml has "),
        ("MAX_NESTING", 3, "show.mvr: GeneralSceneDescription.xml has more than 1000000 elements,"),
        ("MAX_ELEMENTS", 9, "show.mvr: GeneralSceneDescription.xml has more than 9 elements,"),
    ],
)
def test_limits_are_one_line(
    limit: str, value: int, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if limit == "MAX_UNPACKED":
        with zipfile.ZipFile(EXAMPLE) as archive:
            size = sum(x.file_size for x in archive.infolist())
        value = size - 1
        message = f"show.mvr has {size} bytes once unpacked: expected at most {value}"
    monkeypatch.setattr(rig_archive, limit, value)
    with pytest.raises(RigError) as caught:
        read_rig(EXAMPLE)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("name", ["../a.txt", "/a.txt", "a/../../b.txt", "..\\a.txt", "c:\\a.txt"])
def test_no_path_leads_out(name: str) -> None:
    with pytest.raises(RigError, match=r"a.mvr has a path out of it"):
        opened(zipped({name: "x"}))


def test_encrypted_archives_are_refused() -> None:
    data = bytearray(zipped({"a.txt": "x"}))
    # The flag in the directory, six bytes into its entry after the version fields.
    data[data.index(b"PK\x01\x02") + 8] |= 1
    with pytest.raises(RigError, match=r"a.mvr is encrypted: save it without a password"):
        opened(bytes(data))


def test_damaged_members_are_one_line() -> None:
    data = bytearray(zipped({"a.txt": "x" * 100}))
    data[data.index(b"a.txt") + 6] ^= 0xFF
    with opened(bytes(data)) as archive, pytest.raises(RigError, match=r"a.mvr: a.txt is damaged"):
        archive.read("a.txt")


def test_a_file_that_is_no_archive_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.mvr").write_text("no archive")
    with pytest.raises(RigError, match=r"a.mvr is not an MVR: "):
        read_rig(tmp_path / "a.mvr")
    with pytest.raises(RigError, match="no such MVR: "):
        read_rig(tmp_path / "none.mvr")


def test_declarations_of_entities_are_refused_and_final_nuls_are_not() -> None:
    with pytest.raises(RigError, match="a has a document type declaration: it is not read"):
        parse_xml(b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "a")
    with opened(zipped({"a.xml": b"<a><b/></a>\0"})) as archive:
        assert archive.xml("a.xml")[0].tag == "b"


def test_names_that_are_not_marked_as_utf_8_are_found() -> None:
    data = zipped({"Wäsche.gdtf": "x"})
    # Without the mark, names are of code page 437.
    central, local = data.index(b"PK\x01\x02"), data.index(b"PK\x03\x04")
    unmarked = bytearray(data)
    unmarked[central + 9] &= ~8
    unmarked[local + 7] &= ~8
    for raw in (data, bytes(unmarked)):
        with opened(raw) as archive:
            for way in ("Wäsche.gdtf", "wäsche.GDTF", "Wäsche.gdtf".encode().decode("cp437")):
                member = archive.find(way)
                assert member is not None
                assert archive.read(member) == b"x"
            assert archive.name_of(archive.members[0]) == "Wäsche.gdtf"
            assert archive.find("other") is None
