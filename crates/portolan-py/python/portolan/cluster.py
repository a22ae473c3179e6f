"""One log on many processes or machines: the bytes of one.

A log is cut into parts, each becomes a map of sums (``portolan map --shard``), and these are merged in a tree
(``portolan merge``) as they come in. Sums of whole numbers do not depend on order or grouping, so that the result is the file
that ``portolan map --ledger`` writes, byte for byte, whatever the number of parts, workers, retries and machines.

>>> portolan.cluster.map("intel.log.gz", "out", resolution=0.05, parts=4)            # processes of this machine
>>> portolan.cluster.map("intel.log.gz", "out", resolution=0.05, parts=64, ray=True)  # a cluster of Ray

Every worker reads the log by its path: it must be there for all (a network file system, or the same place on each machine).
"""

import os as _os
import subprocess as _subprocess
import sys as _sys
import tempfile as _tempfile
from concurrent import futures as _futures
from typing import Any as _Any, Callable as _Callable, Optional as _Optional, Union as _Union

from . import _portolan, _words

_Path = _Union[str, "_os.PathLike[str]"]

__all__ = ["map"]


def _run(words: "list[str]") -> None:
    """A command of portolan in a process of its own, on one thread: engines count tasks, not threads."""
    env = {**_os.environ, "RAYON_NUM_THREADS": "1"}
    done = _subprocess.run([_sys.executable, "-m", "portolan", *words], capture_output=True, text=True, env=env)
    if done.returncode:
        text = done.stderr.strip()
        raise ValueError(text[len("portolan: ") :] if text.startswith("portolan: ") else text)


def _read(folder: str) -> bytes:
    with open(_os.path.join(folder, "map.portolan"), "rb") as file:
        return file.read()


def _map_part(log: str, part: int, parts: int, options: "list[str]") -> bytes:
    """The map of a part of the log, as a file."""
    with _tempfile.TemporaryDirectory() as folder:
        out = _os.path.join(folder, "part")
        _run(["map", log, "--quiet", f"--shard={part}/{parts}", f"--out={out}", *options])
        return _read(out)


def _merge(*maps: "_Any") -> bytes:
    """The map of all scans of these maps, as a file."""
    if len(maps) == 1:
        return bytes(maps[0])
    with _tempfile.TemporaryDirectory() as folder:
        names = []
        for i, content in enumerate(maps):
            names.append(_os.path.join(folder, f"{i}.portolan"))
            with open(names[-1], "wb") as file:
                file.write(content)
        out = _os.path.join(folder, "sum")
        _run(["merge", "--quiet", "--map-only", f"--out={out}", *names])
        return _read(out)


def map(
    log: _Path,
    out: _Path,
    *,
    resolution: float,
    parts: _Optional[int] = None,
    ray: "_Any" = False,
    progress: "_Optional[_Callable[[int, int], None]]" = None,
    retries: int = 3,
    overwrite: bool = False,
    **options: _Any,
) -> None:
    """Maps a log in parts, and writes what ``portolan map --ledger`` writes into the folder ``out``.

    resolution: edge of a cell (meters). Options are those of ``portolan map``: ``max_range=20``, ``maps="tsdf,mesh"``.
    parts: into how many parts the log is cut; as many as there are processors where it is not given.
    ray: False: processes of this machine. True: tasks of Ray (``pip install ray``), of the cluster that this process is
    connected to, else of a local one that is started; a dict: the arguments of ``ray.init``.
    progress: called with the number of tasks done and of all (parts and merges).
    retries: how often Ray starts a task again whose worker was lost; it changes no byte.
    overwrite: whether a map that is in ``out`` already is replaced; else that is an error, before anything is computed.

    Each worker holds its part's map alone, but the last merge holds the whole.
    Raises ``ValueError`` with file, place and value.
    """
    count = parts if parts is not None else max(1, _os.cpu_count() or 1)
    if not isinstance(count, int) or count < 1:
        raise ValueError(f"parts: must be a whole number, 1 or more, got {parts!r}")
    for word in ("ledger", "shard", "append", "repose", "out"):
        if word in options:
            raise ValueError(f"{word}: is not an option of parts that are merged")
    if not overwrite and _os.path.exists(_os.path.join(out, "map.portolan")):
        raise ValueError(f"{_os.fspath(out)}: holds a map already; give overwrite=True to replace it, or another folder")
    words = [f"--resolution={resolution}", *_words(_absolute(options))]
    log = _os.path.abspath(_os.fspath(log))
    engine = _Ray(ray, retries) if ray else _Processes()
    try:
        whole = _tree(engine, log, count, words, progress)
    finally:
        engine.close()
    with _tempfile.TemporaryDirectory() as folder:
        name = _os.path.join(folder, "whole.portolan")
        with open(name, "wb") as file:
            file.write(whole)
        replace = ["--overwrite"] if overwrite else []
        _portolan.call(["portolan", "merge", "--quiet", name, "--out", _os.fspath(out), *replace])


def _absolute(options: "dict[str, _Any]") -> "dict[str, _Any]":
    """Files among the options by their whole names: workers are elsewhere."""
    files = ("poses", "intrinsics", "color_intrinsics")
    return {
        name: _os.path.abspath(value) if name in files and isinstance(value, (str, _os.PathLike)) and _os.path.exists(value) else value
        for name, value in options.items()
    }


def _tree(engine: "_Any", log: str, count: int, words: "list[str]", progress: "_Any") -> bytes:
    """Parts, merged two by two in the order in which they are done."""
    total, done = 2 * count - 1, 0
    pending = [engine.submit(_map_part, log, i + 1, count, words) for i in range(count)]
    ready: "list[_Any]" = []
    while True:
        finished, pending = engine.wait(pending)
        ready += finished
        done += len(finished)
        if progress is not None:
            progress(done, total)
        while len(ready) >= 2:
            pending.append(engine.submit(_merge, ready.pop(), ready.pop()))
        if not pending:
            return bytes(engine.result(ready[0]))


class _Processes:
    """Threads of this process, each of which waits for a command in a process of its own."""

    def __init__(self) -> None:
        self._pool = _futures.ThreadPoolExecutor(max(1, _os.cpu_count() or 1))

    def submit(self, task: "_Any", *args: "_Any") -> "_Any":
        return self._pool.submit(lambda: task(*(a.result() if isinstance(a, _futures.Future) else a for a in args)))

    def wait(self, pending: "list[_Any]") -> "tuple[list[_Any], list[_Any]]":
        finished, rest = _futures.wait(pending, return_when=_futures.FIRST_COMPLETED)
        for one in finished:
            one.result()
        return [p for p in pending if p in finished], [p for p in pending if p in rest]

    def result(self, of: "_Any") -> bytes:
        return of.result()

    def close(self) -> None:
        self._pool.shutdown(cancel_futures=True)


class _Ray:
    """Tasks of Ray. Maps of parts stay in its object store, where tasks of the same machine read them in place."""

    def __init__(self, how: "_Any", retries: int) -> None:
        try:
            import ray
        except ImportError as error:
            raise ImportError("ray=True needs Ray: pip install ray") from error
        self._ray: _Any = ray
        self._own = not ray.is_initialized()
        if self._own:
            ray.init(**(how if isinstance(how, dict) else {}))
        self._retries = retries

    def submit(self, task: "_Any", *args: "_Any") -> "_Any":
        return self._ray.remote(max_retries=self._retries)(task).remote(*args)

    def wait(self, pending: "list[_Any]") -> "tuple[list[_Any], list[_Any]]":
        finished, rest = self._ray.wait(pending, num_returns=1)
        return finished, rest

    def result(self, of: "_Any") -> bytes:
        try:
            return self._ray.get(of)
        except self._ray.exceptions.RayTaskError as error:
            # What the task raised, without the way that it came.
            raise (error.cause if isinstance(error.cause, Exception) else error) from None

    def close(self) -> None:
        if self._own:
            self._ray.shutdown()
