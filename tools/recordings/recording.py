"""What every kind of recording is read into."""
import dataclasses
from typing import Iterator, Union

import numpy as np

from . import Fault

MOST_IMAGE_BYTES = 1 << 28  # of one image: what is larger is damage
GOOD_FIT_PX = 0.5  # root mean square of what a distortion may be off by


@dataclasses.dataclass
class Camera:
    """Pinhole with distortion as ROS has it: (0, 0) is the centre of the first pixel."""
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    model: str = "plumb_bob"
    terms: tuple = (0.0,) * 5  # k1 k2 p1 p2 k3

    def check(self, name):
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.terms)
        if not (0 < self.width <= 16384 and 0 < self.height <= 16384):
            raise Fault(f"{name} images of {self.width} x {self.height} pixels")
        if not np.all(np.isfinite(numbers)) or self.fx <= 0 or self.fy <= 0:
            raise Fault(f"an impossible {name} camera (fx {self.fx:g}, fy {self.fy:g})")


@dataclasses.dataclass
class Colour:
    stamp_ns: int
    content: Union[bytes, np.ndarray]  # a compressed file, or pixels
    encoding: str  # "jpeg" or "png", or of the pixels as sensor_msgs/Image names it


@dataclasses.dataclass
class Depth:
    stamp_ns: int
    values: np.ndarray  # HxW: uint16 in units of unit_m, or float32 in metres
    unit_m: float = 0.001


@dataclasses.dataclass
class Recording:
    colour: Camera
    depth: Camera
    T_colour_depth: np.ndarray  # 4x4, metres: a point of the depth camera as the colour camera sees it
    images: Iterator[Union[Colour, Depth]]
    notes: list = dataclasses.field(default_factory=list)  # what the user should know

    def __post_init__(self):
        self.colour.check("colour")
        self.depth.check("depth")
        T = self.T_colour_depth = np.asarray(self.T_colour_depth, dtype=float)
        rotation = T[:3, :3]
        if (T.shape != (4, 4) or not np.all(np.isfinite(T)) or np.linalg.det(rotation) < 0
                or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-2)):
            raise Fault("the transform between its cameras is no rigid motion")


def read_exactly(file, n, what):
    """n bytes of a file that is perhaps cut off. Nothing is allocated for what is not there."""
    if n > MOST_IMAGE_BYTES:
        raise Fault(f"is damaged: {what} of {n} bytes")
    data = file.read(n)
    if len(data) != n:
        raise Fault(f"ends early, in {what}")
    return data


def distorted(x, y, k1, k2, p1, p2, k3, k4=0.0, k5=0.0, k6=0.0):
    """Brown and Conrady's model with a rational radius, on the plane z = 1."""
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y))


def fit_plumb_bob(camera, x, y, xd, yd):
    """Sets the focal lengths and the five terms of plumb_bob, the distortion that ygslam reads, to
    those nearest to a lens that images (x, y) at (xd, yd), both on the plane z = 1.

    @return (root mean square, worst) error in pixels, of the points that fall into the image.
    """
    u, v = camera.fx * xd + camera.cx, camera.fy * yd + camera.cy
    seen = (u > -0.5) & (u < camera.width - 0.5) & (v > -0.5) & (v < camera.height - 0.5)
    if np.count_nonzero(seen) < 10:
        raise Fault("a camera that sees nothing")
    x, y, xd, yd = x[seen], y[seen], xd[seen], yd[seen]
    r2 = x * x + y * y
    # Linear in a scale of both focal lengths and, times that, k1 k2 p1 p2 k3.
    rows_x = np.stack([x, x * r2, x * r2**2, 2 * x * y, r2 + 2 * x * x, x * r2**3], axis=1)
    rows_y = np.stack([y, y * r2, y * r2**2, r2 + 2 * y * y, 2 * x * y, y * r2**3], axis=1)
    (scale, *terms), *_ = np.linalg.lstsq(np.concatenate([rows_x, rows_y]), np.concatenate([xd, yd]),
                                          rcond=None)
    error_px = np.hypot(camera.fx * (rows_x @ [scale, *terms] - xd), camera.fy * (rows_y @ [scale, *terms] - yd))
    camera.fx, camera.fy = float(camera.fx * scale), float(camera.fy * scale)
    camera.terms = tuple(float(t / scale) for t in terms)
    return float(np.sqrt(np.mean(error_px**2))), float(error_px.max())


def plane_grid(reach, steps=161):
    """Points on the plane z = 1 within `reach` of the axis."""
    x, y = (a.reshape(-1) for a in np.meshgrid(*[np.linspace(-reach, reach, steps)] * 2))
    inside = np.hypot(x, y) <= reach
    return x[inside], y[inside]


def pixel_grid(camera, steps=41):
    """Pixels of an image on the plane z = 1, as they would be without distortion."""
    u, v = np.meshgrid(np.linspace(0, camera.width - 1, steps), np.linspace(0, camera.height - 1, steps))
    return ((u - camera.cx) / camera.fx).reshape(-1), ((v - camera.cy) / camera.fy).reshape(-1)
