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
    with pytest.raises(ValueError, match="bar1.phi: .* real numbers"):
        free.sweep({"bar1.phi": np.array([0.1, 0.2 + 0.1j])})
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
    numbers = np.array([[float(word) if word else np.nan for word in row[:-3]] for row in rows])
    assert header[:-3] == whole.heads and np.array_equal(numbers, whole.rows, equal_nan=True)
    with pytest.raises(ValueError, match="csv or .parquet"):
        free.sweep(GRID, until=3, to=tmp_path / "points.txt")
    parquet = pytest.importorskip("pyarrow.parquet")
    free.sweep(GRID, until=3, to=tmp_path / "points.parquet", chunk=10)
    read = parquet.read_table(tmp_path / "points.parquet")
    assert np.array_equal(read["bar2.phi [rad]"].to_numpy(), whole["bar2.phi"])


WORDS = [["", "refused"], ["", "refused"], ["bar2", "done"], ["bar2", "done"]]


def test_files_and_frames_tell_bars_and_causes_in_words(free, tmp_path):
    points = {"bar1.length": (-0.5, 1, 4), "bar2.omega": (20, 20, 1)}
    whole = free.sweep(points, until=2, to_flip=True)
    assert whole.bars == ["bar1", "bar2"] and list(whole.flip_bar) == [-1, -1, 1, 1]
    free.sweep(points, until=2, to_flip=True, to=tmp_path / "points.csv", chunk=1)
    header, rows = table(tmp_path / "points.csv")
    assert header[-3:] == ["flip_bar", "status", "cause"] and [row[-3:-1] for row in rows] == WORDS
    causes = [whole.causes.get(point, "") for point in range(4)]
    assert [row[-1] for row in rows] == causes and causes[0] != causes[1]
    late = free.sweep(points, until=2, to_flip=True, shard=(2, 4))
    assert late.first == 1 and late.causes == {1: causes[1]}
    parquet = pytest.importorskip("pyarrow.parquet")
    free.sweep(points, until=2, to_flip=True, to=tmp_path / "points.parquet", chunk=1)
    read = parquet.read_table(tmp_path / "points.parquet").to_pydict()
    assert read["flip_bar"] == [None, None, 1, 1] and read["cause"] == [cause or None for cause in causes]
    assert read["t [s]"][:2] == [None, None] and read["bar2.phi [rad]"][3] == whole["bar2.phi"][3]
    pytest.importorskip("pandas")
    assert list(whole.to_pandas()["flip_bar"]) == [None, None, "bar2", "bar2"]
    assert list(late.to_pandas()["cause"]) == [causes[1]]


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
    assert begun.read_bytes() == whole.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([whole.name, begun.name])


SMALL = {"bar1.phi": (-3, 3, 4), "bar2.phi": (0, 1, 3)}


@pytest.fixture
def cut(free, monkeypatch):
    """Begins a sweep of four parts, and ends it after some of them."""
    from pydriftless import _sweep

    def begin(to, parts, until=0.5, resume=True):
        with monkeypatch.context() as patch:
            left, real = iter(range(parts)), _sweep._part

            def failing(*arguments):
                if next(left, None) is None:
                    raise KeyboardInterrupt
                return real(*arguments)

            patch.setattr(_sweep, "_part", failing)
            with pytest.raises(KeyboardInterrupt):
                free.sweep(SMALL, until=until, to=to, chunk=3, resume=resume)

    return begin


def damage(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2 :] = b"X" * (len(content) - len(content) // 2)
    path.write_bytes(content)


@pytest.mark.parametrize(
    "harm",
    [
        lambda path: path.unlink(),
        lambda path: path.write_bytes(path.read_bytes()[:200]),
        damage,
        lambda path: damage(path.with_name("begun.csv.progress")),
        lambda path: path.with_name("begun.csv.progress").write_text("{"),
    ],
)
def test_a_table_that_was_begun_and_changed_is_in_the_end_whole(free, tmp_path, cut, harm):
    free.sweep(SMALL, until=0.5, to=tmp_path / "whole.csv", chunk=3)
    begun = tmp_path / "begun.csv"
    cut(begun, 2)
    harm(begun)
    free.sweep(SMALL, until=np.float32(0.5), to=begun, chunk=3, resume=True)
    assert begun.read_bytes() == (tmp_path / "whole.csv").read_bytes() and len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    "harm",
    [
        lambda parts: damage(parts / "000002.parquet"),
        lambda parts: (parts / "000001.parquet").unlink(),
        lambda parts: [part.unlink() for part in parts.iterdir()],
        lambda parts: damage(parts.with_name("begun.parquet.progress")),
    ],
)
def test_parts_that_were_lost_are_computed_again(free, tmp_path, cut, harm):
    pytest.importorskip("pyarrow")
    free.sweep(SMALL, until=0.5, to=tmp_path / "whole.parquet", chunk=3)
    begun = tmp_path / "begun.parquet"
    cut(begun, 3)
    harm(tmp_path / "begun.parquet.parts")
    assert free.sweep(SMALL, until=0.5, to=begun, chunk=3, resume=True).counts.sum() == 12
    assert begun.read_bytes() == (tmp_path / "whole.parquet").read_bytes() and len(list(tmp_path.iterdir())) == 2


def test_a_parquet_is_whole_or_not_there(free, tmp_path, cut, monkeypatch):
    parquet = pytest.importorskip("pyarrow.parquet")
    from pydriftless import _files

    cut(tmp_path / "cut.parquet", 2, resume=False)
    assert not list(tmp_path.iterdir())
    path = tmp_path / "points.parquet"
    seen = []
    monkeypatch.setattr(_files.shutil, "rmtree", lambda *_, **__: seen.append(path.exists()))
    free.sweep(SMALL, until=0.5, to=path, chunk=3, resume=True)
    assert seen[-1] and parquet.read_metadata(path).num_rows == 12


def test_a_sweep_anew_leaves_nothing_to_go_on_with(free, tmp_path, cut):
    free.sweep(SMALL, until=0.5, to=tmp_path / "whole.csv", chunk=3)
    mixed = tmp_path / "mixed.csv"
    cut(mixed, 2)
    cut(mixed, 3, until=0.2, resume=False)
    free.sweep(SMALL, until=0.5, to=mixed, chunk=3, resume=True)
    assert mixed.read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_files_tell_of_refused_points(free, tmp_path):
    sweep = free.sweep({"bar1.length": (-0.5, 0.5, 3)}, until=0.1, to=tmp_path / "points.csv", chunk=2)
    assert not sweep.success and list(sweep.counts) == [1, 0, 2, 0] and "2 refused" in repr(sweep)


@pytest.mark.parametrize(
    "vary, options, said",
    [
        ({"bar1.phi": (-3, 3, 64), "bar2.phi": np.zeros(3)}, {}, "numpy.linspace"),
        ({"bar1.phi": np.array([])}, {}, "no points"),
        ({"bar1.phi": (0, 1, 2.5)}, {}, "count of bar1.phi is a whole number"),
        ({"bar1.phi": (0, 1, 0)}, {}, "from 1 up"),
        ({"bar1.phi": (0, float("inf"), 3)}, {}, "finite ends"),
        ({"bar1.phi": (0, "pi", 3)}, {}, "a range is"),
        ({"bar1.phi": (0, 1)}, {}, "a range is"),
        ({"bar1.phi": ["a", "b"]}, {}, "array of numbers"),
        ({"bar1.phi": np.ma.array([1.0, 2.0], mask=[0, 1])}, {}, "masked"),
        (SMALL, {"shard": (0, 4)}, "first of shard"),
        (SMALL, {"shard": (5, 4)}, "from 1 to 4"),
        (SMALL, {"shard": (1, 0)}, "second of shard"),
        (SMALL, {"shard": 3}, "part I of N"),
        (SMALL, {"chunk": 0, "to": "points.csv"}, "chunk is a whole number from 1 up"),
        (SMALL, {"chunk": 2.5, "to": "points.csv"}, "chunk"),
        (SMALL, {"parts": 0}, "parts"),
        (SMALL, {"threads": -1}, "from 0 to 1024"),
        (SMALL, {"threads": 1025}, "from 0 to 1024"),
        (SMALL, {"resume": True}, "name it by to="),
    ],
)
def test_what_is_no_sweep_is_refused(free, vary, options, said):
    with pytest.raises(ValueError, match=said):
        free.sweep(vary, until=0.1, **options)


def test_a_share_of_nothing_has_columns_alone(free, tmp_path):
    path = tmp_path / "points.csv"
    free.sweep({"bar1.phi": []}, until=0.1, to=path)
    header, rows = table(path)
    assert header[0] == "start.bar1.phi [rad]" and rows == []
    empty = free.sweep({"bar1.phi": [0.1, 0.2]}, until=0.1, shard=(1, 9))
    assert empty.rows.shape == (0, len(header) - 3) and empty.success
    assert len(free.sweep({"bar1.phi": [0.1, 0.2]}, until=0.1, threads=1024)) == 2


def test_what_is_varied_is_not_asked_for_as_well(free):
    with pytest.raises(dl.RequestRefused, match="it is varied, and until"):
        free.sweep({"until": [1.0, 2.0]}, until=0.5)
