"""What can be painted into a recording: each function changes the image and the depth [m] of a View in place.

Strength 1 is what a user would call bad; rng is a random generator that is the same for all frames of a recording,
so what is drawn from it first stands still.
"""
import dataclasses
import functools

import numpy as np
from PIL import Image, ImageDraw, ImageFilter, ImageFont

BONNET_M = 0.45      # from the camera, as far as that of a robot on wheels
MIRRORED_M = 3.0     # how far behind its surface a mirror's picture lies
POSTER_M = 1.2
PLATFORM_BELOW_M = 0.9  # below the camera
SCREEN_M = 1.3       # before the first camera


@dataclasses.dataclass
class View:
    """One frame. image: (H, W, 3) uint8; depth: (H, W) [m], 0 = none; camera: fx, fy, cx, cy [px]."""
    image: np.ndarray
    depth: np.ndarray
    number: int
    t_s: float  # since the first frame
    camera: tuple
    T_first_camera: np.ndarray  # 4x4; first: the camera of the first frame

    def rays(self):
        """Directions of the pixels, z = 1, in the camera's frame: (H, W, 3)."""
        fx, fy, cx, cy = self.camera
        v, u = np.mgrid[:self.depth.shape[0], :self.depth.shape[1]]
        return np.stack([(u - cx) / fx, (v - cy) / fy, np.ones(u.shape)], -1)


def clean(view, strength, rng):
    """As recorded."""


def text(view, strength, rng):
    """A line of date and time at the top left; at strength 1 a twentieth of the height."""
    height = view.image.shape[0]
    size = max(8, round(0.05 * strength * height))
    picture = Image.fromarray(view.image)
    seconds = view.number // 30  # the last digits change as those of a camera's clock do
    line = f"CAM 01  2024-05-17  13:{24 + seconds // 60:02d}:{seconds % 60:02d}"
    ImageDraw.Draw(picture).text((height // 48, height // 60), line, fill=(255, 255, 255),
                                 font=ImageFont.load_default(size))
    view.image[:] = np.asarray(picture)


@functools.cache
def painted_bonnet(width, rows, seed):
    """Metal with a shade, seams and bolts: what a robot sees of itself."""
    rng = np.random.default_rng(seed)
    shade = np.repeat(np.linspace(70, 120, rows)[:, None], width, 1)[..., None] * [0.9, 1.0, 1.1]
    picture = Image.fromarray(shade.astype(np.uint8))
    draw = ImageDraw.Draw(picture)
    for _ in range(6):
        u = int(rng.integers(width))
        draw.line([(u, 0), (int(u + rng.integers(-rows, rows)), rows)], fill=(30, 30, 35), width=2)
    for _ in range(width // 12):
        u, v, r = int(rng.integers(width)), int(rng.integers(rows)), int(rng.integers(1, 4))
        draw.ellipse([u - r, v - r, u + r, v + r], fill=tuple(int(x) for x in rng.integers(20, 230, 3)))
    return np.asarray(picture.filter(ImageFilter.GaussianBlur(0.7)))


def bonnet(view, strength, rng):
    """The lowest eighth of the image at strength 1, BONNET_M away."""
    rows = round(view.image.shape[0] * strength / 8)
    view.image[-rows:] = painted_bonnet(view.image.shape[1], rows, int(rng.integers(2 ** 31)))
    view.depth[-rows:] = BONNET_M


def dots(view, strength, rng):
    """60 specks of dirt at strength 1, of 1 to 4 px in an image of 480 rows, with soft edges."""
    height, width = view.image.shape[:2]
    v, u = np.mgrid[:height, :width]
    for _ in range(round(60 * strength)):
        du, dv = u - rng.uniform(0, width), v - rng.uniform(0, height)
        radius = rng.uniform(1, 4) * height / 480
        dark = np.clip(radius + 0.5 - np.hypot(du, dv), 0, 1) * rng.uniform(0.7, 1)
        view.image[:] = (view.image * (1 - dark[..., None]) + 25 * dark[..., None]).astype(np.uint8)


def flicker(view, strength, rng):
    """Lamps on alternating current: brightness swings by 30 % at strength 1, in bands that wander down the rows."""
    phase = rng.uniform(0, 2 * np.pi) + 2 * np.pi * 3.7 * view.t_s
    rows = np.linspace(0, 4 * np.pi, view.image.shape[0])
    gain = 1 + strength * (0.2 * np.sin(phase) + 0.1 * np.sin(phase + rows))
    view.image[:] = np.clip(view.image * gain[:, None, None], 0, 255).astype(np.uint8)


def snow(view, strength, rng):
    """One pixel of 50 at strength 1 is wrong, others in each frame, in colour as in depth."""
    now = np.random.default_rng([int(rng.integers(2 ** 31)), view.number])
    wrong = now.random(view.depth.shape) < 0.02 * strength
    view.image[wrong] = now.integers(0, 256, (int(wrong.sum()), 3))
    wrong = now.random(view.depth.shape) < 0.02 * strength
    view.depth[wrong] = now.uniform(0.3, 8, int(wrong.sum()))


@functools.cache
def texture(seed, height=600, width=600):
    """Patches of colour with edges and corners at several scales."""
    rng = np.random.default_rng(seed)
    picture = Image.new("RGB", (width, height), (128, 120, 110))
    draw = ImageDraw.Draw(picture)
    for size in (160, 80, 40, 20):
        for _ in range(round(height * width / size ** 2)):
            u, v = int(rng.integers(-size, width)), int(rng.integers(-size, height))
            du, dv = (int(x) for x in rng.integers(size // 3, size, 2))
            draw.rectangle([u, v, u + du, v + dv], fill=tuple(int(x) for x in rng.integers(20, 235, 3)))
    return np.asarray(picture)


def paint_plane(view, hit, depth, u, v, picture):
    """Puts the picture where hit is true and nothing recorded lies before depth; u, v: its pixels, repeated."""
    shown = hit & (depth > 0.05) & ((view.depth == 0) | (depth < view.depth))
    rows = np.floor(v[shown]).astype(int) % picture.shape[0]
    columns = np.floor(u[shown]).astype(int) % picture.shape[1]
    view.image[shown] = picture[rows, columns]
    view.depth[shown] = depth[shown]


def poster(view, strength, rng):
    """A poster of 1 m x 0.8 m (strength 1) is carried past the camera, to and fro, at 0.5 m/s."""
    picture = texture(int(rng.integers(2 ** 31)))
    swing = 4 * abs((view.t_s * 0.5 / 4 + rng.uniform()) % 1 - 0.5) - 1  # -1 to 1
    rays = view.rays() * POSTER_M
    x, y = rays[..., 0] - swing * 1.0, rays[..., 1]
    hit = (abs(x) < 0.5 * strength) & (abs(y) < 0.4 * strength)
    paint_plane(view, hit, np.full(x.shape, POSTER_M), x * 500 + 300, y * 500 + 300, picture)


def platform(view, strength, rng):
    """The floor is a belt that goes past at 0.3 m/s; it fills half of the view at strength 1."""
    picture = texture(int(rng.integers(2 ** 31)))
    angle = rng.uniform(0, 2 * np.pi)
    rays = view.rays()
    horizon = np.quantile(rays[..., 1], 1 - 0.5 * min(strength, 1.9))
    below = rays[..., 1] > horizon  # a plane that is tilted so that it begins there
    depth = PLATFORM_BELOW_M / np.maximum(rays[..., 1] - horizon + 0.25, 1e-6)
    x, z = rays[..., 0] * depth, depth
    u = (x + 0.3 * view.t_s * np.cos(angle)) * 400
    v = (z + 0.3 * view.t_s * np.sin(angle)) * 400
    shown = below & (depth > 0)
    view.depth[shown & (view.depth > 0) & (view.depth < depth)] = 0  # it lies before all else
    paint_plane(view, shown, depth, u, v, picture)


def late_platform(view, strength, rng):
    """The same, after 5 s in which nothing moves."""
    if view.t_s > 5:
        platform(view, strength, rng)


def surface_of_glass(view, strength, rng):
    """An upright plane in the room, 1 m x 0.8 m at strength 1. @return where it is seen, its depth, and the pixels
    of a picture that lies MIRRORED_M behind it."""
    place = np.array([rng.uniform(-0.4, 0.4), rng.uniform(-0.2, 0.2), 1.6])
    rotation, centre = view.T_first_camera[:3, :3], view.T_first_camera[:3, 3]
    directions = view.rays() @ rotation.T  # in the first camera's frame
    z = np.where(abs(directions[..., 2]) > 1e-6, directions[..., 2], 1e-6)
    depth = (place[2] - centre[2]) / z
    x, y = centre[0] + depth * directions[..., 0] - place[0], centre[1] + depth * directions[..., 1] - place[1]
    hit = (abs(x) < 0.5 * strength) & (abs(y) < 0.4 * strength) & (depth > 0)
    behind = (place[2] + MIRRORED_M - centre[2]) / z
    return hit, depth, (centre[0] + behind * directions[..., 0]) * 200, (centre[1] + behind * directions[..., 1]) * 200


def screen(view, strength, rng, pan_mps=0.25):
    """A screen that stands in the room before all else, with a video that pans to and fro; at strength 1 it fills a
    third of the first image."""
    picture = texture(int(rng.integers(2 ** 31)))
    rotation, centre = view.T_first_camera[:3, :3], view.T_first_camera[:3, 3]
    directions = view.rays() @ rotation.T
    depth = (SCREEN_M - centre[2]) / np.where(directions[..., 2] > 1e-6, directions[..., 2], np.inf)
    x, y = centre[0] + depth * directions[..., 0], centre[1] + depth * directions[..., 1]
    shape = np.array([view.depth.shape[1] / view.camera[0], view.depth.shape[0] / view.camera[1]])
    half_width, half_height = SCREEN_M / 2 * np.sqrt(strength / 3) * shape
    hit = (abs(x) < half_width) & (abs(y) < half_height) & (depth > 0)
    view.depth[hit & (view.depth > 0) & (view.depth < depth)] = 0
    phase = view.t_s + rng.uniform(0, 4)
    panned = pan_mps * 2 * (1 - abs((phase / 2) % 2 - 1))  # there in 2 s, and back
    angle = rng.uniform(0, 2 * np.pi)
    paint_plane(view, hit, depth, (x + panned * np.cos(angle)) * 400, (y + panned * np.sin(angle)) * 400, picture)


def slow_screen(view, strength, rng):
    """The same with a video that pans at 5 cm/s."""
    screen(view, strength, rng, pan_mps=0.05)


def still_screen(view, strength, rng):
    """The same with a picture that stands."""
    screen(view, strength, rng, pan_mps=0)


def mirror(view, strength, rng):
    """A mirror that stands in the room: its picture moves as a room behind it does, its depth is that of its surface."""
    picture = texture(int(rng.integers(2 ** 31)))
    paint_plane(view, *surface_of_glass(view, strength, rng), picture)


def glass(view, strength, rng):
    """A pane that stands in the room and mirrors 45 % of the light of a room; depth sees through it."""
    picture = texture(int(rng.integers(2 ** 31)))
    mirrored = dataclasses.replace(view, image=view.image.copy(), depth=view.depth.copy())
    paint_plane(mirrored, *surface_of_glass(view, strength, rng), picture)
    seen = (mirrored.image != view.image).any(-1)
    view.image[seen] = (0.55 * view.image[seen] + 0.45 * mirrored.image[seen]).astype(np.uint8)


KINDS = {kind.__name__: kind for kind in (clean, text, bonnet, dots, screen, slow_screen, still_screen, mirror, glass,
                                          platform, late_platform, poster, flicker, snow)}
STRENGTHS = {"screen": (0.3, 1, 2), "slow_screen": (1, 2), "still_screen": (1, 2), "platform": (0.6, 1)}  # else 1
