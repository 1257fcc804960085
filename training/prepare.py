"""What the network is shown of a depth image; held to training/prepared.json by a test."""
import numpy as np

WIDTH, HEIGHT = 160, 120  # of the network's input [cells]
CHANNELS = 5  # size of a cell; measured; normal x, y, z
SAME_SURFACE = 0.05  # of the depth: what lies no farther behind the nearest counts as its surface
STEEPEST = 0.06  # of the depth: the most that neighbours of a cell may differ for a normal
LOG_MIDDLE = 4.4  # -log of a usual size of a cell [m]


def block_surface(depth_m):
    """Depth of the nearest surface in each block, 0 where less than a quarter of it was measured.
    depth_m: samples x blocks [m], 0 = none."""
    measured = depth_m > 0
    nearest = np.where(measured, depth_m, np.float32(1e9)).min(axis=0)
    on_it = measured & (depth_m <= np.float32(1 + SAME_SURFACE) * nearest)
    mean = (depth_m * on_it).sum(axis=0) / np.maximum(1, on_it.sum(axis=0))
    return np.where(measured.sum(axis=0) * 4 >= len(depth_m), mean, 0).astype(np.float32)


def channels(depth_m, fx, fy, cx, cy):
    """depth_m: HEIGHT x WIDTH [m], 0 = none; the camera of this grid [cells]. Returns CHANNELS x
    HEIGHT x WIDTH, float32."""
    out = np.zeros((CHANNELS, *depth_m.shape), np.float32)
    z = depth_m.astype(np.float32)
    valid = z > 0
    out[0][valid] = np.log(z[valid] / np.float32(fx)) + np.float32(LOG_MIDDLE)
    out[1] = valid
    h, w = z.shape
    u = (np.arange(w, dtype=np.float32) - np.float32(cx)) / np.float32(fx)
    v = (np.arange(h, dtype=np.float32)[:, None] - np.float32(cy)) / np.float32(fy)
    p = np.stack([u * z, v * z, z])
    right, left = p[:, 1:-1, 2:], p[:, 1:-1, :-2]
    below, above = p[:, 2:, 1:-1], p[:, :-2, 1:-1]
    a, b = right - left, below - above
    n = np.stack([a[2] * b[1] - a[1] * b[2], a[0] * b[2] - a[2] * b[0], a[1] * b[0] - a[0] * b[1]])
    length = np.sqrt((n * n).sum(axis=0))
    middle = z[1:-1, 1:-1]
    sound = (valid[1:-1, 1:-1] & valid[1:-1, 2:] & valid[1:-1, :-2] & valid[2:, 1:-1] & valid[:-2, 1:-1]
             & (np.abs(a[2]) < STEEPEST * middle) & (np.abs(b[2]) < STEEPEST * middle) & (length > 0))
    out[2:, 1:-1, 1:-1] = np.where(sound, n / np.maximum(length, 1e-12), 0)
    return out


def blocks(depth_m, step):
    """Depth of blocks of step x step pixels."""
    samples = [depth_m[i::step, j::step] for i in range(step) for j in range(step)]
    return block_surface(np.stack([part.ravel() for part in samples])).reshape(samples[0].shape)


def reduced(depth_m, fx, fy, cx, cy):
    """A depth image of any size on the network's grid, and the camera of the grid. Cells outside the
    image are not measured."""
    h, w = depth_m.shape
    scale = max(1.0, w / WIDTH, h / HEIGHT)
    camera = fx / scale, fy / scale, (cx + 0.5) / scale - 0.5, (cy + 0.5) / scale - 0.5
    if scale == int(scale) and (h, w) == (scale * HEIGHT, scale * WIDTH):
        return blocks(depth_m, int(scale)), *camera
    depth = np.zeros((HEIGHT, WIDTH), np.float32)
    for row in range(HEIGHT):
        v0, v1 = int(row * scale), int((row + 1) * scale)
        if v1 > h:
            break
        for column in range(WIDTH):
            u0, u1 = int(column * scale), int((column + 1) * scale)
            if u1 > w:
                break
            depth[row, column] = block_surface(depth_m[v0:v1, u0:u1].reshape(-1, 1))[0]
    return depth, *camera


def prepared(depth_m, fx, fy, cx, cy):
    """The network's input for a depth image, H x W [m], 0 = none."""
    return channels(*reduced(depth_m, fx, fy, cx, cy))
