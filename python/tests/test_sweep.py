"""Sweeps: the program's numbers, whoever runs the parts."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import pydriftless as dl
from conftest import table

GRID = {"bar1.phi": (-np.pi, np.pi, 9), "bar2.phi": (-2.0, 2.0, 7)}


def same(one, other):
    assert one.rows.tobytes() == other.rows.tobytes()
    assert np.array_equal(one.status, other.status) and np.array_equal(one.flip_bar, other.flip_bar)
    assert one.causes == other.causes


def test_a_grid_is_that_of_the_program(free, scenes, program, tmp_path):
    vary = ["--vary", "bar1.phi=-pi..pi:9", "--vary", "bar2.phi=-2..2:7"]
    code, _, said = program("sweep", scenes / "free.json", *vary, "--until", 5, "--no-charts", "--out", tmp_path)
    assert code == 0, said
    (path,) = tmp_path.rglob("sweep.csv")
    header, rows = table(path)
    sweep = free.sweep(GRID, until=5)
    assert sweep.heads == header[:-3] and sweep.grid == (9, 7) and sweep.success
    numbers = np.array([[float(word) if word else np.nan for word in row[:-3]] for row in rows])
    assert np.array_equal(sweep.rows, numbers, equal_nan=True)
    assert sweep.map("flip_time").shape == (9, 7)


def test_parts_by_executors_are_the_same_bytes(free):
    whole = free.sweep(GRID, until=5)
    with ThreadPoolExecutor(2) as client:
        same(whole, free.sweep(GRID, until=5, client=client, parts=5))
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as client:
        same(whole, free.sweep(GRID, until=5, client=client))
    parts = [free.sweep(GRID, until=5, shard=(number, 4)) for number in range(1, 5)]
    assert np.concatenate([part.rows for part in parts]).tobytes() == whole.rows.tobytes()


def test_a_list_of_points(free):
    random = np.random.default_rng(7)
    points = {"bar1.phi": random.uniform(-3, 3, 23), "bar2.omega": random.normal(size=23)}
    sweep = free.sweep(points, until=4, method="taylor")
    assert np.array_equal(sweep["start.bar1.phi"], points["bar1.phi"])
    for k in (0, 11, 22):
        alone = free.with_({name: values[k] for name, values in points.items()})
        run = alone.run(until=4, method="taylor", every=0.5, trust="off")
        assert run["bar2.phi"][-1] == pytest.approx(sweep["bar2.phi"][k], abs=1e-7)
    with ThreadPoolExecutor(2) as client:
        same(sweep, free.sweep(points, until=4, method="taylor", client=client, parts=4))
    with pytest.raises(dl.RequestRefused, match="finite"):
        free.sweep({"bar1.phi": [0.1, np.nan]})
    with pytest.raises(ValueError, match="one length"):
        free.sweep({"bar1.phi": [0.1, 0.2], "bar2.phi": [0.1]})
    with pytest.raises(dl.DriftlessError):
        free.sweep({"bar9.phi": (0, 1, 2)})


def test_failures_keep_their_numbers(scenes):
    scene = dl.load(scenes / "free.json")
    points = {"bar1.length": [0.6, -1.0, 0.5, 0.7, -2.0]}
    sweep = scene.sweep(points, until=1)
    assert list(sweep.status) == [0, 2, 0, 0, 2] and set(sweep.causes) == {1, 4}
    with ThreadPoolExecutor(2) as client:
        same(sweep, scene.sweep(points, until=1, client=client, parts=3))


def test_rows_go_to_files_in_chunks(free, tmp_path):
    whole = free.sweep(GRID, until=3)
    path = tmp_path / "points.csv"
    kept = free.sweep(GRID, until=3, to=path, chunk=10)
    assert len(kept) == 0 and kept.success
    header, rows = table(path)
    numbers = np.array([[float(word) if word else np.nan for word in row[:-1]] for row in rows])
    assert header[:-1] == whole.heads and np.array_equal(numbers, whole.rows, equal_nan=True)
    with pytest.raises(ValueError, match="csv or .parquet"):
        free.sweep(GRID, until=3, to=tmp_path / "points.txt")
    parquet = pytest.importorskip("pyarrow.parquet")
    free.sweep(GRID, until=3, to=tmp_path / "points.parquet", chunk=10)
    read = parquet.read_table(tmp_path / "points.parquet")
    assert np.array_equal(read["bar2.phi [rad]"].to_numpy(), whole["bar2.phi"])


def test_frames_and_datasets(free):
    sweep = free.sweep(GRID, until=2)
    pytest.importorskip("pandas")
    assert set(sweep.to_pandas()["status"]) == {"done"}
    pytest.importorskip("xarray")
    data = sweep.to_xarray()
    assert data["energy_drift"].shape == (9, 7) and float(data["start.bar1.phi"][-1]) == np.pi


def test_dask_gives_the_same_bytes_when_a_worker_is_killed(free):
    distributed = pytest.importorskip("distributed")
    grid = {"bar1.phi": (-3.0, 3.0, 40), "bar2.phi": (-3.0, 3.0, 25)}
    whole = free.sweep(grid, until=20)
    with distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            same(whole, free.sweep(grid, until=20, client=client))
            import threading

            def kill():
                next(iter(cluster.workers.values())).process.process._process.kill()

            threading.Timer(0.05, kill).start()
            same(whole, free.sweep(grid, until=20, client=client, parts=40))


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_file_that_was_begun_is_gone_on_with(free, tmp_path, monkeypatch, ending):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    from pydriftless import _sweep

    whole, begun = tmp_path / f"whole.{ending}", tmp_path / f"begun.{ending}"
    free.sweep(GRID, until=2, to=whole, chunk=7)
    count, real = 0, _sweep._part

    def failing(*arguments):
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt
        return real(*arguments)

    monkeypatch.setattr(_sweep, "_part", failing)
    with pytest.raises(KeyboardInterrupt):
        free.sweep(GRID, until=2, to=begun, chunk=7, resume=True)
    if ending == "csv":
        with open(begun, "a") as file:
            file.write("half a li")
    with pytest.raises(ValueError, match="another sweep"):
        free.sweep(GRID, until=1, to=begun, chunk=7, resume=True)
    free.sweep(GRID, until=2, to=begun, chunk=7, resume=True)
    if ending == "csv":
        assert begun.read_bytes() == whole.read_bytes()
    else:
        import pyarrow.parquet as pq

        assert pq.read_table(begun).equals(pq.read_table(whole))
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([whole.name, begun.name])
