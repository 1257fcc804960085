#!/usr/bin/env python3
"""Fetch a public RGB-D sequence with moving people, ready for `ygslam run`.

    tools/fetch_sequence.py --list
    tools/fetch_sequence.py rgbd_dataset_freiburg3_walking_xyz --to ~/data
    tools/fetch_sequence.py fr3_walking_xyz                # the same, short
    tools/fetch_sequence.py rgbd_bonn_balloon              # the Bonn dynamic dataset

TUM RGB-D: https://cvg.cit.tum.de/data/datasets/rgbd-dataset (CC BY 4.0)
Bonn:      https://www.ipb.uni-bonn.de/data/rgbd-dynamic-dataset/
Needs nothing beyond Python. Exit codes: 0 ok, 1 not fetched or not unpacked, 2 usage.
"""
import argparse
import difflib
import os
import pathlib
import re
import shutil
import stat
import sys
import tarfile
import tempfile
import urllib.error
import urllib.parse
import urllib.request
import zipfile

TUM_URL = "https://cvg.cit.tum.de/rgbd/dataset"
BONN_URL = "https://www.ipb.uni-bonn.de/html/projects/rgbd_dynamic2019"

TUM = [
    "rgbd_dataset_freiburg1_xyz", "rgbd_dataset_freiburg1_rpy", "rgbd_dataset_freiburg1_360",
    "rgbd_dataset_freiburg1_floor", "rgbd_dataset_freiburg1_desk", "rgbd_dataset_freiburg1_desk2",
    "rgbd_dataset_freiburg1_room", "rgbd_dataset_freiburg2_xyz", "rgbd_dataset_freiburg2_rpy",
    "rgbd_dataset_freiburg2_desk", "rgbd_dataset_freiburg2_desk_with_person",
    "rgbd_dataset_freiburg3_long_office_household",
    "rgbd_dataset_freiburg3_sitting_static", "rgbd_dataset_freiburg3_sitting_xyz",
    "rgbd_dataset_freiburg3_sitting_halfsphere", "rgbd_dataset_freiburg3_sitting_rpy",
    "rgbd_dataset_freiburg3_walking_static", "rgbd_dataset_freiburg3_walking_xyz",
    "rgbd_dataset_freiburg3_walking_halfsphere", "rgbd_dataset_freiburg3_walking_rpy",
]
BONN = ["rgbd_bonn_" + name for name in (
    "balloon", "balloon2", "balloon_tracking", "balloon_tracking2", "crowd", "crowd2", "crowd3",
    "kidnapping_box", "kidnapping_box2", "moving_nonobstructing_box", "moving_nonobstructing_box2",
    "moving_obstructing_box", "moving_obstructing_box2", "person_tracking", "person_tracking2",
    "placing_nonobstructing_box", "placing_nonobstructing_box2", "placing_nonobstructing_box3",
    "placing_obstructing_box", "removing_nonobstructing_box", "removing_nonobstructing_box2",
    "removing_obstructing_box", "static", "static_close_far", "synchronous", "synchronous2")]


class Failure(Exception):
    """What the user reads, in one line."""


def full_name(name):
    """`fr3_walking_xyz` -> `rgbd_dataset_freiburg3_walking_xyz`; unknown names are refused."""
    short = re.fullmatch(r"(?:fr|freiburg)([123])_(\w+)", name)
    name = f"rgbd_dataset_freiburg{short[1]}_{short[2]}" if short else name
    if name in TUM + BONN:
        return name
    if f"rgbd_bonn_{name}" in BONN:
        return f"rgbd_bonn_{name}"
    near = difflib.get_close_matches(name, TUM + BONN, 1)
    hint = f", did you mean {near[0]}?" if near else "; --list shows the known ones"
    raise Failure(f"{name}: unknown sequence{hint}")


def url_of(name, base_url):
    if name in BONN:
        return f"{base_url or BONN_URL}/{name}.zip"
    group = re.search(r"freiburg[123]", name)[0]
    return f"{base_url or TUM_URL + '/' + group}/{name}.tgz"


def show_progress(done, total):
    if not sys.stderr.isatty():
        return
    share = f" of {total / 1e6:.0f} MB ({100 * done // total} %)" if total else " MB"
    print(f"\r  {done / 1e6:.0f}{share}  ", end="", file=sys.stderr, flush=True)


def download(url, target):
    """Writes the whole answer to the open file `target`."""
    try:
        with urllib.request.urlopen(url, timeout=60) as answer:
            total = int(answer.headers.get("Content-Length") or 0)
            done = 0
            while block := answer.read(1 << 20):
                target.write(block)
                done += len(block)
                show_progress(done, total)
    except urllib.error.HTTPError as error:
        raise Failure(f"{url}: the server answers {error.code} {error.reason}") from None
    except (urllib.error.URLError, OSError) as error:
        raise Failure(f"{url}: {getattr(error, 'reason', error)}") from None
    if sys.stderr.isatty():
        print(file=sys.stderr)
    if total and done != total:
        raise Failure(f"{url}: only {done} of {total} bytes arrived; try again")


def safe_path(folder, name):
    """Where an archive's entry goes; anything that would leave the folder is refused."""
    relative = pathlib.PurePosixPath(name)
    if relative.is_absolute() or ".." in relative.parts or "\\" in name or "\0" in name:
        raise Failure(f"the archive holds an unsafe path: {name!r}")
    return folder.joinpath(*relative.parts)


def unpack_tar(archive, folder):
    with tarfile.open(archive, "r:*") as tar:
        for entry in tar:
            path = safe_path(folder, entry.name)
            if entry.isdir():
                path.mkdir(parents=True, exist_ok=True)
            elif entry.isfile():
                path.parent.mkdir(parents=True, exist_ok=True)
                with tar.extractfile(entry) as source, open(path, "wb") as target:
                    shutil.copyfileobj(source, target)
            else:
                raise Failure(f"the archive holds a link or device: {entry.name!r}")


def unpack_zip(archive, folder):
    with zipfile.ZipFile(archive) as packed:
        for entry in packed.infolist():
            path = safe_path(folder, entry.filename)
            if stat.S_ISLNK(entry.external_attr >> 16):
                raise Failure(f"the archive holds a link: {entry.filename!r}")
            if entry.is_dir():
                path.mkdir(parents=True, exist_ok=True)
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            with packed.open(entry) as source, open(path, "wb") as target:
                shutil.copyfileobj(source, target)


def unpack(archive, folder):
    try:
        if zipfile.is_zipfile(archive):
            unpack_zip(archive, folder)
        else:
            unpack_tar(archive, folder)
    except (tarfile.TarError, zipfile.BadZipFile, EOFError, ValueError, OSError) as error:
        raise Failure(f"the archive cannot be unpacked: {error}") from None


def sequence_folder(folder):
    """The unpacked folder that holds rgb.txt."""
    found = sorted(folder.rglob("rgb.txt"), key=lambda path: len(path.parts))
    if not found:
        raise Failure("the archive holds no rgb.txt: not a sequence in TUM layout")
    return found[0].parent


def fetch(name, destination, base_url):
    """Downloads and unpacks beside the final place, then renames: never a half sequence."""
    final = destination / name
    if final.exists():
        print(f"{final}: there already")
        return final
    try:
        destination.mkdir(parents=True, exist_ok=True)
        work = tempfile.TemporaryDirectory(prefix=f".{name}.", dir=destination)
    except OSError as error:
        raise Failure(f"{destination}: {error.strerror}") from None
    with work as folder:
        url = url_of(name, base_url)
        print(f"fetching {url}")
        with tempfile.NamedTemporaryFile(dir=folder) as archive:
            download(url, archive)
            archive.flush()
            unpacked = pathlib.Path(folder, "unpacked")
            unpacked.mkdir()
            unpack(archive.name, unpacked)
        os.rename(sequence_folder(unpacked), final)
    print(final)
    return final


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="?", help="sequence, e.g. fr3_walking_xyz or rgbd_bonn_crowd")
    parser.add_argument("--to", type=pathlib.Path, default=pathlib.Path("data"), metavar="DIR",
                        help="where the sequence's folder goes (default: ./data)")
    parser.add_argument("--list", action="store_true", help="print the known names and stop")
    parser.add_argument("--base-url", metavar="URL", help="a mirror; the archive's name is appended")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(TUM + BONN))
        return 0
    if not arguments.name:
        parser.error("which sequence? (--list shows the known ones)")
    try:
        fetch(full_name(arguments.name), arguments.to, arguments.base_url)
    except Failure as failure:
        print(f"fetch_sequence: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
