"""Pictures of the report: the tracking pictures of `ygslam inspect` (Fig. 5), maps (Fig. 9)."""
import base64
import io

from PIL import Image

from . import map_view
from .files import InputError, read_json
from .summary import typical_run

SHEET = "checks"  # `ygslam inspect`: a row per check, a column per frame
POINT_COLOURS = ("green: static points, red: dynamic ones, yellow: unknown; where the truth is known, "
                 "circles are mistakes (white: missed, black: false alarm)")
SHEET_CAPTION = "each row a check, each column a frame; " + POINT_COLOURS
MAP_MODES = ("off", "full")
MAX_SINGLE = 6


def data_uri(image, quality=70):
    """A picture as WebP inside the page."""
    out = io.BytesIO()
    image.save(out, "WEBP", quality=quality, method=4)
    return "data:image/webp;base64," + base64.b64encode(out.getvalue()).decode("ascii")


def shrink(image, width_px):
    if image.width <= width_px:
        return image
    return image.resize((width_px, max(1, round(image.height * width_px / image.width))),
                        Image.LANCZOS)


def tracking_pictures(sequence, width_px):
    """[(name, caption, picture)] of sequences/ID/inspect: single frames, on which points can be told
    apart, else the sheet. What cannot be read comes as (name, fault, None)."""
    folder = sequence.folder / "inspect"
    files = sorted(p for p in folder.glob("*") if p.suffix.lower() in (".png", ".jpg", ".jpeg"))
    sheets = [path for path in files if path.stem == SHEET]
    frames = [path for path in files if path.stem != SHEET][:MAX_SINGLE]
    found = []
    for path in frames or sheets:
        try:
            with Image.open(path) as image:
                picture = shrink(image.convert("RGB"), width_px)
        except (OSError, ValueError) as error:
            found.append((path.stem, f"{path.name} cannot be read: {error}", None))
            continue
        caption = SHEET_CAPTION if not frames else path.stem.replace("_", " ")
        if frames and path == frames[0]:
            caption += "; the checks side by side; " + POINT_COLOURS
        found.append((path.stem, caption, picture))
    return found


def check_scores(sequence):
    """[(check, precision, recall)] in percent or None, from inspect.json; empty without truth."""
    path = sequence.folder / "inspect" / "inspect.json"
    if not path.exists():
        return []
    try:
        checks = read_json(path).get("checks")
    except InputError:
        return []
    scores = []
    for check in checks if isinstance(checks, list) else []:
        if isinstance(check, dict) and isinstance(check.get("precision"), (int, float)):
            scores.append((str(check.get("name")), 100 * check["precision"],
                           100 * check["recall"] if check.get("recall") is not None else None))
    return scores


def maps(sequence, size):
    """[(view name, [(mode, picture or None, remark)])]: the map with and without removal, from the
    same view points, which the map of the last mode that has one decides."""
    clouds, remarks = {}, {}
    for mode in (m for m in MAP_MODES if sequence.runs.get(m)):
        run = typical_run(sequence.runs[mode])
        path = run.folder / "map.ply" if run else None
        if path is None or not path.exists():
            remarks[mode] = "no map: no run of this mode came to an end"
            continue
        try:
            clouds[mode] = map_view.read_ply(path)
            remarks[mode] = f"{len(clouds[mode][0])} points, run {run.number}"
        except (InputError, ValueError, OSError) as error:
            remarks[mode] = str(error).replace(str(run.folder), run.folder.name)
    clouds = {mode: cloud for mode, cloud in clouds.items() if len(cloud[0])}
    if not clouds:
        return []
    reference = list(clouds.values())[-1][0]
    views = []
    for name, eye, target in map_view.view_points(reference):
        shown = []
        for mode, remark in remarks.items():
            picture = None
            if mode in clouds:
                picture = Image.fromarray(map_view.render(*clouds[mode], eye, target, size))
            shown.append((mode, picture, remark))
        views.append((name, shown))
    return views
