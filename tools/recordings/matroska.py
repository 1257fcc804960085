"""As much of Matroska (RFC 9559) as recordings of the Azure Kinect SDK have: no lacing, no encryption."""
import dataclasses

from .recording import Fault, read_exactly

EBML, SEGMENT, CLUSTER = 0x1A45DFA3, 0x18538067, 0x1F43B675
INFO, TIMECODE_SCALE = 0x1549A966, 0x2AD7B1
TRACKS, TRACK, TRACK_NUMBER, TRACK_NAME, CODEC_PRIVATE = 0x1654AE6B, 0xAE, 0xD7, 0x536E, 0x63A2
VIDEO, WIDTH, HEIGHT = 0xE0, 0xB0, 0xBA
TAGS, TAG, SIMPLE_TAG, TAG_NAME, TAG_TEXT = 0x1254C367, 0x7373, 0x67C8, 0x45A3, 0x4487
ATTACHMENTS, ATTACHED, FILE_NAME, FILE_DATA = 0x1941A469, 0x61A7, 0x466E, 0x465C
CLUSTER_TIME, SIMPLE_BLOCK, BLOCK_GROUP, BLOCK = 0xE7, 0xA3, 0xA0, 0xA1
MOST_HEAD_BYTES = 1 << 24  # of what is not images


@dataclasses.dataclass
class Track:
    number: int
    name: str
    width: int
    height: int
    codec: bytes  # BITMAPINFOHEADER


def vint(data, at, keep_marker=False):
    """(value, place behind it) of a number of variable length; None for a size that is not known."""
    if at >= len(data):
        raise Fault("ends early")
    if data[at] == 0:
        raise Fault("is damaged: no element of Matroska where one should be")
    length = 9 - data[at].bit_length()
    if at + length > len(data):
        raise Fault("ends early")
    value = int.from_bytes(data[at:at + length], "big")
    if not keep_marker:
        value -= 1 << 7 * length
        value = None if value == (1 << 7 * length) - 1 else value
    return value, at + length


def children(data):
    """(id, content) of the elements in a piece of memory."""
    at = 0
    while at < len(data):
        kind, at = vint(data, at, keep_marker=True)
        size, at = vint(data, at)
        if size is None or size > len(data) - at:
            raise Fault("is damaged: an element is longer than what holds it")
        yield kind, data[at:at + size]
        at += size


def fields(data):
    """The last of each kind."""
    return dict(children(data))


def elements(file, end):
    """(id, size) of the elements up to a place in the file, which stands at their content."""
    while (at := file.tell()) < end:
        head = file.read(min(12, end - at))
        kind, here = vint(head, 0, keep_marker=True)
        size, here = vint(head, here)
        if size is None:
            size = end - at - here
        if at + here + size > end:
            raise Fault("ends early")
        file.seek(at + here)
        yield kind, size
        file.seek(at + here + size)


def number(data):
    return int.from_bytes(data, "big")


def text(data):
    return bytes(data).rstrip(b"\0").decode("utf-8", "replace")


class Matroska:
    """Tracks, tags and attachments at once; blocks one by one."""

    def __init__(self, path):
        self.path, self.scale_ns = path, 10**6
        self.tracks, self.tags, self.attachments, self.clusters = [], {}, {}, []
        size = path.stat().st_size
        with open(path, "rb") as file:
            for kind, length in elements(file, size):
                if kind == SEGMENT:
                    self._read_segment(file, file.tell() + length)

    def _read_segment(self, file, end):
        read = {INFO: self._read_info, TRACKS: self._read_tracks, TAGS: self._read_tags,
                ATTACHMENTS: self._read_attachments}
        for kind, length in elements(file, end):
            if kind == CLUSTER:
                self.clusters.append((file.tell(), length))
            elif kind in read:
                if length > MOST_HEAD_BYTES:
                    raise Fault(f"is damaged: a head of {length} bytes")
                read[kind](memoryview(read_exactly(file, length, "its head")))

    def _read_info(self, data):
        self.scale_ns = number(fields(data).get(TIMECODE_SCALE, b"")) or self.scale_ns

    def _read_tracks(self, data):
        for kind, entry in children(data):
            if kind == TRACK:
                about = fields(entry)
                video = fields(about.get(VIDEO, b""))
                self.tracks.append(Track(number(about.get(TRACK_NUMBER, b"")), text(about.get(TRACK_NAME, b"")),
                                         number(video.get(WIDTH, b"")), number(video.get(HEIGHT, b"")),
                                         bytes(about.get(CODEC_PRIVATE, b""))))

    def _read_tags(self, data):
        for kind, tag in children(data):
            for inner, simple in children(tag) if kind == TAG else ():
                if inner == SIMPLE_TAG:
                    about = fields(simple)
                    self.tags[text(about.get(TAG_NAME, b""))] = text(about.get(TAG_TEXT, b""))

    def _read_attachments(self, data):
        for kind, file in children(data):
            if kind == ATTACHED:
                about = fields(file)
                self.attachments[text(about.get(FILE_NAME, b""))] = bytes(about.get(FILE_DATA, b""))

    def blocks(self):
        """(track number, stamp in ns, content) in the order of the file."""
        with open(self.path, "rb") as file:
            for place, length in self.clusters:
                file.seek(place)
                time = 0
                for kind, size in elements(file, place + length):
                    if kind not in (CLUSTER_TIME, SIMPLE_BLOCK, BLOCK_GROUP):
                        continue
                    data = memoryview(read_exactly(file, size, "a block"))
                    if kind == CLUSTER_TIME:
                        time = number(data)
                        continue
                    if kind == BLOCK_GROUP:
                        data = fields(data).get(BLOCK, b"")
                    track, at = vint(data, 0)
                    offset = int.from_bytes(data[at:at + 2], "big", signed=True)
                    yield track, (time + offset) * self.scale_ns, data[at + 3:]


