"""Only free files are used."""

import struct

import pytest

from training import sources

COPYRIGHT = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/

Files: *
Copyright: somebody
License: GPL-2+

Files: src/activities/zoo/horse.jpg
       birds/*.png
License: CC-BY-SA-3.0

Files: src/activities/zoo/whale.jpg
License: GFDL-1.2
"""


@pytest.mark.parametrize(
    ("path", "licence"),
    [
        ("usr/share/x/zoo/horse.jpg", "CC-BY-SA-3.0"),
        ("usr/share/x/zoo/whale.webp", "GFDL-1.2"),
        ("usr/share/birds/owl.webp", "CC-BY-SA-3.0"),
        ("usr/share/x/zoo/cow.png", "GPL-2+"),
    ],
)
def test_the_last_pattern_that_fits_decides(tmp_path, path, licence):
    folder = tmp_path / "usr/share/doc/zoo"
    folder.mkdir(parents=True)
    (folder / "copyright").write_text(COPYRIGHT)
    assert sources.licence_of(path, sources.licences(tmp_path)) == licence


def test_licences_that_are_free():
    for licence in ["CC0-1.0", "CC-BY-4.0", "CC-BY-SA-2.5", "public-domain", "GPL-3+", "Expat"]:
        assert sources.is_free(licence), licence
    for licence in ["CC-BY-NC-4.0", "CC-BY-ND-3.0", "GFDL-1.2", "free-art", "CC-sampling-plus-1.0"]:
        assert not sources.is_free(licence), licence


def test_the_table_is_understood():
    table = sources.table()
    assert {source.kind for source in table} == set(sources.KINDS)
    assert all(source.files and sources.is_free(source.licence) for source in table)


def test_a_bundle_of_resources_is_unpacked(tmp_path):
    name = "a.txt".encode("utf-16-be")
    names = struct.pack(">HI", 0, 0) + struct.pack(">HI", 5, 0) + name
    tree = struct.pack(">IHII", 0, 2, 1, 1) + struct.pack(">IHII", 6, 0, 0, 0)
    contents = struct.pack(">I", 3) + b"abc"
    at = [20, 20 + len(tree), 20 + len(tree) + len(contents)]
    bundle = tmp_path / "x.rcc"
    bundle.write_bytes(b"qres" + struct.pack(">4I", 1, *at) + tree + contents + names)
    sources.unpack_resources(bundle, tmp_path / "x")
    assert (tmp_path / "x/a.txt").read_text() == "abc"
    bundle.write_bytes(b"nothing of the kind")
    with pytest.raises(ValueError, match="no bundle"):
        sources.unpack_resources(bundle, tmp_path / "y")
