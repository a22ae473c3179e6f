"""Writes a tiny planar log (room.log) and a tiny log of depth images with colors (corner/)."""
import json, math, os, struct, zlib

# A room of 4 m x 3 m, seen by a laser of 61 beams over 270 degrees from three poses.
with open("room.log", "w") as f:
    for k, (x, y, t) in enumerate([(1.0, 1.0, 0.0), (1.5, 1.1, 0.4), (2.0, 1.4, 0.9)]):
        ranges = []
        for i in range(61):
            a = t + math.radians(-135 + 4.5 * i)
            dx, dy = math.cos(a), math.sin(a)
            hits = [(w - p) / d for w, p, d in [(4, x, dx), (0, x, dx), (3, y, dy), (0, y, dy)] if abs(d) > 1e-9]
            ranges.append(min(h for h in hits if h > 0))
        beams = " ".join(f"{r:.3f}" for r in ranges)
        f.write(f"ROBOTLASER1 0 {math.radians(-135):.6f} {math.radians(270):.6f} {math.radians(4.5):.6f} 20.0 0.01 0 "
                f"61 {beams} 0 {x} {y} {t} {x} {y} {t} 0 0 0.5 0.5 0.5 {k}.0 host {k}.0\n")

def png(path, width, height, bits, color, row):
    raw = b"".join(b"\0" + row(v) for v in range(height))
    def chunk(tag, body):
        return struct.pack(">I", len(body)) + tag + body + struct.pack(">I", zlib.crc32(tag + body))
    head = struct.pack(">IIBBBBB", width, height, bits, color, 0, 0, 0)
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))

# A wall at 1.5 m and a floor 0.4 m below, seen by a camera of 64 x 48 pixels from two places.
W, H, F = 64, 48, 50.0
for folder in ("depth", "color"):
    os.makedirs("corner/" + folder, exist_ok=True)
json.dump({"width": W, "height": H,
           "intrinsic_matrix": [F, 0, 0, 0, F, 0, (W - 1) / 2, (H - 1) / 2, 1]}, open("corner/camera_intrinsic.json", "w"))
log = ""
for k, x in enumerate([0.0, 0.1]):
    def depth(u, v):
        down = (v - (H - 1) / 2) / F
        return round(1000 * min(1.5, 0.4 / down if down > 0 else 9))
    def color(u, v):
        return bytes((4 * u, 5 * v, 128))
    png(f"corner/depth/{k:06}.png", W, H, 16, 0, lambda v: b"".join(struct.pack(">H", depth(u, v)) for u in range(W)))
    png(f"corner/color/{k:06}.png", W, H, 8, 2, lambda v: b"".join(color(u, v) for u in range(W)))
    log += f"{k} {k} {k + 1}\n1 0 0 {x}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
open("corner/trajectory.log", "w").write(log)
