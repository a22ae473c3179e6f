"""What a record says of the run: commit, machine, interpreter and load."""
import os
import platform
import subprocess
from pathlib import Path


def about(load_before):
    git = lambda *words: subprocess.run(
        ["git", "-C", Path(__file__).parent, *words], capture_output=True, text=True
    ).stdout.strip()
    with open("/proc/cpuinfo") as file:
        cpu = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), platform.processor())
    return {
        "commit": git("rev-parse", "HEAD"),
        "changed": bool(git("status", "--porcelain", "--untracked-files=no")),
        "cpu": cpu,
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "load": {"before": load_before, "after": os.getloadavg()},
    }
