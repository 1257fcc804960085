"""Random camera paths as rows `t x y z qx qy qz qw`, and files of them in three formats."""
import numpy as np


def random_trajectory(rng, count, rate_hz=30.0, jitter_s=0.004):
    """Stamps and poses of a smooth random camera path; rows `t x y z qx qy qz qw`."""
    stamps = 1305031000.0 + np.arange(count) / rate_hz + rng.uniform(-jitter_s, jitter_s, count)
    position = np.cumsum(rng.normal(0, 0.02, (count, 3)), axis=0)
    angles = np.cumsum(rng.normal(0, 0.03, (count, 3)), axis=0)
    return np.column_stack([stamps, position, quaternions(angles)])


def quaternions(rotation_vectors):
    angle = np.linalg.norm(rotation_vectors, axis=1, keepdims=True)
    axis = rotation_vectors / np.maximum(angle, 1e-12)
    return np.column_stack([axis * np.sin(angle / 2), np.cos(angle / 2)])


def product(a, b):
    """Quaternion product, x y z w."""
    av, aw, bv, bw = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    vector = aw * bv + bw * av + np.cross(av, bv)
    return np.column_stack([vector, aw * bw - np.sum(av * bv, axis=1, keepdims=True)])


def disturbed(rng, truth, scale=1.0):
    """What a tracker would make of it: another world frame, noise, drift, missing poses."""
    estimate = truth[rng.random(len(truth)) > 0.15].copy()
    count = len(estimate)
    estimate[:, 0] += rng.uniform(-0.003, 0.003, count)
    turn = quaternions(np.tile(rng.uniform(-2, 2, (1, 3)), (count, 1)))
    inverse = turn * np.array([-1, -1, -1, 1])
    drift = np.cumsum(rng.normal(0, 0.002, (count, 3)), axis=0)
    points = np.column_stack([(estimate[:, 1:4] + drift) * scale, np.zeros(count)])
    estimate[:, 1:4] = product(product(turn, points), inverse)[:, :3] + rng.uniform(-3, 3, 3)
    noise = quaternions(rng.normal(0, 0.02, (count, 3)))
    estimate[:, 4:] = product(product(turn, estimate[:, 4:]), noise)
    return estimate


def write(path, rows):
    with open(path, "w", encoding="utf-8") as file:
        for row in rows:
            file.write(f"{row[0]:.6f} " + " ".join(f"{value:.9f}" for value in row[1:]) + "\n")


def matrices(rows):
    """3x4 pose matrices of rows `t x y z qx qy qz qw`, after the definition of the quaternion."""
    x, y, z, w = (rows[:, i] for i in (4, 5, 6, 7))
    rotation = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
                         2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                         2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1)
    return np.concatenate([rotation.reshape(-1, 3, 3), rows[:, 1:4, None]], axis=2)


def write_kitti(path, rows):
    with open(path, "w", encoding="utf-8") as file:
        for matrix in matrices(rows):
            file.write(" ".join(f"{value:.12e}" for value in matrix.ravel()) + "\n")


def write_euroc(path, rows):
    """As state_groundtruth_estimate0/data.csv: with velocities and biases behind the pose."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
                   "q_RS_y [], q_RS_z [], v_x, v_y, v_z, w_x, w_y, w_z, a_x, a_y, a_z\n")
        for t, x, y, z, qx, qy, qz, qw in rows:
            pose = ",".join(f"{value:.9f}" for value in (x, y, z, qw, qx, qy, qz))
            file.write(f"{round(t * 1e6) * 1000},{pose}" + ",0" * 9 + "\n")
