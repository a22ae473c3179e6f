//! Worlds, robots and sensors, deterministic from a seed.
