#!/usr/bin/env python3
"""The data of `compare.py`, `queries.py` and the example `workload`: a synthetic building, the same on every machine.

    python3 bench/make_data.py DIR          # numpy and opencv-python-headless; 0.3 GB, some minutes

36 x 24 x 3 m: eight rooms at a corridor, doors, windows through which rays leave, furniture, pillars. DIR gets

    lidar_building/   200 scans of 64 x 1024 beams up to 30 m, 1 cm of noise, misses absent (KITTI layout)
    rgbd_building/    150 depth images of 640 x 480 in millimetres, noise as of a structured-light camera (7-Scenes layout)
    grids/            a gyroid of 256^3, float32, and 10^6 points in the building
"""
import argparse
import multiprocessing
from pathlib import Path

import numpy as np

HEIGHT, WALL = 3.0, 0.2
WAY = [(4.5, 3), (4.5, 12), (13.5, 12), (13.5, 4), (13.5, 12), (13.5, 20), (13.5, 12), (22.5, 12), (22.5, 19)]
WAY += [(22.5, 12), (22.5, 5), (22.5, 12), (31.5, 12), (31.5, 4)]
KEPT_FREE = [*zip(WAY, WAY[1:]), ((8, 12), (13.5, 12)), ((13.5, 12), (13.5, 5))]
SCANS, RINGS, COLUMNS = 200, 64, 1024
FRAMES, WIDTH, ROWS, FOCAL, CENTRE = 150, 640, 480, 525.0, (319.5, 239.5)


def wall(along_x, at, length, openings):
    """The boxes of a wall with openings (from, to, bottom, top)."""
    boxes = []

    def part(a, b, bottom, top):
        if b - a < 1e-9 or top - bottom < 1e-9:
            return
        low, high = at - WALL / 2, at + WALL / 2
        boxes.append([a, low, bottom, b, high, top] if along_x else [low, a, bottom, high, b, top])

    start, end = length
    for a, b, bottom, top in sorted(openings):
        part(start, a, 0, HEIGHT)
        part(a, b, 0, bottom)
        part(a, b, top, HEIGHT)
        start = b
    part(start, end, 0, HEIGHT)
    return boxes


def building():
    """Boxes (two corners), cylinders (x, y, radius, bottom, top) and balls (center, radius)."""
    window = lambda c: (c - 1, c + 1, 1.0, 2.2)
    door = lambda c: (c - 0.6, c + 0.6, 0.0, 2.2)
    middles = [4.5, 13.5, 22.5, 31.5]
    boxes = [[-0.2, -0.2, -0.2, 36.2, 24.2, 0], [-0.2, -0.2, HEIGHT, 36.2, 24.2, HEIGHT + 0.2]]
    boxes += wall(True, 0, (-0.1, 36.1), [window(c - 2) for c in middles] + [window(c + 2) for c in middles])
    boxes += wall(True, 24, (-0.1, 36.1), [window(c) for c in middles])
    boxes += wall(False, 0, (-0.1, 24.1), [window(5), window(18)])
    boxes += wall(False, 36, (-0.1, 24.1), [window(5), window(18), window(12)])
    boxes += wall(True, 10.5, (0, 36), [door(c) for c in middles])
    boxes += wall(True, 13.5, (0, 36), [door(c) for c in middles])
    for i, x in enumerate([9, 18, 27]):
        boxes += wall(False, x, (0, 10.5), [door(8.5)] if i % 2 == 0 else [])
        boxes += wall(False, x, (13.5, 24), [door(15.5)] if i % 2 == 1 else [])
    cylinders, balls = [], []
    random = np.random.default_rng(20240501)
    for x0, y0 in [(x0, y0) for x0 in (0, 9, 18, 27) for y0 in (0, 13.5)]:
        furnish(random, x0, y0, boxes, cylinders, balls)
    cylinders += [[x, 13.0, 0.15, 0.0, 3.0] for x in (3.0, 9.0, 16.0, 19.5, 25.5, 29.0, 34.0)]
    return [np.array(all).astype(np.float32) for all in (boxes, cylinders, balls)]


def furnish(random, x0, y0, boxes, cylinders, balls):
    """Nine things in a room of 9 m x 10.5 m that leave ways and doors free."""
    things = tries = 0
    while things < 9 and tries < 400:
        tries += 1
        x, y, kind = random.uniform(x0 + 0.8, x0 + 8.2), random.uniform(y0 + 0.8, y0 + 9.7), random.integers(0, 5)
        w, d = random.uniform(0.4, 1.6), random.uniform(0.4, 1.0)
        h, r = random.uniform(0.4, 2.2), random.uniform(0.12, 0.35)
        if near_way(x, y, max(w, d) / 2 + 0.8) or abs(y - (8.5 if y0 < 1 else 15.5)) < 1.2:
            continue
        if kind in (0, 1):
            boxes.append([x - w / 2, y - d / 2, 0, x + w / 2, y + d / 2, h])
        elif kind == 2:  # a table
            boxes.append([x - w / 2, y - d / 2, 0.72, x + w / 2, y + d / 2, 0.76])
            for lx in (x - (w / 2 - 0.03), x + (w / 2 - 0.03)):
                for ly in (y - (d / 2 - 0.03), y + (d / 2 - 0.03)):
                    boxes.append([lx - 0.025, ly - 0.025, 0, lx + 0.025, ly + 0.025, 0.72])
        elif kind == 3:
            cylinders.append([x, y, r, 0.0, 3.0])
        else:
            balls.append([x, y, r + 0.3, r])
        things += 1


def near_way(x, y, distance):
    for a, b in KEPT_FREE:
        a, b = np.array(a, float), np.array(b, float)
        d = b - a
        t = np.clip(np.dot([x - a[0], y - a[1]], d) / max(np.dot(d, d), 1e-9), 0, 1)
        if np.hypot(*(a + t * d - [x, y])) < distance:
            return True
    return False


BOXES, CYLINDERS, BALLS = building()


def cast(o, d):
    """Distances along rays from `o` in the directions `d` (N, 3), infinite where nothing is met, and what is met."""
    o, d = o.astype(np.float32), d.astype(np.float32)
    best, met = np.full(len(d), np.inf, np.float32), np.full(len(d), -1, np.int32)

    def take(hit, t, what):
        hit &= t < best
        best[hit], met[hit] = t[hit], what

    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = [np.float32(1) / np.where(d[:, k] == 0, np.float32(1e-20), d[:, k]) for k in range(3)]
        for i, b in enumerate(BOXES):
            faces = [((b[k] - o[k]) * inverse[k], (b[k + 3] - o[k]) * inverse[k]) for k in range(3)]
            near = np.maximum.reduce([np.minimum(*pair) for pair in faces])
            far = np.minimum.reduce([np.maximum(*pair) for pair in faces])
            take((near <= far) & (near > 1e-4), near, i)
        for i, c in enumerate(CYLINDERS):
            x, y = o[0] - c[0], o[1] - c[1]
            square, half = d[:, 0] ** 2 + d[:, 1] ** 2, x * d[:, 0] + y * d[:, 1]
            root = half * half - square * (x * x + y * y - c[2] ** 2)
            t = (-half - np.sqrt(root)) / square
            z = o[2] + t * d[:, 2]
            take((root > 0) & (t > 1e-4) & (z >= c[3]) & (z <= c[4]), t, 10000 + i)
        for i, s in enumerate(BALLS):
            from_center = o - s[:3]
            half = d @ from_center
            root = half * half - (from_center @ from_center - s[3] ** 2)
            t = -half - np.sqrt(root)
            take((root > 0) & (t > 1e-4), t, 20000 + i)
    return best, met


def rotation(yaw, pitch, roll):
    (cy, cp, cr), (sy, sp, sr) = np.cos([yaw, pitch, roll]), np.sin([yaw, pitch, roll])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return about_z @ about_y @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


def pose(turn, position):
    world_from_sensor = np.eye(4)
    world_from_sensor[:3, :3], world_from_sensor[:3, 3] = turn, position
    return world_from_sensor


def lidar_poses():
    way = np.array(WAY, float)
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))]
    s = np.linspace(0, along[-1], SCANS)
    xy = np.c_[np.interp(s, along, way[:, 0]), np.interp(s, along, way[:, 1])]
    step = np.gradient(xy, axis=0)
    yaw = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    yaw = np.convolve(np.pad(yaw, 3, mode="edge"), np.ones(7) / 7, "valid")
    turn = lambda i: rotation(yaw[i], 0.02 * np.sin(0.31 * i), 0.03 * np.sin(0.17 * i + 1))
    return [pose(turn(i), [*xy[i], 1.2 + 0.03 * np.sin(0.5 * i)]) for i in range(SCANS)]


def camera_poses():
    poses = []
    for i in range(FRAMES):
        if i < 40:  # along the corridor
            u = i / 40
            x, y, yaw = 8 + 5.5 * u, 12, 0.15 * np.sin(6.28 * u)
        elif i < 60:  # a turn
            x, y, yaw = 13.5, 12, -np.pi / 2 * (i - 40) / 20
        elif i < 90:  # into a room
            u = (i - 60) / 30
            x, y, yaw = 13.5, 12 - 7 * u, -np.pi / 2 + 0.2 * np.sin(6.28 * u)
        else:  # all round it
            turn = 2 * np.pi * ((i - 90) / 60)
            x, y, yaw = 13.5 + 0.4 * np.sin(turn), 5 - 0.4 * (1 - np.cos(turn)), -np.pi / 2 + turn
        body_from_camera = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)
        turn = rotation(yaw, 0.15 + 0.10 * np.sin(0.2 * i), 0.02 * np.sin(0.13 * i)) @ body_from_camera
        poses.append(pose(turn, [x, y, 1.4]))
    return poses


def scan(job):
    folder, i, world_from_sensor = job
    up, round_ = np.meshgrid(
        np.deg2rad(np.linspace(22.5, -22.5, RINGS)), -np.arange(COLUMNS) * 2 * np.pi / COLUMNS, indexing="ij"
    )
    d = np.stack([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)], -1).reshape(-1, 3)
    t, met = cast(world_from_sensor[:3, 3], d @ world_from_sensor[:3, :3].T)
    t = t + np.random.default_rng([7, i]).normal(0, 0.01, len(t)).astype(np.float32)
    kept = np.isfinite(t) & (t <= 30.0) & (t > 0.2)
    points, intensity = (d[kept] * t[kept, None]).astype("<f4"), ((met[kept] % 97) / 97).astype("<f4")
    np.c_[points, intensity].astype("<f4").tofile(folder / "velodyne" / f"{i:06d}.bin")


def frame(job):
    import cv2

    folder, i, world_from_camera = job
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(ROWS))
    d = np.stack([(u - CENTRE[0]) / FOCAL, (v - CENTRE[1]) / FOCAL, np.ones_like(u, float)], -1).reshape(-1, 3)
    length = np.linalg.norm(d, axis=1)
    t, _ = cast(world_from_camera[:3, 3], (d / length[:, None]) @ world_from_camera[:3, :3].T)
    z = t / length
    noise = 0.0012 + 0.0019 * (np.minimum(z, 9) - 0.4) ** 2
    z = z + np.random.default_rng([11, i]).normal(0, 1, len(z)) * noise
    depth = np.where(np.isfinite(z) & (z > 0.3) & (z < 8.0), np.rint(z * 1000), 0).astype(np.uint16)
    cv2.imwrite(str(folder / f"frame-{i:06d}.depth.png"), depth.reshape(ROWS, WIDTH))
    np.savetxt(folder / f"frame-{i:06d}.pose.txt", world_from_camera, fmt="%.9f")


def grids(folder):
    along = np.linspace(0, 4 * 2 * np.pi, 256, dtype=np.float32)
    x, y, z = np.meshgrid(along, along, along, indexing="ij")
    gyroid = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    np.save(folder / "w4_gyroid_256_f32.npy", gyroid.astype(np.float32))
    points = np.random.default_rng(9).uniform([0.05, 0.05, 0.05], [35.95, 23.95, 2.95], (1_000_000, 3))
    points.astype("<f4").tofile(folder / "w5_queries_1e6x3.f32")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="DIR")
    out = parser.parse_args().out
    lidar, camera = out / "lidar_building", out / "rgbd_building"
    for folder in (lidar / "velodyne", camera, out / "grids"):
        folder.mkdir(parents=True, exist_ok=True)
    scans, frames = lidar_poses(), camera_poses()
    np.savetxt(lidar / "poses.txt", np.array(scans)[:, :3].reshape(SCANS, 12), fmt="%.9f")
    (lidar / "calib.txt").write_text("Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n")
    intrinsics = [[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1]]
    np.savetxt(camera / "camera-intrinsics.txt", np.array(intrinsics), fmt="%.6f")
    with multiprocessing.Pool() as pool:
        pool.map(scan, [(lidar, i, p) for i, p in enumerate(scans)], chunksize=5)
        pool.map(frame, [(camera, i, p) for i, p in enumerate(frames)], chunksize=5)
    grids(out / "grids")


if __name__ == "__main__":
    main()
