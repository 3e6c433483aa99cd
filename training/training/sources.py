"""Free packages: which files of them are used, under which licence, and how they are got."""

import csv
import fnmatch
import re
import struct
import subprocess
import zlib
from dataclasses import dataclass
from pathlib import Path

TABLE = Path(__file__).resolve().parent.parent / "sources.csv"
KINDS = ("photos", "cutouts", "models")
# Licences whose pictures are used, as Debian's copyright files write them.
FREE = re.compile(
    r"(CC0|CC-BY|CC-BY-SA|public[- ]domain|PD|Expat|MIT|BSD|GPL|LGPL|AGPL)\b(?!.*(-NC|-ND))", re.I
)
NOT_FREE = re.compile(r"sampling|GFDL|free-art|-NC|-ND", re.I)


@dataclass(frozen=True)
class Source:
    """A line of the table."""

    package: str
    kind: str
    # Files below the package's root, and what is left out of them: patterns separated by spaces.
    files: str
    without: str
    licence: str


def table():
    """The lines of `sources.csv`."""
    with TABLE.open(newline="") as file:
        sources = [Source(**line) for line in csv.DictReader(file)]
    for source in sources:
        if source.kind not in KINDS:
            raise ValueError(
                f"{TABLE}: the kind of {source.package} is {source.kind!r}; "
                f"allowed: {', '.join(KINDS)}"
            )
    return sources


def fetch(work):
    """Downloads and unpacks the packages that are not there yet."""
    for package in sorted({source.package for source in table()}):
        root = work / "packages" / package
        if root.exists():
            continue
        download = work / "download" / package
        download.mkdir(parents=True, exist_ok=True)
        if not list(download.glob("*.deb")):
            subprocess.run(["apt-get", "download", package], cwd=download, check=True)
        unpack(next(download.glob("*.deb")), root)


def unpack(archive, root):
    """Unpacks a package; a stop leaves nothing that looks complete."""
    part = root.with_name(root.name + ".part")
    part.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["dpkg", "-x", archive, part], check=True)
    for bundle in list(part.rglob("*.rcc")):
        unpack_resources(bundle, bundle.with_suffix(""))
    part.rename(root)


def unpack_resources(bundle, target):
    """Writes the files of a bundle of Qt resources, under their names."""
    data = bundle.read_bytes()
    if data[:4] != b"qres":
        raise ValueError(f"{bundle} is no bundle of Qt resources")
    version, tree, contents, names = struct.unpack(">4I", data[4:20])
    length = 22 if version >= 2 else 14

    def walk(node, folder):
        fields = struct.unpack_from(">IHII", data, tree + node * length)
        name_at, flags, first, second = fields
        size = struct.unpack_from(">H", data, names + name_at)[0]
        start = names + name_at + 6
        name = data[start : start + 2 * size].decode("utf-16-be") if node else ""
        path = folder / name
        if flags & 2:
            for child in range(second, second + first):
                walk(child, path)
            return
        at = contents + second
        content = data[at + 4 : at + 4 + struct.unpack_from(">I", data, at)[0]]
        if flags & 1:
            content = zlib.decompress(content[4:])
        if not flags & 4:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)

    walk(0, target)


def licences(root):
    """The patterns of a package's copyright file with their licences, in order."""
    found = []
    for path in root.glob("usr/share/doc/*/copyright"):
        for stanza in re.split(r"\n\s*\n", path.read_text(errors="replace")):
            files = re.search(r"^Files:(.*(?:\n[ \t].*)*)", stanza, re.M)
            licence = re.search(r"^License:[ \t]*(.*)", stanza, re.M)
            if files and licence:
                found += [(pattern, licence[1]) for pattern in files[1].split()]
    return found


def licence_of(path, patterns):
    """The licence of a file: that of the last pattern that fits. The patterns name files of the
    source package, so each may fit the end of the installed path, and pictures may have been
    converted."""
    path, fitting = without_format(path), None
    for pattern, licence in patterns:
        tail = without_format(pattern.removeprefix("src/activities/").lstrip("/"))
        if fnmatch.fnmatch(path, tail) or fnmatch.fnmatch(path, "*/" + tail):
            fitting = licence
    return fitting


def without_format(path):
    return re.sub(r"\.(jpe?g|png|webp)$", "", path)


def chosen(work, kind):
    """Pairs of a source and a file of it that may be used, in a fixed order."""
    for source in table():
        if source.kind != kind:
            continue
        root = work / "packages" / source.package
        if not root.exists():
            raise FileNotFoundError(f"{root} is missing; run `python -m training fetch` first")
        patterns = licences(root)
        files = {path for pattern in source.files.split() for path in root.glob(pattern)}
        for path in sorted(files):
            name = path.relative_to(root).as_posix()
            if any(fnmatch.fnmatch(name, pattern) for pattern in source.without.split()):
                continue
            licence = licence_of(name, patterns) or source.licence
            if path.is_file() and not path.is_symlink() and is_free(licence):
                yield source, path


def is_free(licence):
    return bool(FREE.search(licence)) and not NOT_FREE.search(licence)
